#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compress/bake/lod/simplify/simplify.h"
#include "compress/bake/lod/bound/surface_side.h"

namespace packtrace {

/// Where points and edges before are found on the surface after: every point before has a place there, and every edge a
/// way over its triangles that all triangles at the edge share, so each crossing of two edges is computed once. The
/// distances between crossings and what they are images of bound those of all points between: both are linear there.
/// Source: Jonathan Cohen, Dinesh Manocha and Marc Olano, Simplifying Polygonal Models Using Successive Mappings, 1997.
class SurfaceWalk {
public:
  static constexpr uint32_t kNone = ~0u;

  /// At a point after, or in a triangle after.
  struct Place {
    enum class State : uint8_t { kUnknown, kNowhere, kPoint, kTriangle };
    DVec3 at{};             ///< the image
    double distance2 = 0.0; ///< of the point before and its image
    uint32_t number = kNone;
    State state = State::kUnknown;
  };
  /// Where a way goes from one triangle after into the next.
  struct Crossing {
    double at[3];
    double on;        ///< 0 to 1: its place on the edge before
    double distance2; ///< of both
    uint32_t into;    ///< the triangle that it enters
    DVec3 point() const { return {at[0], at[1], at[2]}; }
  };
  /// From the lower point of an edge before to the higher one. kAcross: begins in triangle `start` and enters others
  /// at its crossings. kAlong: it is an edge after, with triangle `start` to the left and `right` to the right.
  struct Way {
    enum class State : uint8_t { kUnknown, kNowhere, kAlong, kAcross };
    double distance2 = 0.0; ///< largest of its crossings
    uint32_t start = kNone, right = kNone, first = 0, count = 0;
    State state = State::kUnknown;
  };

  /// All must outlive it. mesh.side_edges says which edges triangles before share.
  SurfaceWalk(const OverlaySurface& before, const SurfaceSide& after, const SimplifyMesh& mesh);

  const Place& place(uint32_t before) {
    Place& p = places_[before];
    if (p.state == Place::State::kUnknown) find_place(before, p);
    return p;
  }
  /// @param edge from a to b or back
  const Way& way(uint32_t edge, uint32_t a, uint32_t b) {
    Way& w = ways_[edge];
    if (w.state == Way::State::kUnknown) find_way(edge, a < b ? a : b, a < b ? b : a, w);
    return w;
  }
  /// Of all edges; those that nobody asked for are not known.
  std::span<const Way> ways() const { return ways_; }
  const Crossing& crossing(uint32_t i) const { return crossings_[i]; }
  uint32_t into(uint32_t i) const { return crossings_[i].into; }

  const DVec3& area_normal(uint32_t after) const { return normals_[after]; }
  const DVec3& point(uint32_t after) const { return mesh_.points[after]; }
  /// The corner's point; corners are numbered 4 * triangle + 0, 1, 2.
  uint32_t point_at(uint32_t corner) const { return corner_points_[corner]; }
  bool has(uint32_t triangle, uint32_t point) const {
    const uint32_t* p = &corner_points_[4 * size_t{triangle}];
    return p[0] == point || p[1] == point || p[2] == point;
  }
  /// The corner where the side back begins, in the triangle across the side that begins at that corner; or kNone.
  uint32_t opposite(uint32_t corner) const { return opposite_[corner]; }
  /// The triangle across the side that begins at that corner, or kNone.
  uint32_t beyond(uint32_t corner) const { return opposite_[corner] == kNone ? kNone : opposite_[corner] / 4; }
  /// The triangle across the side that begins at that point, or kNone.
  uint32_t across(uint32_t triangle, uint32_t from) const {
    const uint32_t* p = &corner_points_[4 * size_t{triangle}];
    return beyond(4 * triangle + (p[0] == from ? 0u : p[1] == from ? 1u : 2u));
  }
  /// A corner where the edge after begins that an edge before became, or kNone.
  uint32_t side_along(uint32_t edge) const { return side_of_edge_[mesh_.edge_became[edge]]; }
  const OverlaySurface& before() const { return before_; }

private:
  /// The plane in which a way lies, upright on the edge.
  struct Slice {
    DVec3 from, direction, left, along;
    double offset; ///< of `from`, towards the left
    double side(const DVec3& p) const { return glm::dot(left, p) - offset; }
  };
  /// Where a way leaves a triangle: through the side that begins at `corner`, from its right end to its left one.
  struct Exit {
    uint32_t corner;
    const DVec3 *right, *left;
    double side_right, side_left;
  };

  void pair_sides();
  void make_room();
  bool make_slice(const DVec3& from, const DVec3& to, const DVec3& up, Slice& out) const;
  bool leave_point(const Slice& slice, uint32_t point, Exit& out) const;
  bool leave_triangle(const Slice& slice, uint32_t triangle, Exit& out) const;
  void enter(const Slice& slice, uint32_t corner, Exit& exit) const;
  void find_place(uint32_t before, Place& out) const;
  void find_way(uint32_t edge, uint32_t a, uint32_t b, Way& out);
  bool cross(const Slice& slice, Exit& exit, const Place& goal);
  bool find_along(uint32_t edge, uint32_t from, uint32_t to, Way& out) const;
  bool step_aside(uint32_t triangle, const Place& goal, const DVec3& end);
  void add(uint32_t into, const DVec3& at, double on, double distance2) {
    crossings_[crossing_count_++] = {{at.x, at.y, at.z}, on, distance2, into};
  }
  bool at(uint32_t triangle, const Place& goal) const {
    return goal.state == Place::State::kPoint ? has(triangle, goal.number) : triangle == goal.number;
  }

  OverlaySurface before_;
  const SurfaceSide& after_;
  const SimplifyMesh& mesh_;
  std::vector<Place> places_;
  std::vector<Way> ways_;
  std::unique_ptr<Crossing[]> crossings_;
  size_t crossing_count_ = 0, crossing_room_ = 0;
  std::vector<uint32_t> side_of_edge_;             ///< per edge after: a corner where it begins, or kNone
  std::vector<uint32_t> corner_points_, opposite_; ///< per corner: its point; where the side back begins, or kNone
  std::vector<DVec3> normals_;                     ///< per triangle after, twice its area long
  std::vector<DVec3> facing_;                      ///< per point after: the sum around it
};

} // namespace packtrace
