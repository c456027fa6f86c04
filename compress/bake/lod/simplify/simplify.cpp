#include "compress/bake/lod/simplify/simplify.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "compress/bake/lod/simplify/corner_lists.h"
#include "compress/bake/lod/simplify/edge_queue.h"
#include "compress/bake/lod/simplify/surface_edges.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace {
namespace {

constexpr uint32_t kUnknownEdge = ~0u;
constexpr double kLargestTurn = 0.2; // minimum cosine between a triangle's normals before and after a collapse
constexpr double kRetryShare = 0.75; // share of the triangles left at which rejected edges are tried again

PlacementKernel pick_placement_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::place_edges;
#endif
  return place_edges;
}

bool on_border(double held) { return held == kOnBorder || held == kOnBorder + kLocked; }

class Simplifier {
public:
  Simplifier(SimplifyMesh& mesh, const SimplifyConfig& config)
      : m_(mesh), config_(config), corners_(mesh.triangles, mesh.points.size()) {}

  void run() {
    surface_ = find_surface_edges(m_, config_);
    start();
    for (bool any = true; live_ > config_.target_triangles && any;) {
      const size_t before = live_;
      // Rejected edges may collapse once their surroundings have changed.
      const auto next = static_cast<size_t>(kRetryShare * static_cast<double>(live_));
      any = drain_queue(std::max<size_t>(config_.target_triangles, next));
      if (live_ == before && std::exchange(may_tear_, true)) break;
      any |= retry_rejected();
    }
    compact();
    for (uint32_t e = 0; e < same_edge_.size(); ++e) same_edge_[e] = edge_root(e);
    m_.side_edges = std::move(surface_.side_edge);
    m_.edge_became = std::move(same_edge_);
    for (uint32_t i = 0; i < merged_into_.size(); ++i) m_.stands_for[i] = root(i);
  }

private:
  void start() {
    live_ = m_.triangles.size();
    const auto count_up = [](std::vector<uint32_t>& numbers, size_t count) {
      numbers.resize(count);
      std::iota(numbers.begin(), numbers.end(), 0u);
    };
    count_up(merged_into_, m_.points.size());
    count_up(wedge_into_, m_.wedges.size());
    count_up(same_edge_, surface_.ends.size());
    stamp_.assign(m_.points.size(), 0);
    in_star_.assign(m_.points.size(), 0);
    edge_stamp_.assign(surface_.ends.size(), 0);
    DVec3 lo(std::numeric_limits<double>::infinity()), hi(-lo);
    for (const DVec3& p : m_.points) lo = glm::min(lo, p), hi = glm::max(hi, p);
    for (int axis = 0; axis < 3; ++axis) rules_.lo[axis] = lo[axis], rules_.hi[axis] = hi[axis];
    rules_.ends_only = config_.keep_points;
    placements_.resize(surface_.ends.size());
    place(surface_.ends, placements_);
    queue_.reset(surface_.ends.size());
    for (uint32_t edge = 0; edge < surface_.ends.size(); ++edge)
      if (const EdgeEnds e = surface_.ends[edge]; m_.locked[e.a] == 0 || m_.locked[e.b] == 0)
        queue_.add(placements_[edge].cost, edge);
  }

  void place(std::span<const EdgeEnds> edges, std::span<EdgePlacement> out) const {
    static const PlacementKernel kernel = pick_placement_kernel();
    kernel(surface_.points.data(), rules_, edges.data(), edges.size(), out.data());
  }

  uint32_t root(uint32_t point) {
    while (merged_into_[point] != point) point = merged_into_[point] = merged_into_[merged_into_[point]];
    return point;
  }

  uint32_t edge_root(uint32_t edge) {
    while (same_edge_[edge] != edge) edge = same_edge_[edge] = same_edge_[same_edge_[edge]];
    return edge;
  }

  uint32_t wedge_root(uint32_t wedge) const {
    while (wedge != Wedge::kNone && wedge_into_[wedge] != wedge) wedge = wedge_into_[wedge];
    return wedge;
  }

  // ---- order of collapses

  /// Updates an edge's ends to the points that they were merged into. Returns false if it can no longer collapse.
  bool follow(uint32_t edge) {
    EdgeEnds& e = surface_.ends[edge];
    e = {root(e.a), root(e.b)};
    return same_edge_[edge] == edge && e.a != e.b && (m_.locked[e.a] == 0 || m_.locked[e.b] == 0);
  }

  /// Whether a collapse nearby has changed the edge's cost since it was placed.
  bool is_stale(uint32_t edge) const {
    const EdgeEnds e = surface_.ends[edge];
    return edge_stamp_[edge] != stamp_[e.a] + stamp_[e.b];
  }

  /// Collapses edges until at most this many triangles are left. Returns false if no edges are left.
  bool drain_queue(size_t triangles) {
    while (live_ > triangles) {
      if (queue_.heap_empty()) {
        edges_.clear();
        if (!queue_.open_next(edges_)) return false;
        add_placed();
        continue;
      }
      const uint32_t edge = queue_.top();
      if (!follow(edge)) {
        queue_.pop();
      } else if (is_stale(edge)) {
        place_tops();
      } else {
        queue_.pop();
        try_collapse(edge);
      }
    }
    return true;
  }

