#include "compress/bake/lod/cluster_groups.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <numeric>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "compress/bake/clusters/morton.h"

namespace packtrace {
namespace {

constexpr uint32_t kUnassigned = ~0u;
constexpr uint32_t kFewClusters = kGroupTargetClusters / 3; // smaller groups join a neighbour if possible

/// A triangle side on the border of a cluster.
struct BorderEdge {
  uint64_t ends; ///< position numbers: the higher one + 2^32 x the lower one
  uint32_t cluster;
  bool operator<(const BorderEdge& o) const { return ends != o.ends ? ends < o.ends : cluster < o.cluster; }
};

uint32_t begin_of(std::span<const uint32_t> ends, uint32_t i) { return i == 0 ? 0 : ends[i - 1]; }

constexpr uint32_t kBatch = 64; // clusters per task

/// Calls visit(first, end) for ranges of clusters, in parallel.
template <typename Visit>
void for_each_batch(const ClusterRuns& clusters, const Visit& visit) {
  const auto count = static_cast<uint32_t>(clusters.ends.size());
  tbb::parallel_for(0u, (count + kBatch - 1) / kBatch,
                    [&](uint32_t batch) { visit(batch * kBatch, std::min(count, (batch + 1) * kBatch)); });
}

/// Returns, per position, 1 if several clusters use it.
std::vector<uint8_t> find_shared(const ClusterRuns& clusters) {
  uint32_t last = 0;
  for (const Triangle& t : clusters.points) last = std::max({last, t.x, t.y, t.z});
  std::vector<uint32_t> owner(size_t{last} + 1, kUnassigned);
  std::vector<uint8_t> shared(owner.size());
  for_each_batch(clusters, [&](uint32_t first, uint32_t end) {
    for (uint32_t cluster = first; cluster < end; ++cluster)
      for (uint32_t i = begin_of(clusters.ends, cluster); i < clusters.ends[cluster]; ++i)
        for (int k = 0; k < 3; ++k) {
          const uint32_t position = clusters.points[i][k];
          std::atomic_ref<uint32_t> known(owner[position]);
          uint32_t expected = known.load(std::memory_order_relaxed);
          if (expected == kUnassigned) known.compare_exchange_strong(expected, cluster, std::memory_order_relaxed);
          if (expected != cluster && expected != kUnassigned)
            std::atomic_ref<uint8_t>(shared[position]).store(1, std::memory_order_relaxed);
        }
  });
  return shared;
}

/// Finds the border edges of clusters that other clusters may share, one cluster per append().
class BorderFinder {
public:
  /// @param shared from find_shared()
  BorderFinder(const ClusterRuns& clusters, const std::vector<uint8_t>& shared)
      : clusters_(clusters), shared_(shared) {}

  void append(uint32_t cluster, std::vector<BorderEdge>& out) {
    const uint32_t begin = begin_of(clusters_.ends, cluster), end = clusters_.ends[cluster];
    const size_t room = std::bit_ceil(6 * size_t{end - begin} + 2); // for all sides, if each is shared
    if (slots_.size() < room) slots_.assign(room, {});
    found_.clear();
    for (uint32_t i = begin; i < end; ++i) {
      const Triangle& t = clusters_.points[i];
      if (shared_[t.x] + shared_[t.y] + shared_[t.z] < 2) continue;
      for (int k = 0; k < 3; ++k)
        if (const uint32_t p = t[k], q = t[k == 2 ? 0 : k + 1]; shared_[p] + shared_[q] == 2) add(p, q, cluster);
    }
    for (const uint32_t slot : found_)
      if (const Edge& e = slots_[slot]; e.once) out.push_back({uint64_t{e.a} << 32 | e.b, cluster});
  }

private:
  struct Edge {
    uint32_t a = 0, b = 0, cluster = kUnassigned; ///< slots of other clusters count as empty
    bool once = true;
  };

  void add(uint32_t p, uint32_t q, uint32_t cluster) {
    if (p == q) return;
    const uint32_t a = std::min(p, q), b = std::max(p, q);
    const size_t mask = slots_.size() - 1;
    size_t slot = ((a * uint64_t{0x9e3779b97f4a7c15u}) ^ (b * uint64_t{0xd6e8feb86659fd93u})) >> 32 & mask;
    while (slots_[slot].cluster == cluster && (slots_[slot].a != a || slots_[slot].b != b)) slot = (slot + 1) & mask;
    if (slots_[slot].cluster == cluster) {
      slots_[slot].once = false;
    } else {
      slots_[slot] = {a, b, cluster, true};
      found_.push_back(static_cast<uint32_t>(slot));
    }
  }

