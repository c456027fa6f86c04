#include "compress/bake/clusters/clusterize.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "compress/format/cluster/index_codec.h"

namespace packtrace {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr uint32_t kWellFilled = kMaxClusterTriangles * 9 / 10;

/// Finds up to three neighbours per triangle, one across each edge. Each edge has at most one partner.
std::vector<std::array<uint32_t, 3>> find_neighbours(std::span<const Triangle> points, uint32_t point_count) {
  struct Edge {
    uint32_t high, next; ///< the higher point of the edge; the previous edge with the same lower point
    uint32_t open;       ///< the triangle side without a partner yet
  };
  std::vector<std::array<uint32_t, 3>> neighbours(points.size(), {kNone, kNone, kNone});
  std::vector<Edge> edges;
  edges.reserve(2 * points.size());
  std::vector<uint32_t> first(point_count, kNone);
  for (uint32_t t = 0; t < points.size(); ++t)
    for (uint32_t i = 0; i < 3; ++i) {
      const uint32_t p = points[t][static_cast<int>(i)], q = points[t][i == 2 ? 0 : static_cast<int>(i + 1)];
      if (p == q) continue;
      const uint32_t low = std::min(p, q), high = std::max(p, q), side = 4 * t + i;
      uint32_t found = first[low];
      while (found != kNone && edges[found].high != high) found = edges[found].next;
      if (found == kNone) {
        edges.push_back({high, std::exchange(first[low], static_cast<uint32_t>(edges.size())), side});
      } else if (uint32_t& open = edges[found].open; open == kNone) {
        open = side;
      } else {
        neighbours[t][i] = open / 4;
        neighbours[open / 4][open % 4] = t;
        open = kNone;
      }
    }
  return neighbours;
}

/// The triangles that a cluster may take next, as a structure of arrays because each step scans all of them.
class Frontier {
public:
  uint32_t size() const { return count_; }
  uint32_t triangle(uint32_t place) const { return triangle_[place]; }
  uint32_t added(uint32_t place) const { return added_[place]; }
  void clear() { count_ = 0; }

  /// @param added number of vertices that would be new to the cluster
  /// @param open number of neighbours without a cluster
  void add(uint32_t triangle, const Triangle& vertices, const DVec3& centroid, uint32_t added, uint32_t open) {
    const uint32_t place = count_++;
    triangle_[place] = triangle, added_[place] = added, open_[place] = open;
    for (size_t i = 0; i < 3; ++i)
      vertices_[i][place] = vertices[static_cast<int>(i)], centroid_[i][place] = centroid[static_cast<int>(i)];
    weigh(place);
  }

  /// Closes the gap and keeps the order, so that of equal scores the earliest triangle wins.
  void remove(uint32_t place) {
    --count_;
    for (uint32_t i = place; i < count_; ++i) {
      triangle_[i] = triangle_[i + 1], added_[i] = added_[i + 1], open_[i] = open_[i + 1];
      for (auto& vertex : vertices_) vertex[i] = vertex[i + 1];
      for (auto& coordinate : centroid_) coordinate[i] = coordinate[i + 1];
      weight_[i] = weight_[i + 1];
    }
  }

  void set_open(uint32_t place, uint32_t open) {
    open_[place] = open;
    if (open == 0) weigh(place);
  }

  /// Called when the cluster gets a vertex.
  void have(uint32_t vertex) {
    for (uint32_t i = 0; i < count_; ++i)
      if (vertices_[0][i] == vertex || vertices_[1][i] == vertex || vertices_[2][i] == vertex) --added_[i], weigh(i);
  }

  double score(uint32_t place, const DVec3& centre) const {
    const DVec3 d = DVec3(centroid_[0][place], centroid_[1][place], centroid_[2][place]) - centre;
    return glm::dot(d, d) * weight_[place];
  }

  /// Returns the place with the lowest score, the first of several. The frontier must not be empty.
  uint32_t best(const DVec3& centre) {
    using Lanes = double __attribute__((vector_size(16)));
    using Places = int64_t __attribute__((vector_size(16)));
    if (count_ % 2 != 0) weight_[count_] = std::numeric_limits<double>::infinity(), centroid_[0][count_] = centre.x + 1;
    Lanes best = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    Places at = {}, place = {0, 1};
    const auto load = [](const double* from) { return *reinterpret_cast<const Lanes*>(from); };
    for (uint32_t i = 0; i < count_; i += 2) {
      const Lanes x = load(&centroid_[0][i]) - centre.x, y = load(&centroid_[1][i]) - centre.y,
                  z = load(&centroid_[2][i]) - centre.z;
      const Lanes score = (x * x + y * y + z * z) * load(&weight_[i]);
      const Places less = score < best;
      best = less ? score : best;
      at = less ? place : at;
      place += 2;
    }
    const bool second = best[1] < best[0] || (best[1] == best[0] && at[1] < at[0]);
    return static_cast<uint32_t>(second ? at[1] : at[0]);
  }

private:
  static constexpr size_t kMax = 3 * kMaxClusterTriangles + 2; ///< each triangle adds up to three