  /// Places the stale edges at the top again: four in SIMD lanes cost little more than one.
  void place_tops() {
    constexpr size_t kLanes = 4;
    edges_.clear();
    for (; edges_.size() < kLanes && !queue_.heap_empty(); queue_.pop())
      if (const uint32_t edge = queue_.top(); follow(edge)) {
        if (!is_stale(edge)) break;
        edges_.push_back(edge);
      }
    add_placed();
  }

  /// Adds edges_ to the queue, except those that can no longer collapse. Stale edges are placed again first.
  void add_placed() {
    size_t stale = 0;
    stale_ends_.clear();
    for (const uint32_t edge : edges_) {
      if (!follow(edge)) continue;
      if (is_stale(edge))
        edges_[stale++] = edge, stale_ends_.push_back(surface_.ends[edge]);
      else
        queue_.add(placements_[edge].cost, edge);
    }
    placed_.resize(stale);
    place(stale_ends_, placed_);
    for (size_t i = 0; i < stale; ++i) {
      const uint32_t edge = edges_[i];
      placements_[edge] = placed_[i];
      edge_stamp_[edge] = stamp_[stale_ends_[i].a] + stamp_[stale_ends_[i].b];
      queue_.add(placed_[i].cost, edge);
    }
  }

  /// Adds the rejected edges to the queue again. Returns whether there are any.
  bool retry_rejected() {
    std::swap(edges_, rejected_);
    rejected_.clear();
    add_placed();
    return !edges_.empty();
  }

  // ---- one collapse

  /// A triangle with one end of the edge; its other corners in order.
  struct StarTriangle {
    uint32_t triangle, next, last;
    DVec3 area_normal; ///< after the collapse
  };

  void try_collapse(uint32_t edge) {
    const EdgeEnds e = surface_.ends[edge];
    const EdgePlacement& p = placements_[edge];
    const DVec3 point(p.at[0], p.at[1], p.at[2]);
    if (!gather_star(e.a, e.b) || disconnects(e.a, e.b) || folds_over(point))
      rejected_.push_back(edge);
    else
      collapse(e.a, e.b, point, p.along);
  }

  /// Collects the triangles around a and b. Returns false if the collapse would leave none. A collapse may make the
  /// surface touch itself: common neighbours of a and b need not share a triangle with the edge.
  bool gather_star(uint32_t a, uint32_t b) {
    star_.clear();
    removed_.clear();
    ++star_number_;
    const auto gather = [&](uint32_t at, uint32_t other, bool is_first) {
      corners_.for_each(at, [&](uint32_t corner) {
        const uint32_t next = corners_.point(CornerLists::next_corner(corner));
        const uint32_t last = corners_.point(CornerLists::last_corner(corner));
        if (next != other && last != other)
          star_.push_back({corner / 4, next, last, {}}), in_star_[next] = in_star_[last] = star_number_;
        else if (is_first)
          removed_.push_back(corner / 4);
      });
    };
    gather(a, b, true);
    gather(b, a, false);
    return !star_.empty() && !removed_.empty();
  }

  /// Whether the collapse would remove the only triangle that connects its third point to the edge. The quadrics do not
  /// measure what the surface loses there, so this is allowed only when no other edge can collapse, and never if that
  /// point and an end are locked: the edge between them stays.
  bool disconnects(uint32_t a, uint32_t b) const {
    for (const uint32_t triangle : removed_)
      for (uint32_t corner = 4 * triangle; corner < 4 * triangle + 3; ++corner) {
        const uint32_t point = corners_.point(corner);
        if (point == a || point == b) continue;
        if (may_tear_ && (m_.locked[point] == 0 || (m_.locked[a] == 0 && m_.locked[b] == 0))) continue;
        if (in_star_[point] != star_number_) return true;
      }
    return false;
  }

  /// Whether moving both ends to `point` would fold over a triangle.
  bool folds_over(const DVec3& point) {
    for (StarTriangle& t : star_) {
      const DVec3& before = surface_.area_normals[t.triangle];
      t.area_normal = glm::cross(m_.points[t.next] - point, m_.points[t.last] - point);
      const double before2 = glm::dot(before, before), dot = glm::dot(before, t.area_normal);
      if (!(before2 > 0.0)) continue; // degenerate, no normal
      if (!(dot > 0.0) || dot * dot < kLargestTurn * kLargestTurn * before2 * glm::dot(t.area_normal, t.area_normal))
        return true;
    }
    return false;
  }

