#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/simplify.h"

namespace packtrace {

/// Triangles that another one is laid over.
struct OverlaySurface {
  std::span<const DVec3> points;
  std::span<const LodTriangle> triangles;

  const DVec3& corner(uint32_t triangle, int i) const { return points[triangles[triangle].points[i]]; }
  DVec3 area_normal(uint32_t triangle) const; ///< twice the area long
  double distance(DVec3 p, uint32_t triangle) const;
};

/// Where the triangle that is laid over a surface meets one triangle of it.
struct OverlayPiece {
  uint32_t triangle;
  double distance; ///< every point of the one there is within this of the other, and the other way round
  double share;    ///< of the area of the surface's triangle
};

/// Lays one triangle after another over parts of a surface: both are seen along one direction, where outlines cut them
/// into convex pieces. Along that direction the distance between both planes is linear, so that of a piece is largest at
/// one of its corners; distance from a triangle is convex, so the same is true of the nearest points.
class Overlay {
public:
  explicit Overlay(const OverlaySurface& surface)
      : surface_(surface), projected_(surface.points.size()), stamp_(surface.points.size()) {}

  /// Appends the pieces to `pieces` and returns true where the candidates cover the triangle just once. `pieces` is as
  /// it was else. Triangles of the surface that face away are as if they were not there.
  /// @param direction any length; false where the triangle is seen nearly from its side
  bool lay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::span<const uint32_t> candidates,
           std::vector<OverlayPiece>& pieces);

  /// The distance of a piece of the last lay() by nearest points: never more than along the direction.
  double nearest_distance(const OverlayPiece& piece);

private:
  /// In barycentric coordinates of the triangle, and along the direction above it.
  struct Corner {
    double l1, l2, height;
    double l(size_t i) const { return i == 0 ? 1.0 - l1 - l2 : i == 1 ? l1 : l2; }
  };
  struct Projected {
    Corner corner;
    uint32_t outside; ///< bit i: not on the inner side of the side where coordinate i is 0
    uint32_t beyond;  ///< bit i: really outside of it
  };
  /// A triangle cut by three lines: six corners, or nine where roundings bend it.
  static constexpr size_t kMaxCorners = 9;
  struct Polygon {
    std::array<Corner, kMaxCorners> corners;
    size_t count;
  };

  const Projected& project(uint32_t point);
  double cut_out(uint32_t triangle, Polygon& polygon, double& facing);
  static void cut(Polygon& polygon, size_t coordinate);

  OverlaySurface surface_;
  std::vector<Projected> projected_; ///< points of the surface, where stamp_ says so
  std::vector<uint32_t> stamp_;
  uint32_t stamp_value_ = 0;
  std::array<DVec3, 3> triangle_{};
  DVec3 direction_{}, to_l1_{}, to_l2_{}, to_height_{};
  double side_ = 1.0; ///< -1: the triangle faces away
  Polygon polygon_{};
};

} // namespace packtrace
