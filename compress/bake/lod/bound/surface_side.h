#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/triangle_overlay.h"

namespace packtrace {

/// The source or the simplified surface, with the triangles around each point. Both sides use the point numbers of the
/// simplified surface: a source point counts as the point that it became.
class SurfaceSide {
public:
  /// @param became per source point: its number on the simplified surface; empty if this is the simplified surface
  explicit SurfaceSide(const OverlaySurface& surface, std::span<const uint32_t> became = {})
      : surface_(surface), became_(became), overlay_(surface) {}
  void link(); ///< must be called before around(), gather() and add()

  const OverlaySurface& surface() const { return surface_; }
  Overlay& overlay() { return overlay_; }
  Triangle corner_points(uint32_t triangle) const {
    const Triangle& t = surface_.triangles[triangle].points;
    return became_.empty() ? t : Triangle(became_[t.x], became_[t.y], became_[t.z]);
  }
  std::array<DVec3, 3> corners(uint32_t triangle) const {
    return {surface_.corner(triangle, 0), surface_.corner(triangle, 1), surface_.corner(triangle, 2)};
  }

  /// The triangles with a corner at that point.
  std::span<const uint32_t> around(uint32_t point) const {
    return std::span(fans_).subspan(first_[point], first_[point + 1] - first_[point]);
  }

  // The candidates: triangles of this side that another triangle is measured against.
  std::span<const uint32_t> candidates() const { return candidates_; }
  /// Sets the candidates: the triangles of `first`, then those around three points.
  void gather(const Triangle& corners, std::span<const uint32_t> first = {});
  /// Adds one candidate after gather(), unless it is there already.
  void add(uint32_t triangle) {
    if (stamp_[triangle] != stamp_value_) stamp_[triangle] = stamp_value_, candidates_.push_back(triangle);
  }
  void gather_near(DVec3 point); ///< adds a few triangles near a point
  /// Makes every triangle that may be within `distance` of `triangle` a candidate; conservative.
  void gather_within(const std::array<DVec3, 3>& triangle, double distance);
  bool overlay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::vector<OverlayPiece>& pieces) {
    return overlay_.overlay(triangle, direction, candidates_, pieces);
  }

private:
  void add_large_fan(std::span<const uint32_t> fan, const Triangle& corners, int corner);

  /// The bounds of a triangle.
  struct Box {
    DVec3 lo, hi;
  };

  OverlaySurface surface_;
  std::span<const uint32_t> became_;
  std::vector<Box> boxes_; ///< computed on first use
  Overlay overlay_;
  std::vector<uint32_t> first_, fans_; ///< triangles around each point
  std::vector<uint32_t> stamp_, candidates_;
  uint32_t stamp_value_ = 0;
};

} // namespace packtrace
