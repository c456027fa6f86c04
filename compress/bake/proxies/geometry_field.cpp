#include "compress/bake/proxies/geometry_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/proxies/cancellation.h"
#include "compress/bake/proxies/geometry_voxels.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

using voxels::kFieldBand;
using voxels::kFieldMargin;

constexpr uint32_t kNoTriangle = ~0u;

class FieldBuilder {
public:
  FieldBuilder(const OccludingTriangles& source, const VoxelFrame& frame) {
    const double per_voxel = source.step / frame.edge;
    for (size_t a = 0; a < 3; ++a) size_[a] = frame.size[a] + 2 * kFieldMargin;
    for (const OccludingTriangle& t : source.triangles) {
      auto& corners = triangles_.emplace_back();
      for (size_t i = 0; i < 3; ++i) {
        const LatticePoint& p = t.corners[i];
        corners[i] =
            DVec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])) * per_voxel +
            (double{kFieldMargin} - 0.5);
      }
    }
    nearest_.assign(count(), kNoTriangle);
    distances_.assign(count(), std::numeric_limits<float>::infinity());
  }

  void seed() {
    for (uint32_t t = 0; t < triangles_.size(); ++t)
      for_samples_near(t, 0.5, [&](size_t i, DVec3 p) { offer(i, p, t); });
  }

  /// Each sample considers the triangles of its 26 neighbours at a distance of `step`.
  void flood(int64_t step) {
    const std::vector<uint32_t> known = nearest_;
    const auto [nx, ny, nz] = size_;
    tbb::parallel_for(int64_t{0}, int64_t{nz}, [&](int64_t z) {
      stop_if_cancelled();
      for (int64_t y = 0; y < ny; ++y)
        for (int64_t x = 0; x < nx; ++x) {
          const size_t here = index(x, y, z);
          uint32_t last = nearest_[here];
          for (int64_t n = 0; n < 27; ++n) {
            const int64_t a = x + (n % 3 - 1) * step, b = y + (n / 3 % 3 - 1) * step, c = z + (n / 9 - 1) * step;
            if (a < 0 || b < 0 || c < 0 || a >= nx || b >= ny || c >= nz) continue;
            const uint32_t triangle = known[index(a, b, c)];
            if (triangle == kNoTriangle || triangle == last) continue;
            offer(here, DVec3(x, y, z), triangle);
            last = triangle;
          }
        }
    });
  }

  void flood_all() {
    flood(1);
    int64_t step = 1;
    while (2 * step < *std::max_element(size_.begin(), size_.end())) step *= 2;
    for (; step > 0; step /= 2) flood(step);
  }

  /// Makes all distances within the band exact, and returns how many were not.
  uint64_t repair() {
    std::vector<uint8_t> wrong(count());
    for (uint32_t t = 0; t < triangles_.size(); ++t)
      for_samples_near(t, kFieldBand, [&](size_t i, DVec3 p) { wrong[i] |= offer(i, p, t); });
    return static_cast<uint64_t>(std::count(wrong.begin(), wrong.end(), uint8_t{1}));
  }

  void negate_inside(const VoxelSet& inside) {
    inside.for_each([&](VoxelIndex v) {
      float& d = distances_[index(v[0] + kFieldMargin, v[1] + kFieldMargin, v[2] + kFieldMargin)];
      d = -d;
    });
  }

  /// Whether samples well inside are near all of the surface. They are not where the geometry is thinner than about a
  /// voxel: interpolated distances are positive on both sides there, and rays would pass through.
  bool resolves_inside() const {
    for (const auto& [a, b, c] : triangles_) {
      stop_if_cancelled();
      const DVec3 ab = b - a, ac = c - a;
      const double longest = std::max({glm::length(ab), glm::length(ac), glm::length(ab - ac)});
      const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * longest)));
      for (int u = 0; u <= steps; ++u)
        for (int v = 0; u + v <= steps; ++v)
          if (!is_near_inside(a + (ab * double(u) + ac * double(v)) / double(steps))) return false;
    }
    return true;
  }

  void forget_sign() {
    for (float& d : distances_) d = std::abs(d);
  }

  const VoxelIndex& size() const { return size_; }
  const std::vector<float>& distances() const { return distances_; }

