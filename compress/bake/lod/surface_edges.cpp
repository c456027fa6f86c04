#include "compress/bake/lod/surface_edges.h"

#include <algorithm>
#include <utility>

#include "compress/bake/lod/quadric.h"

namespace packtrace {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr double kBorderWeight = 8.0;  // of border planes against the triangles' own
constexpr double kSeamWeight = 2.0;    // where the material changes
constexpr double kCreaseWeight = 0.25; // where normals or texture coordinates change
constexpr double kStayWeight = 1e-4; // of the point itself: where all is flat, short edges go first and none gets long

/// An edge while more triangles at it are looked for.
struct EdgeUse {
  uint32_t next;     ///< edge of the same lower point
  uint32_t triangle; ///< the first that has it
  bool alone = true, seam = false, crease = false;
};

class EdgeFinder {
public:
  EdgeFinder(const SimplifyMesh& mesh, const SimplifyConfig& config) : m_(mesh), config_(config) {}

  SurfaceEdges run() {
    out_.points.resize(m_.points.size());
    quadrics_.resize(m_.points.size());
    stay_.resize(m_.points.size());
    out_.area_normals.reserve(m_.triangles.size());
    out_.side_edge.reserve(3 * m_.triangles.size());
    out_.ends.reserve(2 * m_.triangles.size());
    uses_.reserve(2 * m_.triangles.size());
    first_.assign(m_.points.size(), kNone);
    for (uint32_t t = 0; t < m_.triangles.size(); ++t) {
      add_plane(m_.triangles[t].points);
      add_sides(t);
    }
    add_edge_planes();
    for (size_t i = 0; i < m_.points.size(); ++i) finish_point(i);
    return std::move(out_);
  }

private:
  void add_plane(const Triangle& t) {
    const DVec3 a = m_.points[t.x], n = glm::cross(m_.points[t.y] - a, m_.points[t.z] - a);
    out_.area_normals.push_back(n);
    const double area = glm::length(n);
    if (!(area > 0.0)) return;
    Quadric q;
    q.add_plane(n / area, a, area);
    for (int i = 0; i < 3; ++i) quadrics_[t[i]].add(q), stay_[t[i]] += kStayWeight * area;
  }

  void add_sides(uint32_t triangle) {
    const Triangle& t = m_.triangles[triangle].points;
    for (int i = 0; i < 3; ++i) {
      const uint32_t p = t[i], q = t[i == 2 ? 0 : i + 1], a = std::min(p, q), b = std::max(p, q);
      uint32_t found = first_[a];
      while (found != kNone && out_.ends[found].b != b) found = uses_[found].next;
      if (found == kNone) {
        found = static_cast<uint32_t>(uses_.size());
        uses_.push_back({std::exchange(first_[a], found), triangle});
        out_.ends.push_back({a, b});
      } else {
        join(found, triangle);
      }
      out_.side_edge.push_back(found);
    }
  }

  void join(uint32_t edge, uint32_t triangle) {
    EdgeUse& e = uses_[edge];
    const LodTriangle &s = m_.triangles[e.triangle], &t = m_.triangles[triangle];
    e.alone = false;
    e.seam |= config_.seam_of_kind[s.kind] != config_.seam_of_kind[t.kind];
    if (s.kind != t.kind || m_.wedges.empty()) return;
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
      if (e.alone) out_.points[a].held = out_.points[b].held = kOnBorder;
      const double weight = e.alone ? kBorderWeight : e.seam ? kSeamWeight : e.crease ? kCreaseWeight : 0.0;
      if (weight > 0.0) add_edge_plane(i, weight);
    }
  }

  /// A plane through the edge, upright on its triangle.
  void add_edge_plane(uint32_t edge, double weight) {
    const auto [a, b] = out_.ends[edge];
    const DVec3 along = m_.points[b] - m_.points[a];
    const DVec3 side = glm::cross(along, out_.area_normals[uses_[edge].triangle]);
    const double length = glm::length(side);
    if (!(length > 0.0)) return;
    Quadric q;
    q.add_plane(side / length, m_.points[a], weight * glm::dot(along, along));
    quadrics_[a].add(q);
    quadrics_[b].add(q);
  }

  void finish_point(size_t i) {
    static_assert(sizeof(Quadric) == sizeof(CollapsePoint::quadric));
    CollapsePoint& out = out_.points[i];
    quadrics_[i].add_point(m_.points[i], stay_[i]);
    std::copy_n(&quadrics_[i].xx, std::size(out.quadric), out.quadric);
    for (int axis = 0; axis < 3; ++axis) out.at[axis] = m_.points[i][axis];
    if (m_.locked[i] != 0) out.held += kLocked;
  }

  const SimplifyMesh& m_;
  const SimplifyConfig& config_;
  SurfaceEdges out_;
  std::vector<Quadric> quadrics_; ///< per point
  std::vector<double> stay_;      ///< per point: the weight of the point itself
  std::vector<EdgeUse> uses_;     ///< per edge
  std::vector<uint32_t> first_;   ///< per point: the last edge of which it is the lower one
};

} // namespace

SurfaceEdges find_surface_edges(const SimplifyMesh& mesh, const SimplifyConfig& config) {
  return EdgeFinder(mesh, config).run();
}

} // namespace packtrace
