#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/leaf_nodes.h"

namespace packtrace {

/// Contents of the tree and node sections.
struct PackedTrees {
  std::vector<baked::TreeRecord> trees; ///< the world's tree first if there is one, then by geometry
  std::vector<baked::PackedNode> nodes; ///< of all trees in order
};

/// Builds the trees of a file: one over the clusters of all world-space geometries, and one for each other geometry
/// with clusters. A world-space geometry gets its own tree if the world's tree cannot hold it: it has several
/// instances, its instance is not placed by the identity, or its step is not 2^-k times the coarsest one with k in
/// 0..30. Clusters that neither camera nor occlusion rays see are left out; a tree may be empty. Runs on all threads;
/// the result depends only on the arguments.
/// @param sections of a valid file; only geometries, clusters, payload and instances are read
/// Throws Error(kLimitExceeded) if a tree would have more than 2^30 leaf nodes.
PackedTrees build_packed_trees(const BakedSections& sections, const TreeCosts& costs = {});

/// Clusters that one tree is built over: of a geometry and its LOD levels, or of all world-space geometry.
struct ChosenClusters {
  uint32_t geometry = 0;          ///< as in TreeRecord; not an LOD level of another geometry
  std::vector<uint32_t> clusters; ///< numbers in the cluster section, ascending
};

/// Builds trees over chosen clusters, possibly several trees per geometry. All trees of a geometry share one grid,
/// which holds all its LOD levels. Leaf nodes are taken from the file's trees and moved into that grid; clusters
/// without stored leaf nodes get new ones, once per cluster. For each tree only the nodes above the leaf nodes are
/// built. If a choice contains exactly the clusters of a stored tree whose grid has the same step, that tree is reused.
class ChosenTreeBuilder {
public:
  /// Finds or makes the leaf nodes.
  /// @param sections of a valid file; must outlive the builder
  /// @param chosen must outlive the builder; kWorldTree occurs at most once, and only with geometries of joins_world()
  ChosenTreeBuilder(const BakedSections& sections, std::span<const ChosenClusters> chosen);
  ~ChosenTreeBuilder();
  ChosenTreeBuilder(const ChosenTreeBuilder&) = delete;
  ChosenTreeBuilder& operator=(const ChosenTreeBuilder&) = delete;

  /// By geometry: whether it belongs to the world's tree. LOD levels do not count: their entries are 0.
  static std::vector<uint8_t> joins_world(const BakedSections& sections);

  /// Builds one tree per choice, in order. Runs on all threads; the result depends only on sections and choices.
  /// Throws as build_packed_trees() does.
  PackedTrees build() const;

  /// Number of leaf nodes of a tree. It has fewer nodes above them.
  uint64_t leaf_nodes(size_t tree) const;

private:
  struct Tables;
  std::unique_ptr<Tables> tables_;
};

} // namespace packtrace
