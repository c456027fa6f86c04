#include "compress/format/trees/tree_topology.h"

#include <algorithm>
#include <atomic>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "compress/format/trees/leaf_restorer.h"
#include "compress/format/trees/tree_validation.h"

namespace packtrace {
namespace {

constexpr uint8_t kInner = 128;

uint32_t zigzag(uint32_t difference) { return (difference << 1) ^ (0u - (difference >> 31)); }
uint32_t unzigzag(uint32_t value) { return (value >> 1) ^ (0u - (value & 1u)); }

uint32_t used_slots(const baked::PackedNode& node) {
  uint32_t used = 0;
  while (used < baked::kNodeWidth && node.children[used] != baked::kNoChild) ++used;
  return used;
}

/// Reads the parts of a topology. Their sizes follow from the first part.
class TopologyReader {
public:
  TopologyReader(std::span<const uint8_t> bytes, size_t node_count) : bytes_(bytes) {
    if (bytes.size() < node_count) return;
    size_t leaves = 0;
    for (const uint8_t kind : bytes.first(node_count)) {
      leaf_nodes_ += kind < kInner;
      leaves += kind < kInner ? kind : 0;
    }
    size_at_ = node_count, first_at_ = size_at_ + leaves, cluster_at_ = first_at_ + leaf_nodes_;
    valid_ = bytes.size() - node_count == leaves + 5 * leaf_nodes_;
  }
  bool valid() const { return valid_; }
  uint8_t kind(size_t node) const { return bytes_[node]; }

  /// Reads the next leaf node, which has `count` leaves.
  LeafNode next_leaves(uint32_t count, uint32_t& cluster) {
    LeafNode leaves{bytes_[first_at_ + read_], count, {}};
    for (uint32_t i = 0; i < count; ++i) leaves.triangles[i] = bytes_[size_at_++];
    uint32_t difference = 0;
    for (uint32_t plane = 0; plane < 4; ++plane)
      difference |= uint32_t{bytes_[cluster_at_ + plane * leaf_nodes_ + read_]} << (8 * plane);
    ++read_;
    cluster = cluster_ += unzigzag(difference);
    return leaves;
  }

private:
  std::span<const uint8_t> bytes_;
  size_t leaf_nodes_ = 0, size_at_ = 0, first_at_ = 0, cluster_at_ = 0, read_ = 0;
  uint32_t cluster_ = 0;
  bool valid_ = false;
};

class Restorer {
public:
  Restorer(const BakedSections& sections, std::span<const uint8_t> topology, std::span<baked::PackedNode> nodes)
      : s_(sections), topology_(topology), nodes_(nodes), boxes_(nodes.size()) {}

  bool run() {
    // find_tree_record_fault() checks their number.
    s_.nodes = nodes_;
    if (nodes_.size() > std::numeric_limits<uint32_t>::max()) return false; // files store such trees whole
    if (!clusters_ok() || find_tree_record_fault(s_, members_)) return false;
    TopologyReader reader(topology_, nodes_.size());
    if (!reader.valid()) return false;
    for (uint32_t i = 0; i < s_.trees.size(); ++i)
      if (!place_nodes(reader, i)) return false;
    make_leaf_nodes();
    make_inner_nodes();
    return true;
  }

private:
  /// A leaf node to restore.
  struct Pending {
    uint32_t cluster;
    size_t node;
    LeafNode leaves;
  };

  bool clusters_ok() const {
    std::atomic<bool> good{true};
    tbb::parallel_for(size_t{0}, s_.geometries.size(), [&](size_t i) {
      const baked::GeometryRecord& g = s_.geometries[i];
      tbb::parallel_for(uint32_t{0}, g.cluster_count, [&](uint32_t c) {
        if (find_cluster_fault(g, s_.clusters[static_cast<size_t>(g.first_cluster) + c],
                               s_.payload.data() + g.payload_offset, g.payload_bytes))
          good = false;
      });
    });
    return good;
  }

  bool place_nodes(TopologyReader& reader, uint32_t number) {
    const baked::TreeRecord& tree = s_.trees[number];
    const auto begin = static_cast<size_t>(tree.first_node);
    uint32_t placed = tree.node_count > 0 ? 1 : 0;
    std::vector<uint32_t> waiting(placed, 0);
    while (!waiting.empty()) {
      const uint32_t node = waiting.back();
      waiting.pop_back();
      const uint8_t kind = reader.kind(begin + node);
      const uint32_t count = kind & (kInner - 1u);
      if (count == 0 || count > baked::kNodeWidth) return false;
      if (kind < kInner) {
        Pending pending{0, begin + node, reader.next_leaves(count, pending.cluster)};
        if (!leaves_ok(pending, number)) return false;
        pending_.push_back(pending);
        continue;
      }
      if (count > tree.node_count - placed) return false;
      nodes_[begin + node].first_child = placed;
      for (uint32_t child = count; child-- > 0;) waiting.push_back(placed + child);
      placed += count;
    }
    return placed == tree.node_count;
  }

