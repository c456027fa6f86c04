#include "compress/bake/lod/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "compress/bake/lod/edge_heap.h"
#include "compress/bake/lod/edge_placement_body.h"
#include "compress/bake/lod/quadric.h"

namespace packtrace {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr double kBorderWeight = 8.0;  // of border planes against the triangles' own
constexpr double kSeamWeight = 2.0;    // where the material changes
constexpr double kCreaseWeight = 0.25; // where normals or texture coordinates change
constexpr double kStayWeight = 1e-4; // of the point itself: where all is flat, short edges go first and none gets long
constexpr double kLargestTurn = 0.2; // cosine; a triangle may turn by less than that in one collapse

constexpr double kRetryShare = 0.75; // of the triangles left: then rejected edges are tried again

/// Which point an edge becomes.
struct Placement {
  DVec3 point;
  double cost;
  double along; ///< 0 at a .. 1 at b
};

struct Edge {
  uint32_t a, b;  ///< points at first; follow merged_into_
  uint32_t stamp; ///< of both when the placement was computed
  Placement placement;
};

PlacementKernel pick_placement_kernel() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return avx2::place_edges;
#endif
  return place_edges;
}

class Simplifier {
public:
  Simplifier(SimplifyMesh& mesh, const SimplifyConfig& config) : m_(mesh), config_(config) {}

  void run() {
    m_.moved.assign(m_.points.size(), 0);
    m_.stands_for.resize(m_.points.size());
    for (uint32_t i = 0; i < m_.stands_for.size(); ++i) m_.stands_for[i] = i;
    live_ = m_.triangles.size();
    m_.source.resize(live_);
    std::iota(m_.source.begin(), m_.source.end(), 0u);
    for (const DVec3& p : m_.points) lo_ = glm::min(lo_, p), hi_ = glm::max(hi_, p);
    if (live_ <= config_.target_triangles) return;
    for (int axis = 0; axis < 3; ++axis) batch_.lo[axis] = lo_[axis], batch_.hi[axis] = hi_[axis];
    batch_.ends_only = config_.keep_points;
    link_corners();
    find_edges();
    fill_heap();
    while (live_ > config_.target_triangles && !heap_.empty()) {
      const size_t before = live_;
      // Edges that could not go may, once what is around them has changed.
      const auto next = static_cast<size_t>(kRetryShare * static_cast<double>(live_));
      drain_heap(std::max<size_t>(config_.target_triangles, next));
      if (live_ == before) break;
      retry_rejected();
    }
    compact();
    for (uint32_t e = 0; e < same_edge_.size(); ++e) same_edge_[e] = edge_root(e);
    m_.side_edges = std::move(side_edge_);
    m_.edge_became = std::move(same_edge_);
    for (uint32_t i = 0; i < merged_into_.size(); ++i) m_.stands_for[i] = root(i);
  }

private:
  static constexpr uint8_t kBorder = 1;

  // ---- what is where

  void link_corners() {
    const size_t count = m_.triangles.size();
    next_corner_.assign(3 * count, kNone);
    first_corner_.assign(m_.points.size(), kNone);
    last_corner_.assign(m_.points.size(), kNone);
    for (uint32_t corner = 0; corner < 3 * count; ++corner) append(point_of(corner), corner);
    alive_.assign(count, 1);
    merged_into_.resize(m_.points.size());
    for (uint32_t i = 0; i < merged_into_.size(); ++i) merged_into_[i] = i;
    stamp_.assign(m_.points.size(), 0);
    flags_.assign(m_.points.size(), 0);
    quadrics_.assign(m_.points.size(), {});
    mark_.assign(m_.points.size(), 0);
    wedge_into_.resize(m_.wedges.size());
    for (uint32_t i = 0; i < wedge_into_.size(); ++i) wedge_into_[i] = i;
  }

  uint32_t point_of(uint32_t corner) const { return m_.triangles[corner / 3].points[static_cast<int>(corner % 3)]; }

  void append(uint32_t point, uint32_t corner) {
    if (first_corner_[point] == kNone)
      first_corner_[point] = corner;
    else
      next_corner_[last_corner_[point]] = corner;
    last_corner_[point] = corner;
  }

  uint32_t root(uint32_t point) {
    while (merged_into_[point] != point) point = merged_into_[point] = merged_into_[merged_into_[point]];
    return point;
  }

  uint32_t wedge_root(uint32_t wedge) const {
    while (wedge != Wedge::kNone && wedge_into_[wedge] != wedge) wedge = wedge_into_[wedge];
    return wedge;
  }

