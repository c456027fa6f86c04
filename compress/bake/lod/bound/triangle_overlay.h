#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/overlay_kernel.h"
#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// The triangles of a surface that others are overlaid on.
struct OverlaySurface {
  std::span<const DVec3> points;
  std::span<const LodTriangle> triangles;

  const DVec3& corner(uint32_t triangle, int i) const { return points[triangles[triangle].points[i]]; }
  DVec3 area_normal(uint32_t triangle) const; ///< length is twice the area
  double distance(DVec3 p, uint32_t triangle) const;
};

/// A convex part of a surface triangle, in coordinates of the triangle laid over it. Has at most six corners, or nine
/// with rounding errors.
struct OverlayPolygon {
  std::array<OverlayPoint, 9> corners;
  size_t count;
};

/// Overlays triangles on parts of a surface. The triangle and the surface are projected along one direction, where
/// their outlines cut each other into convex pieces. The distance of both planes along that direction is linear, so its
/// maximum over a piece is at a corner. The same holds for nearest points, as the distance from a triangle is convex.
class Overlay {
public:
  explicit Overlay(const OverlaySurface& surface);

  /// Appends the pieces to `pieces` and returns true if the candidates are known to cover the triangle: each candidate
  /// side through its interior is shared by two candidates, so they cover all of it equally often, and their areas say
  /// how often. Otherwise returns false and leaves `pieces` unchanged. Back-facing candidates are ignored.
  /// @param direction any nonzero length; returns false if the triangle is nearly edge-on
  bool overlay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::span<const uint32_t> candidates,
               std::vector<OverlayPiece>& pieces);

  /// After overlay() returned false: bounds a triangle that sticks out over borders of the candidates, as where borders
  /// moved. A segment from a point that no candidate covers to a covered point enters the candidates through an open
  /// side, so what lies beyond the open sides, as seen from one covered point, is all that is not covered. Each of
  /// these parts is measured to its side's candidate and appended as a further piece. Returns false, and leaves
  /// `pieces` unchanged, if the candidates cover hardly any of the triangle.
  bool overlay_over_borders(std::vector<OverlayPiece>& pieces);

  /// The maximum distance of a piece of the last overlay() to nearest points; at most the distance along the direction.
  double nearest_distance(const OverlayPiece& piece) const;

private:
  /// A candidate side through the triangle's interior without another candidate behind it.
  struct OpenSide {
    uint32_t from, to, triangle;
  };

  void prepare(); ///< on first use, as most overlays are never needed
  bool has_no_open_sides(std::span<const OverlayPiece> pieces);
  OverlayPolygon overlap(const OverlayPiece& piece) const;
  OverlayPoint point_in(const OverlayPiece& piece) const;
  double distance_beyond(const OpenSide& side, const OverlayPoint& covered) const;

  OverlaySurface surface_;
  std::vector<uint32_t> corners_;
  std::vector<OverlayPoint> projected_;
  std::vector<uint32_t> outside_, stamps_;
  std::vector<OverlayPiece> found_; ///< output of the kernel
  std::vector<OpenSide> open_sides_;
  uint32_t found_count_ = 0; ///< pieces in found_, if they cover only a part of the triangle
  uint32_t largest_piece_ = 0;
  OverlayTask task_{};
  std::array<DVec3, 3> triangle_{};
  DVec3 direction_{};
};

} // namespace packtrace