  bool leaves_ok(const Pending& pending, uint32_t tree) const {
    if (pending.cluster >= s_.clusters.size() || members_.tree_of[pending.cluster] != tree) return false;
    uint32_t end = pending.leaves.first_triangle;
    for (uint32_t i = 0; i < pending.leaves.leaf_count; ++i) {
      if (pending.leaves.triangles[i] == 0) return false;
      end += pending.leaves.triangles[i];
    }
    return end <= s_.clusters[pending.cluster].triangle_count;
  }

  /// Restores leaf nodes cluster by cluster, so that each cluster is decoded once.
  void make_leaf_nodes() {
    std::vector<uint32_t> ends(s_.clusters.size() + 1, 0); // by cluster: end of its nodes in `order`
    for (const Pending& one : pending_) ++ends[one.cluster + 1];
    for (size_t c = 1; c < ends.size(); ++c) ends[c] += ends[c - 1];
    std::vector<uint32_t> order(pending_.size());
    for (uint32_t i = 0; i < pending_.size(); ++i) order[ends[pending_[i].cluster]++] = i;
    constexpr size_t kGrain = 32;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, s_.clusters.size(), kGrain), [&](const auto& range) {
      LeafRestorer restorer;
      for (size_t c = range.begin(); c < range.end(); ++c)
        if (const uint32_t begin = c == 0 ? 0 : ends[c - 1]; begin < ends[c])
          make_leaf_nodes(restorer, static_cast<uint32_t>(c), std::span(order).subspan(begin, ends[c] - begin));
    });
  }

  void make_leaf_nodes(LeafRestorer& restorer, uint32_t cluster, std::span<const uint32_t> numbers) {
    const auto geometry = std::upper_bound(
        s_.geometries.begin(), s_.geometries.end(), cluster,
        [](uint64_t number, const baked::GeometryRecord& g) { return number < g.first_cluster + g.cluster_count; });
    restorer.begin(*geometry, s_.trees[members_.tree_of[cluster]],
                   {*geometry, s_.clusters[cluster], s_.payload.data() + geometry->payload_offset});
    for (const uint32_t number : numbers) {
      const Pending& one = pending_[number];
      boxes_[one.node] = restorer.write(one.leaves, cluster, members_.ray_classes[cluster], nodes_[one.node]);
    }
  }

  /// From the last node to the first, because children lie behind their parents.
  void make_inner_nodes() {
    const node_kernels::Kernels& kernels = node_kernels::kernels();
    for (const baked::TreeRecord& tree : s_.trees) {
      const auto begin = static_cast<size_t>(tree.first_node);
      const std::span<baked::PackedNode> nodes = nodes_.subspan(begin, tree.node_count);
      const std::span<node_kernels::Box> boxes = std::span(boxes_).subspan(begin, tree.node_count);
      for (size_t i = nodes.size(); i-- > 0;) {
        const uint8_t kind = topology_[begin + i];
        if (kind < kInner) continue;
        const uint32_t first = nodes[i].first_child, count = kind - kInner;
        boxes[i] =
            restore_inner_node(kernels, first, nodes.subspan(first, count), boxes.subspan(first, count), nodes[i]);
      }
    }
  }

  BakedSections s_;
  std::span<const uint8_t> topology_;
  std::span<baked::PackedNode> nodes_;
  std::vector<node_kernels::Box> boxes_; // by node: box of its subtree
  TreeMembers members_;
  std::vector<Pending> pending_;
};

} // namespace

std::vector<uint8_t> pack_tree_topology(const BakedSections& sections) {
  std::vector<uint8_t> kinds, sizes, firsts;
  std::vector<uint32_t> differences;
  uint32_t cluster = 0;
  for (const baked::TreeRecord& tree : sections.trees) {
    const auto nodes = sections.nodes.subspan(static_cast<size_t>(tree.first_node), tree.node_count);
    for (const baked::PackedNode& node : nodes)
      kinds.push_back(static_cast<uint8_t>(used_slots(node) + (node.has_leaves() ? 0 : kInner)));
    std::vector<uint32_t> waiting(nodes.empty() ? 0 : 1, 0);
    while (!waiting.empty()) { // in the order in which restore_nodes() visits nodes
      const baked::PackedNode& node = nodes[waiting.back()];
      waiting.pop_back();
      const uint32_t used = used_slots(node);
      if (!node.has_leaves()) {
        for (uint32_t child = used; child-- > 0;) waiting.push_back(node.first_child + child);
        continue;
      }
      sizes.insert(sizes.end(), node.children.begin(), node.children.begin() + used);
      firsts.push_back(node.first_triangle);
      differences.push_back(zigzag(node.cluster - cluster));
      cluster = node.cluster;
    }
  }
  std::vector<uint8_t> out = std::move(kinds);
  out.insert(out.end(), sizes.begin(), sizes.end());
  out.insert(out.end(), firsts.begin(), firsts.end());
  for (uint32_t plane = 0; plane < 4; ++plane)
    for (const uint32_t difference : differences) out.push_back(static_cast<uint8_t>(difference >> (8 * plane)));
  return out;
}

bool restore_nodes(const BakedSections& sections, std::span<const uint8_t> topology,
                   std::span<baked::PackedNode> nodes) {
  return Restorer(sections, topology, nodes).run();
}

} // namespace packtrace
