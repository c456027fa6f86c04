#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/simplify.h"
#include "compress/bake/lod/surface_side.h"

namespace packtrace {

/// Maps triangles before onto the surface after, continuously: every corner before has a place there, and every edge a
/// way over its triangles that both triangles at the edge share, so each crossing of two edges is computed once. The
/// distances between crossings and what they are images of bound those of all points between: both are linear there.
/// Source: Jonathan Cohen, Dinesh Manocha and Marc Olano, Simplifying Polygonal Models Using Successive Mappings, 1997.
class SurfaceWalk {
public:
  /// All must outlive it. mesh.side_edges says which edges triangles before share.
  SurfaceWalk(const OverlaySurface& before, const SurfaceSide& after, const SimplifyMesh& mesh);

  /// How distances of pieces are measured.
  enum class Look : uint8_t {
    kAtImages,
    kCloser,
    kShares
  }; ///< from a point to its image; to the nearest point; the
     ///< first and shares too

  /// Appends the triangles after onto which a triangle before is mapped (some more than once) with how far its part
  /// there is from it at most, both ways; shares are 0 unless looked for. False, and nothing appended, where a corner
  /// or an edge has no image, or its outline goes around two points and more.
  bool lay(uint32_t triangle, Look look, std::vector<OverlayPiece>& pieces);

  const DVec3& area_normal(uint32_t after) const { return normals_[after]; }

  /// Which triangles after the images of some triangles before cover: those that no border of the images crosses.
  /// @param mapped per triangle before: lay() was true of it, or it is itself one of those after
  /// @param covered per triangle after: set to 0 where a border crosses it; else as it was
  void find_borders(std::span<const uint8_t> mapped, std::span<uint8_t> covered);

private:
  static constexpr uint32_t kNone = ~0u;

  /// Where a point before is found: at a point after, or in a triangle after.
  struct Place {
    enum class State : uint8_t { kUnknown, kNowhere, kPoint, kTriangle };
    State state = State::kUnknown;
    uint32_t number = kNone;
    DVec3 at{};             ///< its image
    double distance2 = 0.0; ///< of both
  };
  /// Where a way enters a triangle.
  struct Crossing {
    uint32_t into;
    double on; ///< 0 to 1: its place on the edge before
    DVec3 at;
    double distance2; ///< of both
  };
  /// From the lower point of an edge before to the higher one. kAcross: begins in triangle `start` and enters others
  /// at its crossings. kAlong: it is an edge after, with triangle `start` to the left and `right` to the right.
  struct Way {
    enum class State : uint8_t { kUnknown, kNowhere, kAlong, kAcross };
    State state = State::kUnknown;
    uint32_t start = kNone, right = kNone, first = 0, count = 0;
  };
  /// The plane in which a way lies, upright on the edge.
  struct Slice {
    DVec3 from, to, left, along;
    double side(const DVec3& p) const { return glm::dot(left, p - from); }
  };
  /// Where a way leaves a triangle: from its right corner to its left one.
  struct Exit {
    uint32_t right, left;
    double side_right, side_left;
  };
  /// A part of an outline's image, and the largest distance of its corners from theirs.
  struct Interval {
    uint32_t triangle, first_point;
    double distance2;
  };
  /// The triangle at hand. Outlines with longer images are none.
  struct Outline {
    static constexpr uint32_t kMost = 64;
    std::array<Interval, kMost> intervals;
    std::array<DVec3, 4 * kMost> points; ///< of intervals, where shares are looked for
    uint32_t count = 0, point_count = 0;
    std::array<DVec3, 3> corners;
  };

  const DVec3& point(uint32_t number) const { return mesh_.points[number]; }
  const Triangle& corners(uint32_t triangle) const { return mesh_.triangles[triangle].points; }
  bool has(uint32_t triangle, uint32_t point) const {
    const Triangle& t = corners(triangle);
    return t.x == point || t.y == point || t.z == point;
  }
  uint32_t point_at(uint32_t corner) const { return corners(corner / 3)[static_cast<int>(corner % 3)]; }
  uint32_t point_after(uint32_t corner) const { return corners(corner / 3)[static_cast<int>((corner + 1) % 3)]; }
  void find_neighbours();
  uint32_t across(uint32_t triangle, uint32_t from) const; ///< the side that begins at that corner

  bool make_slice(const DVec3& from, const DVec3& to, const DVec3& up, Slice& out) const;
  bool leave_point(const Slice& slice, uint32_t point, uint32_t& triangle, Exit& out) const;
  bool leave_triangle(const Slice& slice, uint32_t triangle, Exit& out) const;
  bool enter(const Slice& slice, uint32_t& triangle, Exit& exit, uint32_t goal_point, bool& reached) const;
  double progress(const Slice& slice, const Exit& exit, DVec3& crossing) const;

  const Place& place(uint32_t before);
  void find_place(uint32_t before, Place& out);
  const Way& way(uint32_t edge, uint32_t a, uint32_t b);
  void find_way(uint32_t edge, uint32_t a, uint32_t b, Way& out);
  bool find_along(uint32_t edge, uint32_t from, uint32_t to, Way& out) const;
  bool step_aside(uint32_t triangle, const Place& goal, const Slice& slice);
  bool at(uint32_t triangle, const Place& goal) const {
    return goal.state == Place::State::kPoint ? has(triangle, goal.number) : triangle == goal.number;
  }

  template <Look look>
  double distance2(Outline& outline, uint32_t triangle, const DVec3& before, const DVec3& after, double of_both) const;
  template <Look look>
  bool follow(Outline& outline, const Triangle& p, const uint32_t* edges, const uint32_t* starts);
  template <Look look>
  bool lay(uint32_t triangle, std::vector<OverlayPiece>& pieces);
  bool contract(const Outline& outline, uint32_t& inside);
  double area(const Outline& outline, uint32_t interval, const DVec3& reference) const;

  OverlaySurface before_;
  const SurfaceSide& after_;
  const SimplifyMesh& mesh_;
  std::vector<Place> places_;
  std::vector<Way> ways_;
  std::vector<Crossing> crossings_;
  std::vector<uint32_t> side_of_edge_; ///< per edge: a corner after where it begins, or kNone
  std::vector<uint32_t> neighbours_;   ///< per corner after: the triangle across the side to the next one
  std::vector<DVec3> normals_;         ///< per triangle after, twice its area long
  std::vector<DVec3> facing_;          ///< per point after: the sum around it
  Outline outline_;
};

} // namespace packtrace
