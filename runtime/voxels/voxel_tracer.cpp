#include "runtime/voxels/voxel_tracer.h"

#include <algorithm>
#include <bit>

#include "runtime/simd.h"
#include "runtime/voxels/voxel_walk.h"

namespace packtrace {
namespace {

/// The nodes above a voxel, kept while a ray stays within them.
class NodePath {
public:
  explicit NodePath(const OccupancyStream& stream) : stream_(stream), last_(stream.levels() - 1) {}

  /// Whether a voxel is set; if not, `shift` is the size of the empty cell around it.
  [[gnu::always_inline]] bool test(VoxelIndex v, uint32_t& shift) {
    const auto difference =
        static_cast<uint32_t>(std::bit_width((v[0] ^ before_[0]) | (v[1] ^ before_[1]) | (v[2] ^ before_[2])));
    depth_ = std::min(depth_, last_ + 1 - std::min(difference, last_ + 1));
    before_ = v;
    for (;;) {
      shift = last_ - depth_;
      if (depth_ == 0) {
        const uint64_t bit = top_bit(v);
        if (!stream_.mask_bit(0, bit)) return is_full(0, bit);
        open(stream_.node(0, bit));
        continue;
      }
      Node& node = node_[depth_];
      const uint32_t octant = (v[0] >> shift & 1) + 2 * (v[1] >> shift & 1) + 4 * (v[2] >> shift & 1);
      if ((node.mask >> octant & 1) == 0) return depth_ < last_ && is_full(depth_, 8 * node.number + octant);
      if (depth_ == last_) return true;
      if (node.rank == kUnknown) node.rank = stream_.rank(depth_, 8 * node.number);
      const auto before = static_cast<uint32_t>(std::popcount(node.mask & ((1u << octant) - 1)));
      open(stream_.node_of_edge(depth_, node.rank + before));
    }
  }

private:
  static constexpr uint64_t kUnknown = ~uint64_t{0};

  struct Node {
    uint64_t number;
    uint64_t rank; ///< set bits of its level before it; kUnknown until it is needed
    uint32_t mask;
  };

  /// Goes down to a node.
  [[gnu::always_inline]] void open(uint64_t number) {
    ++depth_;
    node_[depth_] = {number, kUnknown, stream_.mask(depth_, number)};
  }

  bool is_full(uint32_t level, uint64_t bit) const {
    return has_full_ && stream_.cell(level, bit) == OccupancyStream::Cell::kFull;
  }

  uint64_t top_bit(VoxelIndex v) const {
    const auto& top = stream_.header().top;
    return (uint64_t{v[2] >> last_} * top[1] + (v[1] >> last_)) * top[0] + (v[0] >> last_);
  }

  const OccupancyStream& stream_;
  const uint32_t last_;
  const bool has_full_ = (stream_.header().flags & voxels::kHasFull) != 0;
  uint32_t depth_ = 0; // level of the deepest node that holds before_
  VoxelIndex before_{};
  std::array<Node, voxels::kMaxLevels> node_; // by level, from 1 to depth_
};

/// @tparam kFromEmpty ignore voxels before the first empty one
template <class Real, bool kFromEmpty = false>
[[gnu::always_inline]] inline std::optional<VoxelHit<Real>>
trace(const OccupancyStream& stream, glm::vec<3, Real> origin, glm::vec<3, Real> direction, Real t_min, Real t_max) {
  VoxelWalk<Real> walk(origin, direction);
  if (!walk.enter(stream.size(), t_min, t_max)) return std::nullopt;
  NodePath path(stream);
  bool counts = !kFromEmpty;
  for (uint32_t shift = 0;;) {
    const bool set = path.test(walk.voxel(), shift);
    if (set && counts) return VoxelHit<Real>{walk.t(), walk.voxel(), walk.axis()};
    counts |= !set;
    if (!walk.leave_cell(shift, t_max)) return std::nullopt;
  }
}

// Free functions, because clang refuses several versions of a function after its first call, and another source of the
// same batch may have called the members.
PACKTRACE_AVX2_CLONES std::optional<VoxelHit<double>> trace_double(const OccupancyStream& stream, glm::dvec3 origin,
                                                                   glm::dvec3 direction, double t_min, double t_max) {
  return trace<double>(stream, origin, direction, t_min, t_max);
}

PACKTRACE_AVX2_CLONES std::optional<VoxelHit<double>>
trace_from_empty(const OccupancyStream& stream, glm::dvec3 origin, glm::dvec3 direction, double t_min, double t_max) {
  return trace<double, true>(stream, origin, direction, t_min, t_max);
}

PACKTRACE_AVX2_CLONES std::optional<VoxelHit<float>> trace_float(const OccupancyStream& stream, glm::vec3 origin,
                                                                 glm::vec3 direction, float t_min, float t_max) {
  return trace<float>(stream, origin, direction, t_min, t_max);
}

} // namespace

std::optional<VoxelHit<double>> VoxelTracer::first_hit(glm::dvec3 origin, glm::dvec3 direction, double t_min,
                                                       double t_max) const {
  return trace_double(*stream_, origin, direction, t_min, t_max);
}

std::optional<VoxelHit<float>> VoxelTracer::first_hit(glm::vec3 origin, glm::vec3 direction, float t_min,
                                                      float t_max) const {
  return trace_float(*stream_, origin, direction, t_min, t_max);
}

std::optional<VoxelHit<double>> VoxelTracer::first_hit_from_empty(glm::dvec3 origin, glm::dvec3 direction, double t_min,
                                                                  double t_max) const {
  return trace_from_empty(*stream_, origin, direction, t_min, t_max);
}

bool VoxelTracer::occluded(glm::dvec3 origin, glm::dvec3 direction, double t_min, double t_max) const {
  return first_hit(origin, direction, t_min, t_max).has_value();
}

} // namespace packtrace
