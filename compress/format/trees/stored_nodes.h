#pragma once

#include <optional>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/layout/packed_node.h"

namespace packtrace {

/// Which nodes with leaves the trees of a file have for each cluster. Empty for a file without trees, or of 2^32 nodes.
class StoredLeafNodes {
public:
  /// @param sections of a valid file; must outlive it
  explicit StoredLeafNodes(const BakedSections& sections);

  bool empty() const { return nodes_.empty(); }
  /// Numbers in the node section, in the order of the cluster's stream. None where no ray sees the cluster.
  /// @param cluster in the cluster section
  std::span<const uint32_t> of_cluster(uint32_t cluster) const;
  /// The tree that has them.
  uint32_t tree_of_cluster(uint32_t cluster) const { return tree_of_[cluster]; }
  /// How many nodes with leaves a tree has.
  uint64_t count_of_tree(uint32_t tree) const { return of_tree_[tree]; }

private:
  std::vector<uint32_t> first_;   ///< by cluster and one more: of nodes_
  std::vector<uint32_t> nodes_;   ///< by cluster
  std::vector<uint32_t> tree_of_; ///< by cluster; baked::kNone
  std::vector<uint64_t> of_tree_;
};

/// Takes nodes of one tree into the grid of another.
class NodeMove {
public:
  /// @param from of a valid file @param to its origins within +-2^60
  NodeMove(const baked::TreeRecord& from, const baked::TreeRecord& to);

  /// Whether boxes stay exactly what they are.
  bool exact() const { return possible_ && shift_ == 0; }

  /// The node, its boxes rounded outwards where the grid becomes coarser. Returns the box of all; none where the grids
  /// have nothing to do with each other, or a box lies outside of the coordinates, as it may in files whose boxes are
  /// wrong.
  std::optional<TreeGridBox> move(const baked::PackedNode& node, baked::PackedNode& out) const;

private:
  std::optional<TreeGridBox> translate(const baked::PackedNode& node, baked::PackedNode& out) const;
  std::optional<TreeGridBox> rescale(const baked::PackedNode& node, baked::PackedNode& out) const;

  bool possible_;
  int32_t shift_; ///< doublings of coordinates
  const baked::TreeRecord &from_, &to_;
};

} // namespace packtrace
