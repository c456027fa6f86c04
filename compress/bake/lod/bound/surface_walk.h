#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/surface_side.h"
#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// Maps the points and edges of the source surface onto the simplified surface. Each source point has an image (Place),
/// and each source edge has a path across simplified triangles (Way). Triangles that share an edge share its path, so
/// each crossing of a source edge and a simplified edge is computed once. Edge and path are linear between crossings,
/// so the distances at the crossings bound those in between.
/// Source: Jonathan Cohen, Dinesh Manocha and Marc Olano, Simplifying Polygonal Models Using Successive Mappings, 1997.
class SurfaceWalk {
public:
  static constexpr uint32_t kNone = ~0u;

  /// The image of a source point: a simplified point (kPoint) or a position in a simplified triangle (kTriangle). Any
  /// position is a valid image; far ones only give loose bounds.
  struct Place {
    enum class State : uint8_t { kUnknown, kNowhere, kPoint, kTriangle };
    DVec3 at{};             ///< the image
    double distance2 = 0.0; ///< squared distance of the source point and its image
    uint32_t number = kNone;
    State state = State::kUnknown;
  };
  /// Where a path goes from one simplified triangle into the next.
  struct Crossing {
    double at[3];
    double on;        ///< parameter on the source edge, 0 to 1
    double distance2; ///< squared distance of the path and the edge here
    uint32_t into;    ///< triangle that the path enters
    DVec3 point() const { return {at[0], at[1], at[2]}; }
  };
  /// The path of a source edge, from its lower-numbered point to the higher one. kAcross: begins in triangle `start`
  /// and enters further triangles at crossings first .. first + count. kAlong: follows a simplified edge with triangle
  /// `start` on its left and `right` on its right.
  struct EdgePath {
    enum class State : uint8_t { kUnknown, kNowhere, kAlong, kAcross };
    double distance2 = 0.0; ///< largest of its crossings
    uint32_t start = kNone, right = kNone, first = 0, count = 0;
    State state = State::kUnknown;
  };

  /// All arguments must outlive this object. mesh.side_edges lists the edges that source triangles share.
  SurfaceWalk(const OverlaySurface& source, const SurfaceSide& simplified, const SimplifyMesh& mesh);

  const Place& place(uint32_t source) {
    Place& p = places_[source];
    if (p.state == Place::State::kUnknown) find_place(source, p);
    return p;
  }
  /// @param edge between points a and b, in either direction
  const EdgePath& way(uint32_t edge, uint32_t a, uint32_t b) {
    EdgePath& w = ways_[edge];
    if (w.state == EdgePath::State::kUnknown) find_path(edge, a < b ? a : b, a < b ? b : a, w);
    return w;
  }
  /// Per edge; the state is kUnknown for edges that way() was not called for.
  std::span<const EdgePath> ways() const { return ways_; }
  const Crossing& crossing(uint32_t i) const { return crossings_[i]; }
  uint32_t into(uint32_t i) const { return crossings_[i].into; }

  const DVec3& area_normal(uint32_t simplified) const { return normals_[simplified]; }
  const DVec3& point(uint32_t simplified) const { return mesh_.points[simplified]; }
  /// The point of a corner; corners are numbered 4 * triangle + 0, 1, 2.
  uint32_t point_at(uint32_t corner) const { return corner_points_[corner]; }
  bool has(uint32_t triangle, uint32_t point) const {
    const uint32_t* p = &corner_points_[4 * size_t{triangle}];
    return p[0] == point || p[1] == point || p[2] == point;
  }
  /// The corner where the opposite half-edge of the side starting at `corner` begins, or kNone.
  uint32_t opposite(uint32_t corner) const { return opposite_[corner]; }
  /// The triangle across the side starting at `corner`, or kNone.
  uint32_t beyond(uint32_t corner) const { return opposite_[corner] == kNone ? kNone : opposite_[corner] / 4; }
  /// The triangle across the side of `triangle` starting at point `from`, or kNone.
  uint32_t across(uint32_t triangle, uint32_t from) const {
    const uint32_t* p = &corner_points_[4 * size_t{triangle}];
    return beyond(4 * triangle + (p[0] == from ? 0u : p[1] == from ? 1u : 2u));
  }
  /// A corner where the simplified edge that the source edge became begins, or kNone.
  uint32_t side_along(uint32_t edge) const { return side_of_edge_[mesh_.edge_became[edge]]; }
  const OverlaySurface& source() const { return source_; }

private:
  /// The plane through a source edge and the local surface normal; a path lies in it.
  struct Slice {
    DVec3 from, direction, left, along;
    double offset; ///< of `from` along `left`
    double side(const DVec3& p) const { return glm::dot(left, p) - offset; }
  };
  /// Where a path leaves a triangle: through the side starting at `corner`, which runs from `right` to `left`.
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
  void find_place(uint32_t source, Place& out) const;
  void project(uint32_t source, Place& out) const;
  void place_nearest(uint32_t source, Place& out) const;
  void find_path(uint32_t edge, uint32_t a, uint32_t b, EdgePath& out);
  bool find_straight(uint32_t a, uint32_t b, const Place& from, const Place& goal, EdgePath& out);
  bool find_around(uint32_t a, uint32_t b, const Place& from, const Place& goal, EdgePath& out);
  template <typename Wanted>
  uint32_t turns(uint32_t& triangle, uint32_t around, bool forward, const Wanted& wanted) const;
  /// The side of a triangle that starts (forward) or ends at one of its points, as the corner where it starts.
  uint32_t side_at(uint32_t triangle, uint32_t at, bool forward) const {
    const uint32_t* p = &corner_points_[4 * size_t{triangle}];
    const uint32_t i = p[0] == at ? 0u : p[1] == at ? 1u : 2u;
    return 4 * triangle + (forward ? i : i == 0 ? 2 : i - 1);
  }
  void cross_side(uint32_t a, uint32_t b, uint32_t corner, double& on);
  bool cross(const Slice& slice, Exit& exit, const Place& goal);
  bool find_along(uint32_t edge, uint32_t from, uint32_t to, EdgePath& out) const;
  bool step_aside(uint32_t triangle, const Place& goal, const DVec3& end);
  void add(uint32_t into, const DVec3& at, double on, double distance2) {
    crossings_[crossing_count_++] = {{at.x, at.y, at.z}, on, distance2, into};
  }
  bool at(uint32_t triangle, const Place& goal) const {
    return goal.state == Place::State::kPoint ? has(triangle, goal.number) : triangle == goal.number;
  }

  OverlaySurface source_;
  const SurfaceSide& simplified_;
  const SimplifyMesh& mesh_;
  std::vector<Place> places_;
  std::vector<EdgePath> ways_;
  std::unique_ptr<Crossing[]> crossings_;
  size_t crossing_count_ = 0, crossing_room_ = 0;
  std::vector<uint32_t> side_of_edge_;             ///< per simplified edge: a corner where it begins, or kNone
  std::vector<uint32_t> corner_points_, opposite_; ///< per corner: its point, and its opposite half-edge or kNone
  std::vector<DVec3> normals_;                     ///< per simplified triangle; length is twice its area
  std::vector<DVec3> facing_;                      ///< per simplified point: sum of the area normals around it
};

} // namespace packtrace