  const ClusterRuns& clusters_;
  const std::vector<uint8_t>& shared_;
  std::vector<Edge> slots_;
  std::vector<uint32_t> found_; ///< slots of the current cluster
};

std::vector<BorderEdge> border_edges(const ClusterRuns& clusters) {
  const std::vector<uint8_t> shared = find_shared(clusters);
  std::vector<std::vector<BorderEdge>> found((clusters.ends.size() + kBatch - 1) / kBatch);
  for_each_batch(clusters, [&](uint32_t first, uint32_t end) {
    BorderFinder finder(clusters, shared);
    for (uint32_t i = first; i < end; ++i) finder.append(i, found[first / kBatch]);
  });
  std::vector<BorderEdge> edges;
  for (const auto& part : found) edges.insert(edges.end(), part.begin(), part.end());
  tbb::parallel_sort(edges.begin(), edges.end());
  return edges;
}

/// The neighbours of each cluster, with the number of common edges.
struct Adjacency {
  struct Link {
    uint32_t cluster, edges;
  };
  std::vector<uint32_t> first; ///< per cluster: index of its first link; plus an end marker
  std::vector<Link> links;
  std::span<const Link> of(uint32_t cluster) const {
    return std::span(links).subspan(first[cluster], first[cluster + 1] - first[cluster]);
  }
};

Adjacency find_adjacency(const ClusterRuns& clusters) {
  constexpr size_t kMaxClustersPerEdge = 8; // of edges with more clusters, only the first ones are linked
  const std::vector<BorderEdge> edges = border_edges(clusters);
  std::vector<uint64_t> pairs; // the second cluster + 2^32 x the first one
  for (size_t i = 0, next; i < edges.size(); i = next) {
    for (next = i + 1; next < edges.size() && edges[next].ends == edges[i].ends;) ++next;
    const size_t end = std::min(next, i + kMaxClustersPerEdge);
    for (size_t k = i; k < end; ++k)
      for (size_t l = i; l < end; ++l)
        if (l != k) pairs.push_back(uint64_t{edges[k].cluster} << 32 | edges[l].cluster);
  }
  tbb::parallel_sort(pairs.begin(), pairs.end());
  Adjacency result;
  result.first.assign(clusters.ends.size() + 1, 0);
  for (size_t i = 0, next; i < pairs.size(); i = next) {
    for (next = i + 1; next < pairs.size() && pairs[next] == pairs[i];) ++next;
    result.links.push_back({static_cast<uint32_t>(pairs[i]), static_cast<uint32_t>(next - i)});
    ++result.first[(pairs[i] >> 32) + 1];
  }
  std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
  return result;
}

std::vector<uint32_t> spatial_order(std::span<const DVec3> centers) {
  DVec3 lo(0.0), hi(0.0);
  for (size_t i = 0; i < centers.size(); ++i) {
    lo = i == 0 ? centers[i] : glm::min(lo, centers[i]);
    hi = i == 0 ? centers[i] : glm::max(hi, centers[i]);
  }
  const double extent = std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z});
  const double scale = extent > 0.0 ? static_cast<double>((1u << kMortonBits) - 1) / extent : 0.0;
  std::vector<std::pair<uint64_t, uint32_t>> keys(centers.size());
  for (uint32_t i = 0; i < keys.size(); ++i) {
    const DVec3 p = (centers[i] - lo) * scale;
    keys[i] = {morton_code(static_cast<uint64_t>(p.x), static_cast<uint64_t>(p.y), static_cast<uint64_t>(p.z)), i};
  }
  tbb::parallel_sort(keys.begin(), keys.end());
  std::vector<uint32_t> order(keys.size());
  for (size_t i = 0; i < keys.size(); ++i) order[i] = keys[i].second;
  return order;
}

/// Grows groups one by one from clusters in Morton order, always adding the best neighbour.
class Grouper {
public:
  explicit Grouper(const ClusterRuns& clusters)
      : adjacency_(find_adjacency(clusters)), order_(spatial_order(clusters.centers)),
        group_of_(clusters.ends.size(), kUnassigned), weight_(clusters.ends.size(), 0) {
    total_.reserve(group_of_.size());
    for (uint32_t i = 0; i < group_of_.size(); ++i) {
      uint32_t sum = 0;
      for (const auto& link : adjacency_.of(i)) sum += link.edges;
      total_.push_back(sum);
    }
  }