  DVec3 area_normal(const Triangle& t) const {
    return glm::cross(m_.points[t.y] - m_.points[t.x], m_.points[t.z] - m_.points[t.x]);
  }

  // ---- edges and costs at the start

  /// A side of a triangle while edges are looked for.
  struct EdgeUse {
    uint32_t a, b, uses, triangle;
    bool seam, crease;
  };

  void find_edges() {
    std::vector<EdgeUse> uses;
    uses.reserve(m_.triangles.size() * 2);
    std::vector<uint32_t> first(m_.points.size(), kNone), next; // lists of uses by their lower point
    next.reserve(m_.triangles.size() * 2);
    side_edge_.resize(3 * m_.triangles.size());
    for (uint32_t i = 0; i < m_.triangles.size(); ++i) {
      const Triangle& t = m_.triangles[i].points;
      for (uint32_t corner = 0; corner < 3; ++corner) {
        const uint32_t p = t[static_cast<int>(corner)], q = t[static_cast<int>((corner + 1) % 3)];
        const uint32_t a = std::min(p, q), b = std::max(p, q);
        uint32_t found = first[a];
        while (found != kNone && uses[found].b != b) found = next[found];
        if (found == kNone) {
          found = static_cast<uint32_t>(uses.size());
          uses.push_back({a, b, 1, i, false, false});
          next.push_back(std::exchange(first[a], found));
        } else {
          join(uses[found], i);
        }
        side_edge_[3 * i + corner] = found;
      }
    }
    add_triangle_planes();
    edges_.reserve(uses.size());
    for (const EdgeUse& e : uses) {
      if (e.uses == 1) flags_[e.a] |= kBorder, flags_[e.b] |= kBorder;
      const double weight = e.uses == 1 ? kBorderWeight : e.seam ? kSeamWeight : e.crease ? kCreaseWeight : 0.0;
      if (weight > 0.0) add_side_plane(e, weight);
      edges_.push_back({e.a, e.b, 0, {}});
    }
    same_edge_.resize(edges_.size());
    std::iota(same_edge_.begin(), same_edge_.end(), 0u);
  }

  void join(EdgeUse& e, uint32_t triangle) const {
    const LodTriangle &s = m_.triangles[e.triangle], &t = m_.triangles[triangle];
    ++e.uses;
    e.seam |= config_.seam_of_kind[s.kind] != config_.seam_of_kind[t.kind];
    const auto wedge_at = [](const LodTriangle& of, uint32_t point) {
      for (int i = 0; i < 3; ++i)
        if (of.points[i] == point) return of.wedges[i];
      return Wedge::kNone;
    };
    e.crease |= s.kind == t.kind && (wedge_at(s, e.a) != wedge_at(t, e.a) || wedge_at(s, e.b) != wedge_at(t, e.b));
  }

  void add_triangle_planes() {
    for (const LodTriangle& t : m_.triangles) {
      const DVec3 n = area_normal(t.points);
      const double area = glm::length(n);
      if (!(area > 0.0)) {
        add_line(t.points);
        continue;
      }
      Quadric q;
      q.add_plane(n / area, m_.points[t.points.x], area);
      for (int i = 0; i < 3; ++i) {
        quadrics_[t.points[i]].add(q);
        quadrics_[t.points[i]].add_point(m_.points[t.points[i]], kStayWeight * area);
      }
    }
  }

  /// A triangle whose corners lie in a line has no plane: its corners stay near the line, and its ends near where they
  /// are.
  void add_line(const Triangle& points) {
    int first = 0; // of its longest side, which is all of it
    double longest = 0.0;
    for (int i = 0; i < 3; ++i) {
      const DVec3 side = m_.points[points[(i + 1) % 3]] - m_.points[points[i]];
      if (const double length2 = glm::dot(side, side); length2 > longest) longest = length2, first = i;
    }
    const uint32_t a = points[first], b = points[(first + 1) % 3];
    const DVec3 along = (m_.points[b] - m_.points[a]) / std::sqrt(longest);
    Quadric line;
    line.add_line(along, m_.points[a], longest);
    for (int i = 0; i < 3; ++i) quadrics_[points[i]].add(line);
    for (const uint32_t end : {a, b}) {
      Quadric plane;
      plane.add_plane(along, m_.points[end], longest);
      quadrics_[end].add(plane);
    }
  }

  /// A plane through the edge, upright on its triangle.
  void add_side_plane(const EdgeUse& e, double weight) {
    const DVec3 along = m_.points[e.b] - m_.points[e.a];
    const DVec3 side = glm::cross(along, area_normal(m_.triangles[e.triangle].points));
    const double length = glm::length(side);
    if (!(length > 0.0)) return;
    Quadric q;
    q.add_plane(side / length, m_.points[e.a], weight * glm::dot(along, along));
    quadrics_[e.a].add(q);
    quadrics_[e.b].add(q);
  }

