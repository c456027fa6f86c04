#include "compress/bake/lod/simplify/surface_edges.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compress/bake/lod/simplify/quadric.h"
#include "compress/bake/lod/simplify/triangle_planes.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace {
namespace {

constexpr uint32_t kNoEdge = ~0u;
constexpr double kBorderWeight = 8.0;  // of border planes, relative to triangle planes
constexpr double kSeamWeight = 2.0;    // at material seams
constexpr double kCreaseWeight = 0.25; // where normals or texture coordinates are discontinuous
constexpr double kSharp = 0.3;         // maximum cosine between the triangles of a sharp edge
constexpr double kSharpWeight = 0.25;  // keeps the outline of thin plates, whose rims have hardly any area
// of the point's own position: on flat parts, collapses short edges first and avoids long triangles. 1e-4 of an edge's
// length counts as much as that distance from the surface.
constexpr double kStayWeight = 1e-8;
// of planes across tips, which no triangle's plane keeps from receding along them
constexpr double kTipWeight = 1.0;
// A point is a tip if the mean direction of its fan is at least this long: 2 / pi where the surface ends at a straight
// rim, 0.9 in right angles, 1 at infinitely thin tips.
constexpr double kTip = 0.75;

PlaneKernel pick_plane_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::add_triangle_planes;
#endif
  return add_triangle_planes;
}

/// An edge under construction.
struct EdgeUse {
  uint32_t next;     ///< next edge with the same lower-numbered point
  uint32_t triangle; ///< the first triangle at the edge
  bool forward;      ///< whether that triangle runs from the lower-numbered point
  bool border = true, seam = false, crease = false;
  bool two = false;   ///< at least two triangles use it
  bool sharp = false; ///< exactly two triangles use it, and their normals differ by a large angle
};

class EdgeFinder {
public:
  EdgeFinder(const SimplifyMesh& mesh, const SimplifyConfig& config)
      : m_(mesh), config_(config), many_seams_(!mesh.wedges.empty()), fans_(mesh.points.size()),
        first_(mesh.points.size(), kNoEdge) {
    for (const LodTriangle& t : mesh.triangles) many_seams_ |= t.kind != mesh.triangles[0].kind;
  }

  SurfaceEdges run() {
    const size_t count = m_.triangles.size();
    out_.points.resize(m_.points.size());
    out_.area_normals.resize(count);
    out_.side_edge.resize(3 * count);
    out_.ends.reserve(2 * count);
    uses_.reserve(2 * count);
    add_planes();
    for (uint32_t t = 0; t < count; ++t) {
      const Triangle& p = m_.triangles[t].points;
      out_.side_edge[3 * t] = find_edge(p.x, p.y, t);
      out_.side_edge[3 * t + 1] = find_edge(p.y, p.z, t);
      out_.side_edge[3 * t + 2] = find_edge(p.z, p.x, t);
    }
    add_edge_planes();
    for (size_t i = 0; i < m_.points.size(); ++i) finish_point(i);
    return std::move(out_);
  }

private:
  void add(const Quadric& q, uint32_t point) {
    static_assert(sizeof(Quadric) == sizeof(CollapsePoint::quadric));
    double* sum = out_.points[point].quadric;
    const double* from = &q.xx;
    for (size_t i = 0; i < std::size(CollapsePoint{}.quadric); ++i) sum[i] += from[i];
  }

  void add_planes() {
    static const PlaneKernel kernel = pick_plane_kernel();
    static_assert(sizeof(DVec3) == 3 * sizeof(double) && sizeof(Triangle) == 3 * sizeof(uint32_t));
    const uint64_t count = m_.triangles.size();
    const PlaneTask task{&m_.points[0].x,     reinterpret_cast<const char*>(&m_.triangles[0].points),
                         sizeof(LodTriangle), &out_.area_normals[0].x,
                         out_.points.data(),  fans_.data()};
    for (uint64_t t = 0; (t = kernel(task, t, count)) < count; ++t) add_line(m_.triangles[t].points);
  }

  /// Adds quadrics for a triangle with collinear corners, which has no plane: keeps the corners near the line and its
  /// ends near their positions.
  void add_line(const Triangle& points) {
    int first = 0; // start of the longest side
    double longest = 0.0;
    for (int i = 0; i < 3; ++i) {
      const DVec3 side = m_.points[points[(i + 1) % 3]] - m_.points[points[i]];
      if (const double length2 = glm::dot(side, side); length2 > longest) longest = length2, first = i;
    }
    if (!(longest > 0.0)) return; // positions of different points may coincide
    const uint32_t a = points[first], b = points[(first + 1) % 3];
    const DVec3 along = (m_.points[b] - m_.points[a]) / std::sqrt(longest);
    Quadric line;
    line.add_line(along, m_.points[a], longest);
    for (int i = 0; i < 3; ++i) add(line, points[i]);
    for (const uint32_t end : {a, b}) {
      Quadric plane;
      plane.add_plane(along, m_.points[end], longest);
      add(plane, end);
    }
  }

