#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/trees/packed_trees.h"
#include "runtime/trace/packed/kernels/kernel_types.h"
#include "runtime/trace/packed/scene/tree_hull.h"
#include "runtime/trace/ray_tracer.h"
#include "runtime/trace/source/lod_source.h"

namespace packtrace {

/// The trees that rays traverse, and the clusters in them as kernels read them.
struct TracedTrees {
  std::shared_ptr<const PackedTrees> built; ///< owns trees that were built here; null if they are the file's
  std::span<const baked::TreeRecord> records;
  std::span<const baked::PackedNode> nodes;
  std::vector<packed::TraceTree> trees;
  /// By tree, none for trees without nodes; kept while placements may change.
  std::vector<std::optional<TreeHull>> hulls;
  std::shared_ptr<std::vector<packed::TraceCluster>> cluster_table; ///< by number in the cluster section
  std::vector<uint32_t> tree_of; ///< by the source's geometry: number of its tree, or baked::kNone
  std::vector<uint32_t> grid_of; ///< by the file's geometry: tree in whose grid its clusters are decoded

  std::span<packed::TraceCluster> clusters() { return *cluster_table; }
  std::span<const packed::TraceCluster> clusters() const { return *cluster_table; }

  /// The transform from a tree's grid to object space, or to world space for the world tree.
  DAffine object_from_grid(uint32_t tree) const;
};

/// Time and memory of building the trees of a LodSource.
struct LodTrees {
  double clusters_s = 0.0;      ///< time to build the clusters' leaf nodes, which do not depend on the view
  double trees_s = 0.0;         ///< time to build the nodes above them
  std::vector<TreeBytes> trees; ///< worst cases are known before the trees are built
};

/// Returns a tree as kernels read it.
/// @param nodes of one tree, root first; not empty
/// @param hull of these nodes
packed::TraceTree trace_tree(std::span<const baked::PackedNode> nodes, const TreeHull& hull);

/// Returns the trees over LOD level 0: the file's trees, or trees built here if it holds none.
/// @param file must outlive the result
TracedTrees whole_trees(const BakedFile& file);

/// Returns the same trees for other placements, with their hulls. Nodes and clusters are shared, not copied.
/// @param trees none deforms
TracedTrees shared_trees(const TracedTrees& trees);

/// Builds the trees over the clusters of a plan's BLASes: one per BLAS, and a single one for all world-space geometry.
/// @param file must outlive the result
/// @param without geometries of the file whose trees stay empty
TracedTrees chosen_trees(const BakedFile& file, const LodSource& source, std::span<const uint32_t> without,
                         LodTrees& cost);

} // namespace packtrace