  // ---- which point an edge becomes

  /// 1: a stays where it is, 2: b, 0: neither.
  double keep(uint32_t a, uint32_t b) const {
    // What must not move stays; a border point does not leave the border for one inside.
    if (m_.locked[a] || ((flags_[a] & kBorder) != 0 && (flags_[b] & kBorder) == 0)) return 1.0;
    if (m_.locked[b] || ((flags_[b] & kBorder) != 0 && (flags_[a] & kBorder) == 0)) return 2.0;
    return 0.0;
  }

  void place(uint32_t a, uint32_t b, Placement& out) const {
    const Quadric &qa = quadrics_[a], &qb = quadrics_[b];
    const Quadric4<double> q = {qa.xx + qb.xx, qa.xy + qb.xy, qa.xz + qb.xz, qa.yy + qb.yy, qa.yz + qb.yz,
                                qa.zz + qb.zz, qa.bx + qb.bx, qa.by + qb.by, qa.bz + qb.bz, qa.c + qb.c};
    const DVec3 &pa = m_.points[a], &pb = m_.points[b];
    Vec4<double> point{};
    packtrace::place(q, {pa.x, pa.y, pa.z}, {pb.x, pb.y, pb.z}, keep(a, b), batch_, point, out.cost, out.along);
    out.point = {point.x, point.y, point.z};
  }

  void put_in_batch(size_t lane, uint32_t a, uint32_t b) {
    static_assert(sizeof(Quadric) == 10 * sizeof(double));
    const double *qa = &quadrics_[a].xx, *qb = &quadrics_[b].xx;
    for (size_t i = 0; i < 10; ++i) batch_.quadric[i][lane] = qa[i] + qb[i];
    for (int axis = 0; axis < 3; ++axis)
      batch_.a[axis][lane] = m_.points[a][axis], batch_.b[axis][lane] = m_.points[b][axis];
    batch_.keep[lane] = keep(a, b);
  }

  void fill_heap() {
    static const PlacementKernel kernel = pick_placement_kernel();
    std::vector<uint32_t> movable;
    movable.reserve(edges_.size());
    for (uint32_t i = 0; i < edges_.size(); ++i)
      if (!(m_.locked[edges_[i].a] && m_.locked[edges_[i].b])) movable.push_back(i);
    heap_.reserve(movable.size());
    for (size_t first = 0; first < movable.size(); first += 4) {
      const size_t count = std::min<size_t>(4, movable.size() - first);
      for (size_t lane = 0; lane < 4; ++lane) {
        const Edge& e = edges_[movable[first + std::min(lane, count - 1)]];
        put_in_batch(lane, e.a, e.b);
      }
      kernel(batch_);
      for (size_t lane = 0; lane < count; ++lane) {
        edges_[movable[first + lane]].placement = {
            {batch_.point[0][lane], batch_.point[1][lane], batch_.point[2][lane]},
            batch_.cost[lane],
            batch_.along[lane]};
        heap_.add(batch_.cost[lane], movable[first + lane]);
      }
    }
    heap_.sort();
  }

  void drain_heap(size_t triangles) {
    while (live_ > triangles && !heap_.empty()) {
      const uint32_t edge = heap_.top();
      Edge& e = edges_[edge];
      const uint32_t a = root(e.a), b = root(e.b);
      if (same_edge_[edge] != edge || a == b || (m_.locked[a] && m_.locked[b])) {
        heap_.pop();
        continue;
      }
      // What happened around it since may have made it dearer than others.
      if (e.stamp != stamp_[a] + stamp_[b]) {
        e.stamp = stamp_[a] + stamp_[b];
        place(a, b, e.placement);
        if (!heap_.change_top(e.placement.cost)) continue;
      }
      heap_.pop();
      try_collapse(a, b, e.placement, edge);
    }
  }

  void retry_rejected() {
    for (const uint32_t edge : rejected_) {
      Edge& e = edges_[edge];
      const uint32_t a = root(e.a), b = root(e.b);
      if (same_edge_[edge] != edge || a == b || (m_.locked[a] && m_.locked[b])) continue;
      e.stamp = stamp_[a] + stamp_[b];
      place(a, b, e.placement);
      heap_.add(e.placement.cost, edge);
    }
    rejected_.clear();
    heap_.sort();
  }

  // ---- one collapse