  std::vector<uint32_t> run() {
    for (;;) {
      skip_taken();
      if (cursor_ == order_.size()) break;
      grow();
    }
    return number_groups();
  }

private:
  void skip_taken() {
    while (cursor_ < order_.size() && group_of_[order_[cursor_]] != kUnassigned) ++cursor_;
  }

  void grow() {
    const auto group = static_cast<uint32_t>(sizes_.size());
    sizes_.push_back(0);
    members_.clear(), frontier_.clear();
    take(order_[cursor_], group);
    while (sizes_[group] < kGroupTargetClusters) {
      uint32_t next = pick();
      if (next == kUnassigned) {
        if (sizes_[group] >= kFewClusters && !isolated()) break;
        skip_taken();
        if (cursor_ == order_.size()) break;
        next = order_[cursor_];
      }
      take(next, group);
    }
    for (const uint32_t cluster : frontier_) weight_[cluster] = 0;
    if (sizes_[group] < kFewClusters) join_neighbour(group);
  }

  /// Whether no member has a neighbour outside the group. Then the group can continue at any free cluster.
  bool isolated() const {
    return std::all_of(members_.begin(), members_.end(), [&](uint32_t cluster) {
      const auto links = adjacency_.of(cluster);
      return std::all_of(links.begin(), links.end(),
                         [&](const auto& link) { return group_of_[link.cluster] == group_of_[cluster]; });
    });
  }

  void take(uint32_t cluster, uint32_t group) {
    group_of_[cluster] = group;
    ++sizes_[group];
    members_.push_back(cluster);
    for (const auto& link : adjacency_.of(cluster)) {
      if (group_of_[link.cluster] != kUnassigned) continue;
      if (weight_[link.cluster] == 0) frontier_.push_back(link.cluster);
      weight_[link.cluster] += link.edges;
    }
  }

  /// The frontier cluster with the largest share of its border in the group.
  uint32_t pick() {
    uint32_t best = kUnassigned;
    double best_share = -1.0;
    size_t kept = 0;
    for (const uint32_t cluster : frontier_) {
      if (group_of_[cluster] != kUnassigned) {
        weight_[cluster] = 0;
        continue;
      }
      frontier_[kept++] = cluster;
      const double share = static_cast<double>(weight_[cluster]) / total_[cluster];
      if (share > best_share) best = cluster, best_share = share;
    }
    frontier_.resize(kept);
    return best;
  }

  /// Merges a small group into the one with the longest common border, among those with room.
  void join_neighbour(uint32_t group) {
    std::vector<std::pair<uint32_t, uint32_t>> shared; // group, edges
    for (const uint32_t cluster : members_)
      for (const auto& link : adjacency_.of(cluster)) {
        const uint32_t other = group_of_[link.cluster];
        if (other == group || other == kUnassigned || sizes_[other] + sizes_[group] > kMaxGroupClusters) continue;
        const auto found = std::find_if(shared.begin(), shared.end(), [&](const auto& s) { return s.first == other; });
        if (found == shared.end())
          shared.emplace_back(other, link.edges);
        else
          found->second += link.edges;
      }
    if (shared.empty()) return;
    const uint32_t into = std::max_element(shared.begin(), shared.end(), [](const auto& a, const auto& b) {
                            return a.second < b.second;
                          })->first;
    for (const uint32_t cluster : members_) group_of_[cluster] = into;
    sizes_[into] += sizes_[group];
    sizes_[group] = 0;
  }

  std::vector<uint32_t> number_groups() {
    std::vector<uint32_t> number(sizes_.size());
    uint32_t count = 0;
    for (size_t i = 0; i < sizes_.size(); ++i) number[i] = sizes_[i] > 0 ? count++ : kUnassigned;
    for (uint32_t& group : group_of_) group = number[group];
    return std::move(group_of_);
  }

  Adjacency adjacency_;
  std::vector<uint32_t> order_, group_of_, weight_, total_, sizes_;
  std::vector<uint32_t> members_, frontier_; // of the growing group
  size_t cursor_ = 0;
};

} // namespace

std::vector<uint32_t> group_clusters(const ClusterRuns& clusters) { return Grouper(clusters).run(); }

} // namespace packtrace
