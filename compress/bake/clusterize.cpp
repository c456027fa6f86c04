#include "compress/bake/clusterize.h"

#include <algorithm>
#include <array>

#include "compress/bake/weld_table.h"
#include "compress/format/index_codec.h"

namespace packtrace {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr uint32_t kWellFilled = kMaxClusterTriangles * 9 / 10;

/// Up to three triangles across each triangle's edges; an edge has at most one partner.
std::vector<std::array<uint32_t, 3>> find_neighbours(std::span<const Triangle> points) {
  std::vector<std::array<uint32_t, 3>> neighbours(points.size(), {kNone, kNone, kNone});
  std::vector<uint32_t> open(3 * points.size()); // edge number -> the half edge that waits for a partner
  std::vector<uint64_t> keys;
  keys.reserve(open.size());
  WeldTable edges(open.size());
  for (uint32_t half = 0; half < open.size(); ++half) {
    const Triangle& t = points[half / 3];
    const uint32_t a = t[static_cast<int>(half % 3)], b = t[static_cast<int>((half + 1) % 3)];
    if (a == b) continue;
    const uint64_t key = (uint64_t{std::min(a, b)} << 32) | std::max(a, b);
    const auto next = static_cast<uint32_t>(keys.size());
    const uint32_t edge =
        edges.find_or_add(mix_words(key, 0), next, [&](uint32_t other) { return keys[other] == key; });
    if (edge == next) keys.push_back(key), open[edge] = kNone;
    if (open[edge] == kNone) {
      open[edge] = half;
    } else {
      neighbours[half / 3][half % 3] = open[edge] / 3;
      neighbours[open[edge] / 3][open[edge] % 3] = half / 3;
      open[edge] = kNone;
    }
  }
  return neighbours;
}

class Grower {
public:
  explicit Grower(const ClusterizeInput& input)
      : input_(input), neighbours_(find_neighbours(input.points)), taken_(input.vertices.size()),
        waits_in_(input.vertices.size(), kNone), vertex_in_(input.vertex_count, kNone) {
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
    frontier_.clear();
    size_ = 0, vertices_ = 0;
    sum_ = DVec3(0.0);
    take(cursor_);
    while (size_ < kMaxClusterTriangles) {
      uint32_t next = pick();
      if (next == kNone) {
        if (size_ >= kWellFilled) return;
        while (cursor_ < taken_.size() && taken_[cursor_]) ++cursor_;
        if (cursor_ == taken_.size() || vertices_ + new_vertices(cursor_) > kMaxClusterVertices) return;
        next = cursor_;
      }
      take(next);
    }
  }

  uint32_t new_vertices(uint32_t triangle) const {
    const Triangle& t = input_.vertices[triangle];
    return static_cast<uint32_t>(vertex_in_[t.x] != cluster_) +
           static_cast<uint32_t>(vertex_in_[t.y] != cluster_ && t.y != t.x) +
           static_cast<uint32_t>(vertex_in_[t.z] != cluster_ && t.z != t.x && t.z != t.y);
  }

  void take(uint32_t triangle) {
    taken_[triangle] = 1;
    result_.order.push_back(triangle);
    vertices_ += new_vertices(triangle);
    const Triangle& t = input_.vertices[triangle];
    vertex_in_[t.x] = vertex_in_[t.y] = vertex_in_[t.z] = cluster_;
    sum_ += input_.centroids[triangle];
    ++size_;
    for (const uint32_t n : neighbours_[triangle])
      if (n != kNone && !taken_[n] && waits_in_[n] != cluster_) {
        waits_in_[n] = cluster_;
        frontier_.push_back(n);
      }
  }

  /// Whether every neighbour is taken or about to be: left behind it would become a cluster's lone piece.
  bool enclosed(uint32_t triangle) const {
    for (const uint32_t n : neighbours_[triangle])
      if (n != kNone && !taken_[n]) return false;
    return true;
  }

  /// The best triangle of the frontier, or kNone. Drops those taken since they were added.
  uint32_t pick() {
    const DVec3 centre = sum_ / static_cast<double>(size_);
    uint32_t best = kNone;
    double best_score = 0.0;
    size_t kept = 0;
    for (size_t i = 0; i < frontier_.size(); ++i) {
      const uint32_t triangle = frontier_[i];
      if (taken_[triangle]) continue;
      frontier_[kept++] = triangle;
      const uint32_t added = new_vertices(triangle);
      if (vertices_ + added > kMaxClusterVertices) continue;
      const DVec3 d = input_.centroids[triangle] - centre;
      double score = glm::dot(d, d) * (1.0 + added);
      if (added == 0 || enclosed(triangle)) score *= 0.125;
      if (best == kNone || score < best_score) best = triangle, best_score = score;
    }
    frontier_.resize(kept);
    return best;
  }

  const ClusterizeInput& input_;
  std::vector<std::array<uint32_t, 3>> neighbours_;
  std::vector<uint8_t> taken_;
  std::vector<uint32_t> waits_in_, vertex_in_; // last cluster whose frontier, or vertices, it was in
  std::vector<uint32_t> frontier_;
  uint32_t cluster_ = 0, cursor_ = 0, size_ = 0, vertices_ = 0;
  DVec3 sum_{0.0};
  Clusters result_;
};

} // namespace

Clusters clusterize(const ClusterizeInput& input) { return Grower(input).run(); }

} // namespace packtrace
