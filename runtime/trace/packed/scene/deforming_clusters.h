#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/deformation/frame_vertices.h"
#include "compress/format/file/baked_file.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// A copy of the clusters of one geometry whose vertices can move: strips as in the file,
/// followed by position fields that are rewritten for each frame. A cluster's anchor and widths follow the frame.
class DeformingClusters {
public:
  /// @param clusters the geometry's clusters as kernels read them in the file
  /// @param low the animation's low corner in tree coordinates
  DeformingClusters(const BakedFile& file, uint32_t geometry, std::span<const packed::TraceCluster> clusters,
                    const FramePoint& low);

  uint32_t count() const { return static_cast<uint32_t>(clusters_.size()); }
  std::span<const packed::TraceCluster> clusters() const { return clusters_; }

  /// The smallest box of a cluster's vertices in a frame.
  struct Extent {
    FramePoint lo, hi;
  };
  static Extent extent_of(std::span<const FramePoint> points);

  /// Whether the vertices fit into the memory of the cluster.
  bool has_room(uint32_t cluster, size_t vertices, const Extent& extent) const;
  /// Enlarges the memory of clusters; keeps the contents of all.
  /// @param bits by cluster: bits of position fields that it must hold; 0 for those that keep their size
  void make_room(std::span<const uint64_t> bits);

  /// Rewrites a cluster's vertices. Needs has_room(). Different clusters may be written at the same time.
  void write(uint32_t cluster, std::span<const FramePoint> points, const Extent& extent);

  /// Bits of a vertex in a box of this extent; kernels read up to kMaxFieldBits.
  static uint32_t stride_of(const Extent& extent);

  uint64_t bytes() const;

private:
  void lay_out(std::span<const uint64_t> bits);

  FramePoint low_;
  std::vector<packed::TraceCluster> clusters_;
  std::vector<uint64_t> begins_; ///< by cluster and one more: offset in bits_
  std::vector<uint8_t> bits_;
};

/// A vertex of a cluster that kernels can read (not kNeedsWideDecode), in units of 2^-down steps of the tree's grid.
std::array<int32_t, 3> grid_point(const packed::TraceCluster& cluster, uint32_t vertex);

} // namespace packtrace
