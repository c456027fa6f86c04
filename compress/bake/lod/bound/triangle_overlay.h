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
  explicit Overlay(const OverlaySurface& surface = {});
  /// Replaces the surface. Keeps the allocated memory.
  void reset(const OverlaySurface& surface) { surface_ = surface, corners_.clear(); }

  /// Appends the pieces to `pieces` and returns true if the candidates are known to cover the triangle: each candidate
  /// side through its interior is shared by two candidates, so they cover all of it equally often, and their areas say
  /// how often. Otherwise returns false and leaves `pieces` unchanged. Back-facing candidates are ignored.
  /// @param direction any nonzero length; returns false if the triangle is nearly edge-on
  bool overlay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::span<const uint32_t> candidates,
               std::vector<OverlayPiece>& pieces);

  /// Bounds the triangle of the last overlay() even where candidates leave parts of it uncovered, as where borders
  /// moved. Uses only pieces that `accept` takes. A segment from an uncovered to a covered point enters the pieces
  /// through an open side. So the parts beyond the open sides, seen from one covered point, contain all that is not
  /// covered. The distance of each part from its side's candidate is measured, and the part is appended as a piece.
  /// Returns false, and leaves `pieces` unchanged, if a part is not accepted or hardly anything is covered.
  /// @param accept (candidate, distance): whether that distance is near enough
  template <typename Accept>
  bool overlay_near(const Accept& accept, std::vector<OverlayPiece>& pieces) {
    near_.clear();
    size_t largest = 0; // index in near_
    for (uint32_t i = 0; i < found_count_; ++i) {
      OverlayPiece piece = found_[i];
      if (!accept(piece.triangle, piece.distance)) {
        piece.distance = nearest_distance(piece);
        if (!accept(piece.triangle, piece.distance)) continue;
      }
      if (i == largest_piece_) largest = near_.size();
      near_.push_back(piece);
    }
    OverlayPoint covered{};
    if (near_.empty() || !find_point_in(near_[largest], covered)) return false;
    if (!open_sides_known_ || near_.size() < found_count_) find_open_sides(near_);
    open_sides_known_ = near_.size() == found_count_;
    for (const OpenSide& side : open_sides_) {
      const double distance = distance_beyond(side, covered);
      if (distance < 0.0) continue;
      if (!accept(side.triangle, distance)) return false;
      near_.push_back({side.triangle, OverlayPiece::kBeyondSide, distance});
    }
    pieces.insert(pieces.end(), near_.begin(), near_.end());
    return true;
  }
  /// overlay_near() that accepts every distance.
  bool overlay_over_borders(std::vector<OverlayPiece>& pieces) {
    return overlay_near([](uint32_t, double) { return true; }, pieces);
  }

  /// The maximum distance of a piece of the last overlay() from its surface triangle; at most the distance along the
  /// direction. The surface may be farther from the overlaid triangle than that.
  double nearest_distance(const OverlayPiece& piece) const;

private:
  /// A candidate's side that crosses the triangle's interior and has no candidate on its other side.
  struct OpenSide {
    uint64_t ends; ///< point numbers: the first one + 2^32 x the second one
    uint32_t triangle;
    static uint64_t ends_of(uint32_t from, uint32_t to) { return from | uint64_t{to} << 32; }
    uint32_t from() const { return static_cast<uint32_t>(ends); }
    uint32_t to() const { return static_cast<uint32_t>(ends >> 32); }
  };

  void prepare(); ///< on first use, as most overlays are never needed
  void find_open_sides(std::span<const OverlayPiece> pieces);
  OverlayPolygon overlap(const OverlayPiece& piece) const;
  bool find_point_in(const OverlayPiece& piece, OverlayPoint& out) const;
  double distance_beyond(const OpenSide& side, const OverlayPoint& covered) const;

  OverlaySurface surface_;
  std::vector<uint32_t> corners_;
  std::vector<OverlayPoint> projected_;
  std::vector<uint32_t> outside_, stamps_;
  std::vector<OverlayPiece> found_; ///< output of the kernel
  uint32_t found_count_ = 0, largest_piece_ = 0;
  std::vector<OverlayPiece> near_; ///< those of found_ that are near enough, then what lies beyond their open sides
  std::vector<OpenSide> open_sides_;
  bool open_sides_known_ = false; ///< whether open_sides_ are those of all pieces in found_
  OverlayTask task_{};
  std::array<DVec3, 3> triangle_{};
  DVec3 direction_{};
};

} // namespace packtrace
