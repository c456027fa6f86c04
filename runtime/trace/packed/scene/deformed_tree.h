#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/lattice_box.h"
#include "compress/format/deformation/frame_vertices.h"
#include "compress/format/file/baked_file.h"
#include "compress/format/trees/node_kernels.h"
#include "compress/format/trees/reinsertion.h"
#include "pbrt_import/scene/bounds.h"
#include "runtime/trace/packed/scene/deforming_clusters.h"

namespace packtrace {

/// A geometry whose vertices move.
struct DeformingGeometry {
  uint32_t geometry = 0;
  LatticeBox range; ///< holds the vertices of all frames, in steps of the geometry's lattice
};

struct DeformConfig {
  /// [1, 4]: a tree is rebuilt, not refitted, once its area exceeds this many times that of the tree built last.
  double max_growth = 1.5;
  /// Limits the optimisation of rebuilt trees.
  ReinsertionConfig reinsertion{.passes = 1, .subtrees = 1 << 10, .search = 64};

  /// Throws Error(kUsage) if a value is out of range.
  void validate() const;
};

/// Effect of a new frame on a tree.
struct DeformStep {
  bool rebuilt = false;
  double growth = 1.0; ///< area of the refitted tree relative to the tree built last; see DeformedTree::area()
};

/// The tree and the clusters of one deforming geometry: copies that change from frame to frame. A frame rewrites the
/// clusters' position fields and refits all boxes from the leaves up; the topology stays until the tree is rebuilt. The
/// boxes are the smallest ones of the format (docs/packed_bvh.md), so a refitted tree traces as correctly as a built
/// one. Clusters of the frame before are kept for motion vectors.
class DeformedTree {
public:
  /// Starts with the vertices of the file.
  /// @param tree,nodes the geometry's own tree
  /// @param clusters the geometry's clusters as kernels read them in the file
  /// Throws Error(kLimitExceeded) if the range exceeds kMaxFrameExtent or the tree's coordinates, Error(kInput) if the
  /// file's vertices lie outside it.
  DeformedTree(const BakedFile& file, const DeformingGeometry& geometry, const baked::TreeRecord& tree,
               std::span<const baked::PackedNode> nodes, std::span<const packed::TraceCluster> clusters,
               const DeformConfig& config);

  /// Moves the vertices. Runs on all threads; the result depends on the frame and the tree's topology only.
  /// Throws Error(kInput) if a vertex lies outside the range, Error(kLimitExceeded) if the vertices of one cluster span
  /// so many steps that their fields exceed kMaxFieldBits. The tree must not be traced after an error until an update
  /// succeeds.
  DeformStep update(const FrameVertices& frame);

  const baked::TreeRecord& record() const { return grid_.record; }
  std::span<const baked::PackedNode> nodes() const { return nodes_; }
  std::span<const packed::TraceCluster> clusters() const { return now_.clusters(); }
  /// The clusters before the last update().
  std::span<const packed::TraceCluster> previous_clusters() const { return before_.clusters(); }

  /// Sum of the areas of all nodes' boxes in units of the root's: about the number of nodes that a random ray through
  /// the root visits.
  /// Source: Goldsmith, Salmon, "Automatic creation of object hierarchies for ray tracing" (1987).
  double area() const { return area_; }

  /// Object-space bounds of all frames.
  Bounds object_bounds() const;
  /// Object-space bounds of the current frame.
  Bounds current_bounds() const;

  uint64_t bytes() const;

private:
  /// A grid for all frames.
  struct Grid {
    baked::TreeRecord record{};
    FramePoint low{}, extent{}; ///< the range: low corner in tree coordinates, and size in steps
  };
  class ClusterWriter;

  static Grid find_grid(const BakedFile& file, const DeformingGeometry& geometry, const baked::TreeRecord& tree);
  Bounds bounds_between(const FramePoint& lo, const FramePoint& hi) const;
  void index_leaf_nodes();
  void write_clusters(const FrameVertices& frame);
  void refit();
  void rebuild();
  uint32_t first_cluster() const;

  const BakedFile& file_;
  const uint32_t geometry_;
  const DeformConfig config_;
  Grid grid_;
  std::vector<baked::PackedNode> nodes_;
  std::vector<node_kernels::Box> boxes_;   ///< by node: box of its subtree
  std::vector<uint32_t> leaf_node_begins_; ///< by cluster and one more: range of leaf_nodes_
  std::vector<uint32_t> leaf_nodes_;       ///< numbers of leaf nodes, by cluster
  std::vector<uint8_t> ray_classes_;       ///< by cluster: PackedNode::ray_classes
  DeformingClusters now_, before_;
  double area_ = 0.0, built_area_ = 0.0;
};

} // namespace packtrace
