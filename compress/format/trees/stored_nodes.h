#pragma once

#include <optional>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/leaf_nodes.h"

namespace packtrace {

/// Index from clusters to the leaf nodes in a file's trees. Empty if the file has no trees, or 2^32 nodes or more.
class StoredLeafNodes {
public:
  /// @param sections of a valid file; not kept
  explicit StoredLeafNodes(const BakedSections& sections);

  bool empty() const { return nodes_.empty(); }
  /// Returns the numbers of a cluster's leaf nodes in the node section, in the order of the cluster's stream. Empty if
  /// no ray sees the cluster.
  /// @param cluster number in the cluster section
  std::span<const uint32_t> of_cluster(uint32_t cluster) const;
  /// Number of the tree that contains the cluster's leaf nodes.
  uint32_t tree_of_cluster(uint32_t cluster) const { return tree_of_[cluster]; }
  /// Number of leaf nodes in a tree.
  uint64_t count_of_tree(uint32_t tree) const { return of_tree_[tree]; }

private:
  std::vector<uint32_t> first_;   ///< by cluster, and one more: start of its run in nodes_
  std::vector<uint32_t> nodes_;   ///< node numbers, by cluster
  std::vector<uint32_t> tree_of_; ///< by cluster; baked::kNone if it has no leaf nodes
  std::vector<uint64_t> of_tree_;
};

/// Moves nodes from the grid of one tree to the grid of another.
class NodeGridTransfer {
public:
  /// @param from of a valid file
  /// @param to its origin must lie within +-2^60
  NodeGridTransfer(const baked::TreeRecord& from, const baked::TreeRecord& to);

  /// Whether boxes keep their exact size and place.
  bool exact() const { return possible_ && shift_ == 0; }

  /// Writes the node with its boxes in the other grid, rounded outwards if that grid is coarser, and returns the box of
  /// all children. Returns nothing if the grids are incompatible, or if a box lies outside the tree coordinates, which
  /// happens only in files with wrong boxes.
  std::optional<TreeGridBox> move(const baked::PackedNode& node, baked::PackedNode& out) const;

private:
  std::optional<TreeGridBox> translate(const baked::PackedNode& node, baked::PackedNode& out) const;
  std::optional<TreeGridBox> rescale(const baked::PackedNode& node, baked::PackedNode& out) const;

  bool possible_;
  int32_t shift_; ///< log2 of the factor between the coordinates
  const baked::TreeRecord &from_, &to_;
};

} // namespace packtrace