  uint32_t find_edge(uint32_t p, uint32_t q, uint32_t triangle) {
    const uint32_t a = std::min(p, q), b = std::max(p, q);
    uint32_t found = first_[a];
    while (found != kNoEdge && out_.ends[found].b != b) found = uses_[found].next;
    if (found == kNoEdge) {
      found = static_cast<uint32_t>(uses_.size());
      uses_.push_back({std::exchange(first_[a], found), triangle, p == a});
      out_.ends.push_back({a, b});
    } else {
      meet(uses_[found], triangle, p == a);
      if (many_seams_) join(found, triangle);
    }
    return found;
  }

  /// Updates an edge for one more triangle. Where that lies on the same side as the edge's first triangle, as in a
  /// sheet of two layers, the edge is a border of the sheet.
  void meet(EdgeUse& edge, uint32_t triangle, bool forward) const {
    const DVec3 &m = out_.area_normals[edge.triangle], &n = out_.area_normals[triangle];
    const double dot = edge.forward == forward ? -glm::dot(m, n) : glm::dot(m, n); // of a surface through the edge
    const double dot2 = dot * dot, areas2 = glm::dot(m, m) * glm::dot(n, n);
    edge.border = edge.border && dot < 0.0 && dot2 > kFolded * kFolded * areas2;
    edge.sharp = !edge.two && (dot < 0.0 || dot2 < kSharp * kSharp * areas2);
    edge.two = true;
  }

  /// Marks seams and creases between the edge's first triangle and this one.
  void join(uint32_t edge, uint32_t triangle) {
    EdgeUse& e = uses_[edge];
    const LodTriangle &s = m_.triangles[e.triangle], &t = m_.triangles[triangle];
    e.seam |= config_.seam_of_kind[s.kind] != config_.seam_of_kind[t.kind];
    if (s.kind != t.kind) return;
    const auto wedge_at = [](const LodTriangle& of, uint32_t point) {
      for (int i = 0; i < 3; ++i)
        if (of.points[i] == point) return of.wedges[i];
      return Wedge::kNone;
    };
    const auto [a, b] = out_.ends[edge];
    e.crease |= wedge_at(s, a) != wedge_at(t, a) || wedge_at(s, b) != wedge_at(t, b);
  }

  void add_edge_planes() {
    for (uint32_t i = 0; i < uses_.size(); ++i) {
      const EdgeUse& e = uses_[i];
      const auto [a, b] = out_.ends[i];
      if (e.border) out_.points[a].held = out_.points[b].held = kOnBorder;
      const double weight = e.border   ? kBorderWeight
                            : e.sharp  ? kSharpWeight
                            : e.seam   ? kSeamWeight
                            : e.crease ? kCreaseWeight
                                       : 0.0;
      if (weight > 0.0) add_edge_plane(i, weight);
    }
  }

  /// Adds a plane through the edge, perpendicular to its first triangle.
  void add_edge_plane(uint32_t edge, double weight) {
    const auto [a, b] = out_.ends[edge];
    const DVec3 along = m_.points[b] - m_.points[a];
    const DVec3 side = glm::cross(along, out_.area_normals[uses_[edge].triangle]);
    const double length = glm::length(side);
    if (!(length > 0.0)) return;
    Quadric q;
    q.add_plane(side / length, m_.points[a], weight * glm::dot(along, along));
    add(q, a);
    add(q, b);
  }

  void finish_point(size_t i) {
    CollapsePoint& out = out_.points[i];
    Quadric stay;
    stay.add_point(m_.points[i], kStayWeight * out.area);
    add_tip(i, stay);
    add(stay, static_cast<uint32_t>(i));
    for (int axis = 0; axis < 3; ++axis) out.at[axis] = m_.points[i][axis];
    if (m_.locked[i] != 0) out.held += kLocked;
  }

  /// Adds a plane across the tip at a point where the surface extends to one side only. Fans of flat parts, straight
  /// rims and straight creases have no direction along them, so such points may still move there.
  void add_tip(size_t i, Quadric& q) const {
    const DVec3 directions(fans_[i].directions[0], fans_[i].directions[1], fans_[i].directions[2]);
    const double length = glm::length(directions), share = length / fans_[i].angle;
    if (share > kTip)
      q.add_plane(directions / length, m_.points[i], kTipWeight * out_.points[i].area * (share - kTip) / (1.0 - kTip));
  }

  const SimplifyMesh& m_;
  const SimplifyConfig& config_;
  bool many_seams_;             ///< whether there are wedges or several triangle kinds
  std::vector<PointFan> fans_;  ///< per point
  std::vector<uint32_t> first_; ///< per point: the last edge with it as lower-numbered point
  std::vector<EdgeUse> uses_;   ///< per edge
  SurfaceEdges out_;
};

} // namespace

SurfaceEdges find_surface_edges(const SimplifyMesh& mesh, const SimplifyConfig& config) {
  return EdgeFinder(mesh, config).run();
}

} // namespace packtrace
