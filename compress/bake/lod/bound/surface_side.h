#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/triangle_overlay.h"

namespace packtrace {

/// A surface before or after, with what is around its points. Both use the numbers of points after: those before count
/// as what they became.
class SurfaceSide {
public:
  /// @param became per point: its number after; none: they are points after
  explicit SurfaceSide(const OverlaySurface& surface, std::span<const uint32_t> became = {})
      : surface_(surface), became_(became), overlay_(surface) {}
  void link(); ///< before anything is asked about what is around points

  const OverlaySurface& surface() const { return surface_; }
  Overlay& overlay() { return overlay_; }
  Triangle corner_points(uint32_t triangle) const {
    const Triangle& t = surface_.triangles[triangle].points;
    return became_.empty() ? t : Triangle(became_[t.x], became_[t.y], became_[t.z]);
  }
  std::array<DVec3, 3> corners(uint32_t triangle) const {
    return {surface_.corner(triangle, 0), surface_.corner(triangle, 1), surface_.corner(triangle, 2)};
  }

  /// The triangles with that corner.
  std::span<const uint32_t> around(uint32_t point) const {
    return std::span(fans_).subspan(first_[point], first_[point + 1] - first_[point]);
  }

  // What another triangle is measured against: a set of triangles of this side.
  std::span<const uint32_t> candidates() const { return candidates_; }
  void gather(const Triangle& corners); ///< those around three points
  void add(uint32_t triangle) {         ///< one more, after gather(); if it is not there yet
    if (stamp_[triangle] != stamp_value_) stamp_[triangle] = stamp_value_, candidates_.push_back(triangle);
  }
  void gather_near(DVec3 point); ///< a few more: those with corners near it
  /// All that may be nearer to a triangle than that, and more.
  void gather_within(const std::array<DVec3, 3>& triangle, double distance);
  bool lay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::vector<OverlayPiece>& pieces) {
    return overlay_.lay(triangle, direction, candidates_, pieces);
  }

private:
  void add_large_fan(std::span<const uint32_t> fan, const Triangle& corners, int corner);

  /// What holds a triangle.
  struct Box {
    DVec3 lo, hi;
  };

  OverlaySurface surface_;
  std::span<const uint32_t> became_;
  std::vector<Box> boxes_; ///< when they are needed
  Overlay overlay_;
  std::vector<uint32_t> first_, fans_; ///< triangles around points
  std::vector<uint32_t> stamp_, candidates_;
  uint32_t stamp_value_ = 0;
};

} // namespace packtrace
