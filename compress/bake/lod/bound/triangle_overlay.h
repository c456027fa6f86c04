#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "compress/bake/lod/bound/overlay_kernel.h"
#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// Triangles that another one is laid over.
struct OverlaySurface {
  std::span<const DVec3> points;
  std::span<const LodTriangle> triangles;

  const DVec3& corner(uint32_t triangle, int i) const { return points[triangles[triangle].points[i]]; }
  DVec3 area_normal(uint32_t triangle) const; ///< twice the area long
  double distance(DVec3 p, uint32_t triangle) const;
};

/// Lays one triangle after another over parts of a surface: both are seen along one direction, where outlines cut them
/// into convex pieces. Along that direction the distance between both planes is linear, so that of a piece is largest
/// at one of its corners; distance from a triangle is convex, so the same is true of the nearest points.
class Overlay {
public:
  explicit Overlay(const OverlaySurface& surface);

  /// Appends the pieces to `pieces` and returns true where the candidates are known to cover the triangle: where each
  /// of their sides that goes through its inside is one of two, so that they cover all of it equally often, and their
  /// areas say how often. `pieces` is as it was else. Triangles of the surface that face away are as if they were not
  /// there.
  /// @param direction any length; false where the triangle is seen nearly from its side
  bool lay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::span<const uint32_t> candidates,
           std::vector<OverlayPiece>& pieces);

  /// The distance of a piece of the last lay() by nearest points: never more than along the direction.
  double nearest_distance(const OverlayPiece& piece) const;

private:
  void prepare(); ///< on first use: most overlays are never asked
  bool hang_together(std::span<const OverlayPiece> pieces);
  bool has_layers();

  OverlaySurface surface_;
  std::vector<uint32_t> corners_;
  std::vector<OverlayPoint> projected_;
  std::vector<uint32_t> outside_, stamps_;
  std::vector<OverlayPiece> found_; ///< what the kernel wrote
  std::vector<std::pair<uint32_t, uint32_t>> open_sides_;
  OverlayTask task_{};
  std::array<DVec3, 3> triangle_{};
  DVec3 direction_{};
};

} // namespace packtrace
