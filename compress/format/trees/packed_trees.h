#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/layout/packed_node.h"

namespace packtrace {

/// What lies in the sections of trees and nodes.
struct PackedTrees {
  std::vector<baked::TreeRecord> trees; ///< the world's first if there is one, then by geometry
  std::vector<baked::PackedNode> nodes; ///< of all trees in order
};

/// Builds the trees of a file: one over the clusters of all world-space geometries, one for each other geometry with
/// clusters. World-space geometry that the world's tree cannot hold has one of its own: if it has several instances, or
/// one that is not placed by the identity, or a step that is not 2^-k times the coarsest one with k in 0..30. Clusters
/// that neither camera nor occlusion rays see are left out; a tree may be empty. On all threads; the result depends on
/// the sections only.
/// @param sections of a valid file; reads geometries, clusters, payload and instances only
/// Throws Error(kLimitExceeded) where a tree would have more than 2^30 nodes with leaves.
PackedTrees build_packed_trees(const BakedSections& sections, const TreeCosts& costs = {});

/// What one tree is wanted over: clusters of a geometry and its levels of detail, or of all world-space geometry.
struct ChosenClusters {
  uint32_t geometry = 0;          ///< as in TreeRecord; no level of another one
  std::vector<uint32_t> clusters; ///< numbers in the cluster section, ascending
};

/// Trees over choices of clusters, several of one geometry if need be. All trees of a geometry have one grid, which
/// holds all its levels of detail. Nodes with leaves are those of the file's trees, taken into that grid, or are made
/// once for each cluster where it has none; what is built for a tree is the nodes above them. A choice of all that a
/// tree of the file holds is that tree, if its grid has the same step.
class ChosenTreeBuilder {
public:
  /// Finds or makes the nodes with leaves. @param sections of a valid file; must outlive it
  /// @param chosen must outlive it; geometry kWorldTree at most once, and only with geometries of joins_world()
  ChosenTreeBuilder(const BakedSections& sections, std::span<const ChosenClusters> chosen);
  ~ChosenTreeBuilder();
  ChosenTreeBuilder(const ChosenTreeBuilder&) = delete;
  ChosenTreeBuilder& operator=(const ChosenTreeBuilder&) = delete;

  /// By geometry, levels not counted: whether it is one of those of the world's tree.
  static std::vector<uint8_t> joins_world(const BakedSections& sections);

  /// One tree for each choice, in order. On all threads; the result depends on sections and choices only.
  /// Throws as build_packed_trees().
  PackedTrees build() const;

  /// Nodes with leaves below a tree; it has fewer nodes above them.
  uint64_t leaf_nodes(size_t tree) const;

private:
  struct Tables;
  std::unique_ptr<Tables> tables_;
};

} // namespace packtrace