  /// The triangles around a and b. False where the collapse would leave no triangle there, or fold the surface.
  bool gather_star(uint32_t a, uint32_t b) {
    star_.clear();
    removed_.clear();
    ++mark_value_;
    size_t common = 0, third = 0;
    drop_dead(a);
    for (uint32_t c = first_corner_[a]; c != kNone; c = next_corner_[c]) {
      const uint32_t triangle = c / 3;
      const Triangle& t = m_.triangles[triangle].points;
      const bool both = t.x == b || t.y == b || t.z == b;
      (both ? removed_ : star_).push_back(triangle);
      for (int i = 0; i < 3; ++i)
        if (t[i] != a && t[i] != b) {
          if (both && mark_[t[i]] != 4 * mark_value_ + 2) ++third;
          mark_[t[i]] = both ? 4 * mark_value_ + 2 : std::max(mark_[t[i]], 4 * mark_value_ + 1);
        }
    }
    drop_dead(b);
    for (uint32_t c = first_corner_[b]; c != kNone; c = next_corner_[c]) {
      const uint32_t triangle = c / 3;
      const Triangle& t = m_.triangles[triangle].points;
      const bool both = t.x == a || t.y == a || t.z == a;
      if (!both) star_.push_back(triangle);
      for (int i = 0; i < 3; ++i)
        if (t[i] != a && t[i] != b && mark_[t[i]] >= 4 * mark_value_ + 1 && mark_[t[i]] <= 4 * mark_value_ + 2)
          ++common, mark_[t[i]] = 4 * mark_value_ + 3;
    }
    // Neighbours of both are just the third corners of the triangles at the edge: else the surface would touch itself.
    return !star_.empty() && !removed_.empty() && common == third;
  }

  /// Unlinks the corners of triangles that are gone.
  void drop_dead(uint32_t point) {
    uint32_t* link = &first_corner_[point];
    uint32_t last = kNone;
    while (*link != kNone) {
      if (alive_[*link / 3] == 0)
        *link = next_corner_[*link];
      else
        last = *link, link = &next_corner_[*link];
    }
    last_corner_[point] = last;
  }

  void try_collapse(uint32_t a, uint32_t b, const Placement& placement, uint32_t edge) {
    const bool a_border = (flags_[a] & kBorder) != 0, b_border = (flags_[b] & kBorder) != 0;
    // Two border points across the inside: the surface would be pinched.
    if (!gather_star(a, b) || (a_border && b_border && removed_.size() != 1) || turns_over(a, b, placement.point))
      rejected_.push_back(edge);
    else
      collapse(a, b, placement);
  }

  bool turns_over(uint32_t a, uint32_t b, DVec3 point) const {
    return std::any_of(star_.begin(), star_.end(),
                       [&](uint32_t triangle) { return turns_over(triangle, a, b, point); });
  }

  bool turns_over(uint32_t triangle, uint32_t a, uint32_t b, DVec3 point) const {
    const Triangle& t = m_.triangles[triangle].points;
    std::array<DVec3, 3> p;
    for (int i = 0; i < 3; ++i) p[static_cast<size_t>(i)] = t[i] == a || t[i] == b ? point : m_.points[t[i]];
    const DVec3 before = area_normal(t), after = glm::cross(p[1] - p[0], p[2] - p[0]);
    const double lengths2 = glm::dot(before, before) * glm::dot(after, after);
    const double dot = glm::dot(before, after);
    if (!(glm::dot(before, before) > 0.0)) return false; // had no side
    return !(dot > 0.0) || dot * dot < kLargestTurn * kLargestTurn * lengths2;
  }

  void collapse(uint32_t a, uint32_t b, const Placement& placement) {
    merge_wedges(a, b, placement.along);
    // The point of the corner lists that stays is the one that must not move, or a.
    const bool keep_b = m_.locked[b] != 0 || (m_.locked[a] == 0 && placement.point == m_.points[b]);
    const uint32_t kept = keep_b ? b : a, gone = keep_b ? a : b;
    for (const uint32_t triangle : removed_) {
      merge_edges(triangle, kept, gone);
      alive_[triangle] = 0, --live_;
    }
    for (uint32_t c = first_corner_[gone]; c != kNone; c = next_corner_[c])
      m_.triangles[c / 3].points[static_cast<int>(c % 3)] = kept;
    if (first_corner_[gone] != kNone) {
      if (first_corner_[kept] == kNone)
        first_corner_[kept] = first_corner_[gone];
      else
        next_corner_[last_corner_[kept]] = first_corner_[gone];
      last_corner_[kept] = last_corner_[gone];
      first_corner_[gone] = kNone;
    }
    merged_into_[gone] = kept;
    quadrics_[kept].add(quadrics_[gone]);
    flags_[kept] |= flags_[gone];
    if (m_.points[kept] != placement.point) m_.points[kept] = placement.point, m_.moved[kept] = 1;
    stamp_[kept] += stamp_[gone] + 1;
  }

