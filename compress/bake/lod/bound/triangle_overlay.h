#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
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

  /// The maximum distance of a piece of the last overlay() to nearest points; at most the distance along the direction.
  double nearest_distance(const OverlayPiece& piece) const;

private:
  void prepare(); ///< on first use, as most overlays are never needed
  bool has_no_open_sides(std::span<const OverlayPiece> pieces);
  bool has_layers();

  OverlaySurface surface_;
  std::vector<uint32_t> corners_;
  std::vector<OverlayPoint> projected_;
  std::vector<uint32_t> outside_, stamps_;
  std::vector<OverlayPiece> found_; ///< output of the kernel
  std::vector<std::pair<uint32_t, uint32_t>> open_sides_;
  OverlayTask task_{};
  std::array<DVec3, 3> triangle_{};
  DVec3 direction_{};
};

} // namespace packtrace
