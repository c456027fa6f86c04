#pragma once

#include <optional>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/trees/packed_trees.h"
#include "runtime/trace/source/lod_source.h"
#include "runtime/trace/packed/kernels/kernel_types.h"
#include "runtime/trace/packed/scene/tree_hull.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// The trees that rays go through, and the clusters in them as kernels read them.
struct TracedTrees {
  PackedTrees built; ///< where the file has no trees
  std::span<const baked::TreeRecord> records;
  std::span<const baked::PackedNode> nodes;
  std::vector<packed::TraceTree> trees;
  std::vector<std::optional<TreeHull>> hulls; ///< by tree, of those with nodes; until all is placed
  std::vector<packed::TraceCluster> clusters; ///< by number in the cluster section
  std::vector<uint32_t> tree_of;              ///< by the source's geometry, or baked::kNone
  std::vector<uint32_t> grid_of;              ///< by the file's geometry: a tree whose grid its clusters are read in
};

/// What building the trees of a LodSource took and takes.
struct LodTrees {
  double clusters_s = 0.0;      ///< nodes of clusters, which do not depend on the view
  double trees_s = 0.0;         ///< nodes above them
  std::vector<TreeBytes> trees; ///< worst cases are known before they are built
};

/// Trees over all of level 0: the file's, or built here if it holds none.
/// @param file outlives the result
TracedTrees whole_trees(const BakedFile& file);

/// Trees over the clusters of a plan's BLASes, built here: one each, and one for all that lies in the world.
/// @param file outlives the result
TracedTrees chosen_trees(const BakedFile& file, const LodSource& source, LodTrees& cost);

} // namespace packtrace
