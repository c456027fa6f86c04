#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "compress/bake/lod/distance_kernel.h"
#include "compress/bake/lod/triangle_overlay.h"

namespace packtrace {

/// The triangle of a set that is nearest to all of another one.
struct NearestTriangle {
  size_t place = 0;      ///< the first of several
  double distance = 0.0; ///< at most, of all of it
  double least = 0.0;    ///< some point of it is at least that far from all triangles of the set
};

/// Numbered triangles of a surface that points are measured against, four at a time.
class TriangleSet {
public:
  void clear() { numbers_.clear(), blocks_.clear(); }
  void add(const OverlaySurface& surface, uint32_t triangle) {
    add({surface.corner(triangle, 0), surface.corner(triangle, 1), surface.corner(triangle, 2)}, triangle);
  }
  void add(const std::array<DVec3, 3>& corners, uint32_t number);
  /// Adds triangle i of another set.
  void add(const TriangleSet& other, size_t i);

  size_t size() const { return numbers_.size(); }
  bool empty() const { return numbers_.empty(); }
  uint32_t number(size_t i) const { return numbers_[i]; }

  /// The first size() of the result: how far the point is from each.
  void distances(const DVec3& point, std::vector<double>& out) const {
    out.resize(padded_size());
    distances(point, out.data());
  }
  /// The same, with room for padded_size().
  void distances(const DVec3& point, double* out) const;
  size_t padded_size() const { return 4 * blocks_.size(); }
  static constexpr double kFar = 1e150; ///< or more: what is behind size() there

  /// @param a, b, c distances() of three corners
  NearestTriangle nearest(const double* a, const double* b, const double* c) const;

private:
  TriangleBlock& next_block(uint32_t number, size_t& lane);

  std::vector<uint32_t> numbers_;
  std::vector<TriangleBlock> blocks_;
};

} // namespace packtrace
