#include "runtime/voxels/voxel_tracer.h"

#include "runtime/simd.h"
#include "runtime/voxels/voxel_walk.h"

namespace packtrace {
namespace {

/// The nodes above a voxel, kept while a ray stays within them.
class NodePath {
public:
  explicit NodePath(const OccupancyStream& stream) : stream_(stream), last_(stream.levels() - 1) {}

  /// Whether a voxel is set; if not, `shift` says how large the empty cell around it is.
  [[gnu::always_inline]] bool test(VoxelIndex v, uint32_t& shift) {
    const uint32_t difference = (v[0] ^ before_[0]) | (v[1] ^ before_[1]) | (v[2] ^ before_[2]);
    while (depth_ > 0 && difference >> (last_ - depth_ + 1) != 0) --depth_;
    before_ = v;
    for (;; ++depth_) {
      const uint32_t s = last_ - depth_;
      const uint64_t bit =
          depth_ == 0 ? top_bit(v) : 8 * node_[depth_] + (v[0] >> s & 1) + 2 * (v[1] >> s & 1) + 4 * (v[2] >> s & 1);
      if (depth_ == last_ || !stream_.mask_bit(depth_, bit)) {
        shift = s;
        if (depth_ == last_) return stream_.mask_bit(depth_, bit);
        return has_full_ && stream_.cell(depth_, bit) == OccupancyStream::Cell::kFull;
      }
      node_[depth_ + 1] = stream_.node(depth_, bit);
    }
  }

private:
  uint64_t top_bit(VoxelIndex v) const {
    const auto& top = stream_.header().top;
    return (uint64_t{v[2] >> last_} * top[1] + (v[1] >> last_)) * top[0] + (v[0] >> last_);
  }

  const OccupancyStream& stream_;
  const uint32_t last_;
  const bool has_full_ = (stream_.header().flags & voxels::kHasFull) != 0;
  uint32_t depth_ = 0; // level of the deepest node that holds before_
  VoxelIndex before_{};
  std::array<uint64_t, voxels::kMaxLevels> node_{};
};

template <class Real>
[[gnu::always_inline]] inline std::optional<VoxelHit<Real>>
trace(const OccupancyStream& stream, glm::vec<3, Real> origin, glm::vec<3, Real> direction, Real t_min, Real t_max) {
  VoxelWalk<Real> walk(origin, direction);
  if (!walk.enter(stream.size(), t_min, t_max)) return std::nullopt;
  NodePath path(stream);
  for (uint32_t shift = 0;;) {
    if (path.test(walk.voxel(), shift)) return VoxelHit<Real>{walk.t(), walk.voxel(), walk.axis()};
    if (!walk.leave_cell(shift, t_max)) return std::nullopt;
  }
}

} // namespace

PACKTRACE_AVX2_CLONES std::optional<VoxelHit<double>> VoxelTracer::first_hit(glm::dvec3 origin, glm::dvec3 direction,
                                                                             double t_min, double t_max) const {
  return trace<double>(*stream_, origin, direction, t_min, t_max);
}

PACKTRACE_AVX2_CLONES std::optional<VoxelHit<float>> VoxelTracer::first_hit(glm::vec3 origin, glm::vec3 direction,
                                                                            float t_min, float t_max) const {
  return trace<float>(*stream_, origin, direction, t_min, t_max);
}

} // namespace packtrace
