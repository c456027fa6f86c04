#include "pbrt_import/shapes/subdivision.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"
#include "pbrt_import/shapes/mesh_cleanup.h"

namespace packtrace {
namespace {

constexpr uint32_t kNone = ~0u;

/// Half-edge 3 * triangle + corner runs from that corner to the next one.
constexpr uint32_t next(uint32_t half_edge) { return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1; }
constexpr uint32_t previous(uint32_t half_edge) { return half_edge % 3 == 0 ? half_edge + 2 : half_edge - 1; }

/// A level of subdivision: consistently oriented triangles in which every vertex has a single fan, open or closed.
struct Level {
  std::vector<DVec3> points;
  std::vector<uint32_t> start;    ///< per half-edge: its start vertex
  std::vector<uint32_t> opposite; ///< per half-edge: the opposite half-edge, or kNone at the boundary

  uint32_t half_edge_count() const { return static_cast<uint32_t>(start.size()); }
  uint32_t end(uint32_t half_edge) const { return start[next(half_edge)]; }
  /// The next half-edge around the start vertex; kNone past the boundary.
  uint32_t counter_clockwise(uint32_t half_edge) const { return opposite[previous(half_edge)]; }
  uint32_t clockwise(uint32_t half_edge) const {
    const uint32_t across = opposite[half_edge];
    return across == kNone ? kNone : next(across);
  }
};

/// Half-edges grouped by their lower vertex, and sorted by their higher vertex within each group.
struct SortedHalfEdges {
  struct Entry {
    uint32_t high;
    uint32_t half_edge;
  };
  std::vector<uint32_t> first; ///< start of each vertex's entries, with one more element at the end
  std::vector<Entry> entries;
};

SortedHalfEdges sort_half_edges(const Level& level) {
  SortedHalfEdges sorted;
  const auto low = [&](uint32_t h) { return std::min(level.start[h], level.end(h)); };
  sorted.first.assign(level.points.size() + 1, 0);
  for (uint32_t h = 0; h < level.half_edge_count(); ++h) ++sorted.first[low(h) + 1];
  std::partial_sum(sorted.first.begin(), sorted.first.end(), sorted.first.begin());
  std::vector<uint32_t> cursor = sorted.first;
  sorted.entries.resize(level.half_edge_count());
  for (uint32_t h = 0; h < level.half_edge_count(); ++h)
    sorted.entries[cursor[low(h)]++] = {std::max(level.start[h], level.end(h)), h};
  for (size_t v = 0; v < level.points.size(); ++v)
    std::sort(
        sorted.entries.begin() + sorted.first[v], sorted.entries.begin() + sorted.first[v + 1],
        [](const auto& a, const auto& b) { return std::pair(a.high, a.half_edge) < std::pair(b.high, b.half_edge); });
  return sorted;
}

/// Fills level.opposite. Two half-edges are joined if they are the only ones on an edge and run in opposite directions.
/// Returns the number of edges that several triangles share but that stay unjoined.
uint64_t join_half_edges(Level& level) {
  const SortedHalfEdges sorted = sort_half_edges(level);
  uint64_t apart = 0;
  level.opposite.assign(level.half_edge_count(), kNone);
  for (size_t v = 0; v < level.points.size(); ++v) {
    for (uint32_t i = sorted.first[v]; i < sorted.first[v + 1];) {
      uint32_t run_end = i + 1;
      while (run_end < sorted.first[v + 1] && sorted.entries[run_end].high == sorted.entries[i].high) ++run_end;
      const uint32_t a = sorted.entries[i].half_edge, b = sorted.entries[run_end - 1].half_edge;
      if (run_end - i == 2 && level.start[a] != level.start[b]) {
        level.opposite[a] = b;
        level.opposite[b] = a;
      } else if (run_end - i > 1) {
        ++apart;
      }
      i = run_end;
    }
  }
  return apart;
}

/// Gives each fan of triangles its own vertex: the first fan of a point keeps the point's number, others get new
/// vertices at the end. Returns the number of vertices added.
uint64_t split_fans(Level& level) {
  const size_t point_count = level.points.size();
  std::vector<uint32_t> vertex(level.half_edge_count(), kNone);
  std::vector<uint8_t> taken(point_count, 0);
  for (uint32_t h = 0; h < level.half_edge_count(); ++h) {
    if (vertex[h] != kNone) continue;
    const uint32_t point = level.start[h];
    uint32_t id = point;
    if (taken[point]) {
      id = static_cast<uint32_t>(level.points.size());
      level.points.push_back(DVec3(level.points[point]));
    }
    taken[point] = 1;
    for (uint32_t x = h; x != kNone && vertex[x] == kNone; x = level.counter_clockwise(x)) vertex[x] = id;
    for (uint32_t x = level.clockwise(h); x != kNone && vertex[x] == kNone; x = level.clockwise(x)) vertex[x] = id;
  }
  level.start = std::move(vertex);
  return level.points.size() - point_count;
}

// Weights of each neighbour; the vertex itself has the rest of 1.
double even_weight(uint32_t valence) { return valence == 3 ? 3.0 / 16.0 : 3.0 / (8.0 * valence); }
double limit_weight(uint32_t valence) { return 1.0 / (valence + 3.0 / (8.0 * even_weight(valence))); }
constexpr double kEvenBoundaryWeight = 1.0 / 8.0;
constexpr double kLimitBoundaryWeight = 1.0 / 5.0;

/// Moves every vertex to (1 - n w) p + w (sum of neighbours). Interior vertices use all n neighbours, with
/// interior_weight(n) as w; boundary vertices use the two neighbours along the boundary, with boundary_weight as w.
/// Streams over half-edges instead of walking around vertices.
template <class Weight>
std::vector<DVec3> smooth(const Level& level, Weight interior_weight, double boundary_weight) {
  const size_t count = level.points.size();
  std::vector<DVec3> sums(count, DVec3(0.0));
  std::vector<uint32_t> valence(count, 0);
  std::vector<uint8_t> boundary(count, 0);
  for (uint32_t h = 0; h < level.half_edge_count(); ++h) {
    if (level.opposite[h] != kNone) continue;
    const uint32_t a = level.start[h], b = level.end(h);
    sums[a] += level.points[b];
    sums[b] += level.points[a];
    boundary[a] = boundary[b] = 1;
  }
  for (uint32_t h = 0; h < level.half_edge_count(); ++h) {
    const uint32_t a = level.start[h];
    if (boundary[a]) continue;
    sums[a] += level.points[level.end(h)];
    ++valence[a];
  }
  for (size_t v = 0; v < count; ++v) {
    const uint32_t n = boundary[v] ? 2 : valence[v];
    const double w = boundary[v] ? boundary_weight : interior_weight(n);
    sums[v] = (1.0 - n * w) * level.points[v] + w * sums[v];
  }
  return sums;
}

/// Adds one vertex per edge, numbered after the old ones in the order of the edges' first half-edges. Returns the edge
/// vertex of each half-edge.
std::vector<uint32_t> add_edge_points(const Level& level, std::vector<DVec3>& points) {
  std::vector<uint32_t> edge_vertex(level.half_edge_count());
  for (uint32_t h = 0; h < level.half_edge_count(); ++h) {
    const uint32_t across = level.opposite[h];
    if (across < h) { // never true for kNone
      edge_vertex[h] = edge_vertex[across];
      continue;
    }
    edge_vertex[h] = static_cast<uint32_t>(points.size());
    const DVec3 ends = level.points[level.start[h]] + level.points[level.end(h)];
    points.push_back(across == kNone ? 0.5 * ends
                                     : 0.375 * ends + 0.125 * (level.points[level.start[previous(h)]] +
                                                               level.points[level.start[previous(across)]]));
  }
  return edge_vertex;
}

/// Splits triangle t into triangles 4t + k at its corners k, and 4t + 3 in the middle. Corners keep their position in
/// the triangle, so the halves of edge k are edge k of child k and edge k of child k + 1, and opposite half-edges
/// follow without a search.
Level subdivide(const Level& level) {
  Level fine;
  const uint32_t half_edge_count = level.half_edge_count();
  fine.points = smooth(level, even_weight, kEvenBoundaryWeight);
  fine.points.reserve(level.points.size() + half_edge_count / 2 + half_edge_count / 8);
  const std::vector<uint32_t> edge_vertex = add_edge_points(level, fine.points);
  fine.start.resize(size_t{4} * half_edge_count);
  fine.opposite.resize(size_t{4} * half_edge_count);
  const auto child = [](uint32_t half_edge, uint32_t corner) { return 12 * (half_edge / 3) + 3 * corner; };
  for (uint32_t h = 0; h < half_edge_count; ++h) {
    const uint32_t k = h % 3, after = next(k), before = previous(k);
    const uint32_t mine = child(h, k), middle = child(h, 3), neighbour = child(h, after);
    fine.start[mine + k] = level.start[h];
    fine.start[mine + after] = edge_vertex[h];
    fine.start[mine + before] = edge_vertex[previous(h)];
    fine.start[middle + k] = edge_vertex[h];
    fine.opposite[mine + after] = middle + before;
    fine.opposite[middle + before] = mine + after;
    const uint32_t across = level.opposite[h];
    if (across == kNone) {
      fine.opposite[mine + k] = fine.opposite[neighbour + k] = kNone;
    } else {
      const uint32_t j = across % 3;
      fine.opposite[mine + k] = child(across, next(j)) + j;
      fine.opposite[neighbour + k] = child(across, j) + j;
    }
  }
  return fine;
}

/// Cosine and sine of 2 pi j / n, tabulated for common valences.
class RingTable {
public:
  RingTable() {
    for (uint32_t n = 1; n <= kMaxValence; ++n)
      for (uint32_t j = 0; j < n; ++j) entries_[n][j] = compute(j, n);
  }
  std::pair<double, double> operator()(uint32_t j, uint32_t n) const {
    return n <= kMaxValence ? entries_[n][j] : compute(j, n);
  }

private:
  static constexpr uint32_t kMaxValence = 12;
  static std::pair<double, double> compute(uint32_t j, uint32_t n) {
    const double angle = 2.0 * std::numbers::pi * j / n;
    return {std::cos(angle), std::sin(angle)};
  }
  std::pair<double, double> entries_[kMaxValence + 1][kMaxValence];
};

DVec3 interior_normal(std::span<const DVec3> ring, const RingTable& table) {
  const auto n = static_cast<uint32_t>(ring.size());
  DVec3 s(0.0), t(0.0);
  for (uint32_t j = 0; j < n; ++j) {
    const auto [cosine, sine] = table(j, n);
    s += cosine * ring[j];
    t += sine * ring[j];
  }
  return glm::cross(s, t);
}

/// Normal at a boundary vertex: s is the tangent along the boundary, t the one into the surface.
DVec3 boundary_normal(std::span<const DVec3> ring) {
  const size_t n = ring.size();
  const DVec3 s = ring[0] - ring[n - 1];
  DVec3 t(0.0);
  if (n == 2) {
    t = ring[0] + ring[1];
  } else if (n == 3) {
    t = ring[1];
  } else if (n == 4) {
    t = 2.0 * (ring[1] + ring[2]) - (ring[0] + ring[3]);
  } else {
    const double angle = std::numbers::pi / static_cast<double>(n - 1);
    for (size_t k = 1; k + 1 < n; ++k) t += std::sin(static_cast<double>(k) * angle) * ring[k];
    t = (2.0 - 2.0 * std::cos(angle)) * t - std::sin(angle) * (ring[0] + ring[n - 1]);
  }
  return glm::cross(s, t);
}

/// Unit normals of the limit surface; zero where its tangents vanish.
std::vector<Vec3> limit_normals(const Level& level) {
  // Start of each vertex's fan: at the boundary, or anywhere for interior vertices.
  std::vector<uint32_t> first(level.points.size(), kNone);
  for (uint32_t h = 0; h < level.half_edge_count(); ++h) {
    uint32_t& f = first[level.start[h]];
    if (f == kNone || level.opposite[h] == kNone) f = h;
  }
  const RingTable table;
  std::vector<Vec3> normals(level.points.size(), Vec3(0.0f));
  std::vector<DVec3> ring; // relative to the vertex, which is valid as the mask weights sum to zero
  for (size_t v = 0; v < normals.size(); ++v) {
    ring.clear();
    uint32_t h = first[v], last = h;
    do {
      ring.push_back(level.points[level.end(h)] - level.points[v]);
      last = h;
      h = level.counter_clockwise(h);
    } while (h != kNone && h != first[v]);
    const bool boundary = h == kNone;
    if (boundary) ring.push_back(level.points[level.start[previous(last)]] - level.points[v]);
    const DVec3 normal = boundary ? boundary_normal(ring) : interior_normal(ring, table);
    const double length = glm::length(normal);
    if (length > 0.0 && std::isfinite(length)) normals[v] = Vec3(normal / length);
  }
  return normals;
}

/// Converts the control mesh to a Level, without triangles that cannot be drawn.
Level control_level(std::span<const Vec3> points, std::span<const Triangle> triangles, const ReportFn& report,
                    uint64_t* dropped_triangles) {
  Mesh mesh;
  mesh.positions.assign(points.begin(), points.end());
  mesh.triangles.assign(triangles.begin(), triangles.end());
  const uint64_t dropped = clean_up_mesh(mesh, report);
  if (dropped_triangles) *dropped_triangles += dropped;
  Level level;
  level.points.assign(mesh.positions.begin(), mesh.positions.end());
  level.start.reserve(mesh.triangles.size() * 3);
  for (const Triangle& t : mesh.triangles) level.start.insert(level.start.end(), {t.x, t.y, t.z});
  const uint64_t apart = join_half_edges(level);
  const uint64_t added = split_fans(level);
  if (apart != 0 && report)
    report(Severity::kWarning, 0,
           std::to_string(apart) + " edges are shared by triangles that are more than two or disagree in orientation: "
                                   "the surface is cut there");
  else if (added != 0 && report)
    report(Severity::kWarning, 0, std::to_string(added) + " points join surfaces that share no edge: split");
  return level;
}

/// Bytes of a level together with the next level or the mesh made from it. Closed surfaces have half as many points as
/// triangles, a single triangle has three.
uint64_t bytes_while_working(uint64_t triangles, uint64_t points) {
  constexpr uint64_t kHalfEdge = 2 * sizeof(uint32_t);
  // Includes the arrays of smooth() and limit_normals().
  constexpr uint64_t kPoint = 2 * sizeof(DVec3) + 2 * sizeof(Vec3) + sizeof(uint32_t) + 1;
  return triangles * (3 * kHalfEdge + sizeof(Triangle)) + points * kPoint;
}

void check_budget(uint64_t triangle_count, uint32_t levels) {
  bool fits = triangle_count <= kMaxSubdividedTriangles;
  for (uint32_t i = 0; fits && i < levels && triangle_count != 0; ++i) {
    triangle_count *= 4;
    fits = triangle_count <= kMaxSubdividedTriangles;
  }
  if (!fits)
    throw Error(ErrorKind::kLimitExceeded, std::to_string(levels) + " levels of subdivision give more than " +
                                               std::to_string(kMaxSubdividedTriangles) + " triangles");
}

} // namespace

Mesh subdivide_loop(std::span<const Vec3> points, std::span<const Triangle> triangles, uint32_t levels,
                    const ReportFn& report, uint64_t* dropped_triangles, const CheckCancelledFn& check_cancelled,
                    MemoryReservation* memory) {
  check_budget(triangles.size(), levels);
  // Each level has four triangles per triangle and one new point per edge; there are at least three edges per two
  // triangles.
  const uint64_t finest = triangles.empty() ? 0 : static_cast<uint64_t>(triangles.size()) << (2 * levels);
  reserve_for_shape(memory, bytes_while_working(finest, finest / 2 + points.size()));
  Level level = control_level(points, triangles, report, dropped_triangles);
  if (level.start.empty()) return {};
  for (uint32_t i = 0; i < levels; ++i) {
    if (check_cancelled) check_cancelled();
    level = subdivide(level);
  }
  Mesh mesh;
  mesh.normals = limit_normals(level);
  level.points = smooth(level, limit_weight, kLimitBoundaryWeight);
  level.opposite = {};
  mesh.positions.assign(level.points.begin(), level.points.end());
  level.points = {};
  mesh.triangles.reserve(level.start.size() / 3);
  for (size_t h = 0; h < level.start.size(); h += 3)
    mesh.triangles.emplace_back(level.start[h], level.start[h + 1], level.start[h + 2]);
  const bool flat_spots = std::find(mesh.normals.begin(), mesh.normals.end(), Vec3(0.0f)) != mesh.normals.end();
  if (flat_spots) clean_up_mesh(mesh, report); // recomputes zero normals
  return mesh;
}

} // namespace packtrace
