#pragma once

#include <vector>

#include "compress/format/baked_file.h"
#include "compress/format/leaf_nodes.h"
#include "compress/format/packed_node.h"

namespace packtrace {

/// What lies in the sections of trees and nodes.
struct PackedTrees {
  std::vector<baked::TreeRecord> trees; ///< the world's first if there is one, then by geometry
  std::vector<baked::PackedNode> nodes; ///< of all trees in order
};

/// Builds the trees of a file: one over the clusters of all world-space geometries, one for each other geometry with
/// clusters. World-space geometry that the world's tree cannot hold has one of its own: if it has several instances, or
/// one that is not placed by the identity, or a step that is not 2^-k times the coarsest one with k in 0..60. Clusters
/// that neither camera nor occlusion rays see are left out; a tree may be empty. On all threads; the result depends on
/// the sections only.
/// @param sections of a valid file; reads geometries, clusters, payload and instances only
/// Throws Error(kLimitExceeded) where a tree would have more than 2^30 nodes with leaves.
PackedTrees build_packed_trees(const BakedSections& sections, const TreeCosts& costs = {});

} // namespace packtrace