  void collapse(uint32_t a, uint32_t b, const DVec3& point, double along) {
    if (!m_.wedges.empty()) merge_wedges(a, b, along);
    // Keeps the locked point, if one is locked; otherwise b if it stays in place, else a.
    const bool keep_b = m_.locked[b] != 0 || (m_.locked[a] == 0 && point == m_.points[b]);
    const uint32_t kept = keep_b ? b : a, gone = keep_b ? a : b;
    for (const uint32_t triangle : removed_) {
      merge_edges(triangle, kept, gone);
      corners_.remove(triangle), --live_;
    }
    for (const StarTriangle& t : star_) surface_.area_normals[t.triangle] = t.area_normal;
    corners_.move_all(gone, kept);
    merged_into_[gone] = kept;
    CollapsePoint& p = surface_.points[kept];
    const CollapsePoint& q = surface_.points[gone];
    for (size_t i = 0; i < std::size(p.quadric); ++i) p.quadric[i] += q.quadric[i];
    for (int axis = 0; axis < 3; ++axis) p.at[axis] = point[axis];
    if (on_border(q.held) && !on_border(p.held)) p.held += kOnBorder;
    if (m_.points[kept] != point) m_.points[kept] = point, m_.moved[kept] = 1;
    stamp_[kept] += stamp_[gone] + 1;
  }

  /// Merges the two sides of a vanishing triangle that become one.
  void merge_edges(uint32_t triangle, uint32_t kept, uint32_t gone) {
    uint32_t of_kept = kUnknownEdge, of_gone = kUnknownEdge;
    for (uint32_t i = 0; i < 3; ++i) {
      const uint32_t p = corners_.point(4 * triangle + i),
                     q = corners_.point(CornerLists::next_corner(4 * triangle + i));
      const uint32_t edge = surface_.side_edge[3 * triangle + i];
      if (p != gone && q != gone) of_kept = edge_root(edge);
      if (p != kept && q != kept) of_gone = edge_root(edge);
    }
    if (of_kept != of_gone) same_edge_[of_gone] = of_kept;
  }

  /// Merges the wedges of a and b that vanishing triangles connect; others stay.
  void merge_wedges(uint32_t a, uint32_t b, double along) {
    std::array<uint32_t, 4> done{};
    size_t done_count = 0; // a seam that ends here continues on one side only
    const auto is_done = [&](uint32_t wedge) {
      return std::find(done.begin(), done.begin() + done_count, wedge) != done.begin() + done_count;
    };
    for (const uint32_t triangle : removed_) {
      const LodTriangle& t = m_.triangles[triangle];
      uint32_t wa = Wedge::kNone, wb = Wedge::kNone;
      for (uint32_t i = 0; i < 3; ++i) {
        const uint32_t point = corners_.point(4 * triangle + i), wedge = t.wedges[static_cast<int>(i)];
        if (point == a) wa = wedge_root(wedge);
        if (point == b) wb = wedge_root(wedge);
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
    for (uint32_t i = 0; i < m_.triangles.size(); ++i) {
      if (!corners_.alive(i)) continue;
      LodTriangle t = m_.triangles[i];
      for (uint32_t k = 0; k < 3; ++k) {
        const int corner = static_cast<int>(k);
        t.points[corner] = corners_.point(4 * i + k), t.wedges[corner] = wedge_root(t.wedges[corner]);
      }
      m_.source[kept] = i;
      m_.triangles[kept++] = t;
    }
    m_.triangles.resize(kept);
    m_.source.resize(kept);
  }

  SimplifyMesh& m_;
  const SimplifyConfig& config_;
  CornerLists corners_;
  SurfaceEdges surface_; ///< `ends` are updated as points merge; side_edge is constant, see same_edge_
  PlacementRules rules_{};
  size_t live_ = 0;
  bool may_tear_ = false;
  std::vector<uint32_t> merged_into_, wedge_into_;
  std::vector<uint32_t> same_edge_;  ///< per edge: the edge that it was merged into
  std::vector<uint32_t> stamp_;      ///< per point: number of changes
  std::vector<uint32_t> edge_stamp_; ///< per edge: sum of its ends' stamps when it was placed
  std::vector<EdgePlacement> placements_;
  EdgeQueue queue_;
  std::vector<uint32_t> rejected_;
  // Edges that add_placed() adds, and the ends and placements of the stale ones.
  std::vector<uint32_t> edges_;
  std::vector<EdgeEnds> stale_ends_;
  std::vector<EdgePlacement> placed_;
  std::vector<StarTriangle> star_;
  std::vector<uint32_t>
      in_star_; ///< per point: number of the last star that has the point in a triangle, but not as an end
  uint32_t star_number_ = 0;
  std::vector<uint32_t> removed_; ///< triangles that contain both ends
};

} // namespace

void simplify(SimplifyMesh& mesh, const SimplifyConfig& config) {
  mesh.moved.assign(mesh.points.size(), 0);
  mesh.stands_for.resize(mesh.points.size());
  std::iota(mesh.stands_for.begin(), mesh.stands_for.end(), 0u);
  mesh.source.resize(mesh.triangles.size());
  std::iota(mesh.source.begin(), mesh.source.end(), 0u);
  if (mesh.triangles.size() > config.target_triangles) Simplifier(mesh, config).run();
}

} // namespace packtrace