  /// Prefers triangles that add no vertex, and those without a free neighbour, which would otherwise become isolated
  /// pieces of other clusters.
  void weigh(uint32_t place) {
    weight_[place] = (1.0 + added_[place]) * (added_[place] == 0 || open_[place] == 0 ? 0.125 : 1.0);
  }

  uint32_t count_ = 0;
  std::array<uint32_t, kMax> triangle_, added_, open_;
  std::array<std::array<uint32_t, kMax>, 3> vertices_;
  alignas(16) std::array<std::array<double, kMax>, 3> centroid_;
  alignas(16) std::array<double, kMax> weight_; ///< factor of the squared distance
};

class Grower {
public:
  explicit Grower(const ClusterizeInput& input)
      : input_(input), neighbours_(find_neighbours(input.points, input.point_count)), taken_(input.vertices.size()),
        place_(input.vertices.size(), kNone), vertex_in_(input.vertex_count, kNone) {
    result_.order.reserve(input.vertices.size());
  }

  Clusters run() {
    const auto count = static_cast<uint32_t>(taken_.size());
    for (;; ++cluster_) {
      while (cursor_ < count && taken_[cursor_]) ++cursor_;
      if (cursor_ == count) return std::move(result_);
      grow();
      result_.ends.push_back(static_cast<uint32_t>(result_.order.size()));
    }
  }

private:
  void grow() {
    size_ = 0, vertices_ = 0;
    sum_ = DVec3(0.0);
    take(cursor_);
    while (size_ < kMaxClusterTriangles) {
      uint32_t next = pick();
      if (next == kNone) {
        if (size_ >= kWellFilled) break;
        while (cursor_ < taken_.size() && taken_[cursor_]) ++cursor_;
        if (cursor_ == taken_.size() || vertices_ + new_vertices(cursor_) > kMaxClusterVertices) break;
        next = cursor_;
      }
      take(next);
    }
    for (uint32_t i = 0; i < frontier_.size(); ++i) place_[frontier_.triangle(i)] = kNone;
    frontier_.clear();
  }

  uint32_t new_vertices(uint32_t triangle) const {
    const Triangle& t = input_.vertices[triangle];
    return static_cast<uint32_t>(vertex_in_[t.x] != cluster_) +
           static_cast<uint32_t>(vertex_in_[t.y] != cluster_ && t.y != t.x) +
           static_cast<uint32_t>(vertex_in_[t.z] != cluster_ && t.z != t.x && t.z != t.y);
  }

  void take(uint32_t triangle) {
    if (const uint32_t place = place_[triangle]; place != kNone) {
      frontier_.remove(place);
      for (uint32_t i = place; i < frontier_.size(); ++i) place_[frontier_.triangle(i)] = i;
      place_[triangle] = kNone;
    }
    taken_[triangle] = 1;
    result_.order.push_back(triangle);
    for (int i = 0; i < 3; ++i) {
      const uint32_t vertex = input_.vertices[triangle][i];
      if (vertex_in_[vertex] == cluster_) continue;
      vertex_in_[vertex] = cluster_, ++vertices_;
      frontier_.have(vertex);
    }
    sum_ += input_.centroids[triangle];
    ++size_;
    for (const uint32_t n : neighbours_[triangle])
      if (n != kNone && !taken_[n]) see(n);
  }

  /// Adds or updates a neighbour of the triangle that was just taken.
  void see(uint32_t triangle) {
    uint32_t open = 0;
    for (const uint32_t n : neighbours_[triangle]) open += n != kNone && !taken_[n];
    if (place_[triangle] != kNone) return frontier_.set_open(place_[triangle], open);
    place_[triangle] = frontier_.size();
    frontier_.add(triangle, input_.vertices[triangle], input_.centroids[triangle], new_vertices(triangle), open);
  }

  /// Returns the best triangle of the frontier, or kNone if none fits.
  uint32_t pick() {
    if (frontier_.size() == 0) return kNone;
    const DVec3 centre = sum_ / static_cast<double>(size_);
    if (vertices_ + 3 <= kMaxClusterVertices) return frontier_.triangle(frontier_.best(centre));
    uint32_t best = kNone;
    double best_score = 0.0;
    for (uint32_t i = 0; i < frontier_.size(); ++i) {
      if (vertices_ + frontier_.added(i) > kMaxClusterVertices) continue;
      const double score = frontier_.score(i, centre);
      if (best == kNone || score < best_score) best = frontier_.triangle(i), best_score = score;
    }
    return best;
  }

  const ClusterizeInput& input_;
  std::vector<std::array<uint32_t, 3>> neighbours_;
  std::vector<uint8_t> taken_;
  std::vector<uint32_t> place_;     ///< per triangle: place in the frontier, or kNone
  std::vector<uint32_t> vertex_in_; ///< per vertex: the last cluster that contains it
  Frontier frontier_;
  uint32_t cluster_ = 0, cursor_ = 0, size_ = 0, vertices_ = 0;
  DVec3 sum_{0.0};
  Clusters result_;
};

} // namespace

Clusters clusterize(const ClusterizeInput& input) { return Grower(input).run(); }

} // namespace packtrace