  uint32_t edge_root(uint32_t edge) {
    while (same_edge_[edge] != edge) edge = same_edge_[edge] = same_edge_[same_edge_[edge]];
    return edge;
  }

  /// The other two sides of a vanishing triangle become one.
  void merge_edges(uint32_t triangle, uint32_t kept, uint32_t gone) {
    const Triangle& t = m_.triangles[triangle].points;
    uint32_t of_kept = kNone, of_gone = kNone;
    for (int i = 0; i < 3; ++i) {
      const uint32_t p = t[i], q = t[(i + 1) % 3], edge = side_edge_[3 * triangle + static_cast<uint32_t>(i)];
      if (p != gone && q != gone) of_kept = edge_root(edge);
      if (p != kept && q != kept) of_gone = edge_root(edge);
    }
    if (of_kept != of_gone) same_edge_[of_gone] = of_kept;
  }

  /// Corners of a and b that a vanishing triangle joins become one wedge; the others keep theirs.
  void merge_wedges(uint32_t a, uint32_t b, double along) {
    std::array<uint32_t, 4> done{};
    size_t done_count = 0; // a seam that ends here goes on at one side only
    const auto is_done = [&](uint32_t wedge) {
      return std::find(done.begin(), done.begin() + done_count, wedge) != done.begin() + done_count;
    };
    for (const uint32_t triangle : removed_) {
      const LodTriangle& t = m_.triangles[triangle];
      uint32_t wa = Wedge::kNone, wb = Wedge::kNone;
      for (int i = 0; i < 3; ++i) {
        if (t.points[i] == a) wa = wedge_root(t.wedges[i]);
        if (t.points[i] == b) wb = wedge_root(t.wedges[i]);
      }
      if (wa == Wedge::kNone || wb == Wedge::kNone || wa == wb || is_done(wa) || is_done(wb)) continue;
      if (along == 0.0) {
        wedge_into_[wb] = wa;
      } else if (along == 1.0) {
        wedge_into_[wa] = wb;
      } else {
        Wedge merged;
        const Wedge &u = m_.wedges[wa], &v = m_.wedges[wb];
        const DVec3 n = (1.0 - along) * u.normal + along * v.normal;
        const double length = glm::length(n);
        merged.normal = length > 0.0 ? n / length : u.normal;
        const auto number = static_cast<uint32_t>(m_.wedges.size());
        m_.wedges.push_back(merged);
        wedge_into_.push_back(number);
        wedge_into_[wa] = wedge_into_[wb] = number;
      }
      if (done_count < done.size()) done[done_count++] = wedge_root(wa);
    }
  }

  void compact() {
    size_t kept = 0;
    for (size_t i = 0; i < m_.triangles.size(); ++i) {
      if (alive_[i] == 0) continue;
      LodTriangle t = m_.triangles[i];
      for (int corner = 0; corner < 3; ++corner) t.wedges[corner] = wedge_root(t.wedges[corner]);
      m_.source[kept] = static_cast<uint32_t>(i);
      m_.triangles[kept++] = t;
    }
    m_.triangles.resize(kept);
    m_.source.resize(kept);
  }

  SimplifyMesh& m_;
  const SimplifyConfig& config_;
  size_t live_ = 0;
  DVec3 lo_{std::numeric_limits<double>::infinity()}, hi_{-lo_};   // nothing leaves this box
  std::vector<uint32_t> next_corner_, first_corner_, last_corner_; // lists of corners around each point
  std::vector<uint8_t> alive_, flags_;
  std::vector<uint32_t> merged_into_, wedge_into_, stamp_;
  std::vector<Quadric> quadrics_;
  std::vector<Edge> edges_;
  std::vector<uint32_t> side_edge_; ///< per corner: the edge to the next corner; follow same_edge_
  std::vector<uint32_t> same_edge_; ///< edges that became one
  EdgeHeap heap_;
  EdgeBatch batch_{};
  std::vector<uint32_t> rejected_;
  std::vector<uint32_t> mark_;
  uint32_t mark_value_ = 0;
  std::vector<uint32_t> star_, removed_; // triangles with one of a and b, with both
};

} // namespace

void simplify(SimplifyMesh& mesh, const SimplifyConfig& config) { Simplifier(mesh, config).run(); }

} // namespace packtrace