private:
  /// Whether one of the 6^3 samples around a point lies at least kDeep inside.
  bool is_near_inside(DVec3 p) const {
    constexpr float kDeep = -0.4f; // a wall of .8 voxels or less has no such sample
    std::array<int64_t, 3> first{}, last{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<size_t>(axis);
      const auto low = static_cast<int64_t>(std::floor(p[axis]));
      first[i] = std::max<int64_t>(low - 2, 0), last[i] = std::min<int64_t>(low + 3, int64_t{size_[i]} - 1);
    }
    for (int64_t z = first[2]; z <= last[2]; ++z)
      for (int64_t y = first[1]; y <= last[1]; ++y)
        for (int64_t x = first[0]; x <= last[0]; ++x)
          if (distances_[index(x, y, z)] <= kDeep) return true;
    return false;
  }

  size_t count() const { return size_t{size_[0]} * size_[1] * size_[2]; }
  size_t index(int64_t x, int64_t y, int64_t z) const { return static_cast<size_t>((z * size_[1] + y) * size_[0] + x); }

  /// Keeps a triangle if it is nearer than the one that is known, and returns whether it is.
  bool offer(size_t sample, DVec3 p, uint32_t triangle) {
    const auto& [a, b, c] = triangles_[triangle];
    const auto distance = static_cast<float>(glm::distance(p, nearest_point(p, a, b, c)));
    if (!(distance < distances_[sample])) return false;
    distances_[sample] = distance, nearest_[sample] = triangle;
    return true;
  }

  /// Visits samples at most `reach` from a triangle's box that may lie nearer to it than to what is known.
  template <class Visit>
  void for_samples_near(uint32_t triangle, double reach, const Visit& visit) const {
    const auto& [a, b, c] = triangles_[triangle];
    const DVec3 lo = glm::min(a, glm::min(b, c)), hi = glm::max(a, glm::max(b, c));
    std::array<int64_t, 3> first{}, last{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<size_t>(axis);
      first[i] = std::max<int64_t>(static_cast<int64_t>(std::ceil(lo[axis] - reach)), 0);
      last[i] = std::min<int64_t>(static_cast<int64_t>(std::floor(hi[axis] + reach)), int64_t{size_[i]} - 1);
    }
    for (int64_t z = first[2]; z <= last[2]; ++z) {
      stop_if_cancelled();
      for (int64_t y = first[1]; y <= last[1]; ++y)
        for (int64_t x = first[0]; x <= last[0]; ++x) {
          const DVec3 p(x, y, z), outside = glm::max(glm::max(lo - p, p - hi), DVec3(0.0));
          const double known = distances_[index(x, y, z)];
          if (glm::dot(outside, outside) < known * known) visit(index(x, y, z), p);
        }
    }
  }

  VoxelIndex size_{};
  std::vector<std::array<DVec3, 3>> triangles_; // in voxels from sample (0, 0, 0)
  std::vector<uint32_t> nearest_;
  std::vector<float> distances_;
};

uint64_t field_bytes(const VoxelFrame& frame) {
  uint64_t samples = 1;
  for (const uint32_t n : frame.size) samples *= n + 2 * kFieldMargin;
  return 16 * samples;
}

MemoryReservation reserve_field(const OccludingTriangles& source, uint32_t voxels, const MemoryBudget& budget,
                                const std::string& what) {
  const uint64_t bytes = field_bytes(voxel_frame(source, voxels));
  if (bytes > budget.left()) {
    uint32_t fits = voxels;
    while (fits > 1 && field_bytes(voxel_frame(source, fits)) > budget.left()) --fits;
    throw MemoryError("distance field of " + what + ": " + std::to_string(voxels) +
                      " voxels along its longest side need " + std::to_string(bytes >> 20) + " MiB of memory, of " +
                      std::to_string(budget.left() >> 20) + " MiB left; the largest that fits is --proxy-voxels " +
                      std::to_string(fits));
  }
  return MemoryReservation(budget, bytes, "the distance field of " + what);
}

} // namespace

GeometryField build_field(const OccludingTriangles& source, const ProxyConfig& config, const MemoryBudget& budget,
                          const std::string& what) {
  const MemoryReservation memory = reserve_field(source, config.voxels, budget, what);
  const VoxelFrame frame = voxel_frame(source, config.voxels);
  FieldBuilder builder(source, frame);
  builder.seed();
  builder.flood_all();
  GeometryField result;
  result.repaired = builder.repair();
  for (const float d : builder.distances()) result.band_samples += d < float{kFieldBand};
  if (source.closed) {
    const VoxelSet inside = inside_voxels(source, config.voxels);
    result.has_sign = inside.count() > 0; // not of sheets with two sides
    if (result.has_sign) builder.negate_inside(inside);
    if (result.has_sign && !builder.resolves_inside()) builder.forget_sign(), result.has_sign = false;
  }
  result.field = encode_field(builder.size(), builder.distances(), config.field_bits);
  result.edge = frame.edge;
  result.origin = frame.origin + frame.edge * (0.5 - double{kFieldMargin});
  return result;
}

} // namespace packtrace
