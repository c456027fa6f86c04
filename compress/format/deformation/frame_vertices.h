#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/layout/packed_node.h"

namespace packtrace {

/// A vertex of a frame in lattice steps from the low corner of the whole animation's box: x, y, z, and 0 so that four
/// lanes are processed at once.
using FramePoint = std::array<int32_t, 4>;

/// Largest extent of an animation's box along an axis, in lattice steps.
inline constexpr int64_t kMaxFrameExtent = baked::kMaxTreeCoordinate;

/// Origin of a tree's grid along an axis on which the animation's box is [lo, lo + extent]: as TreeRecord specifies, 0
/// unless another origin makes every coordinate smaller. Nothing if the tree could not hold the box.
inline std::optional<int64_t> tree_origin_of_frames(int64_t lo, uint64_t extent) {
  if (extent > static_cast<uint64_t>(kMaxFrameExtent) || lo < -kMaxLattice || lo > kMaxLattice) return std::nullopt;
  const int64_t hi = lo + static_cast<int64_t>(extent);
  const bool movable = (lo > 0 && hi <= 2 * lo) || (hi < 0 && lo >= 2 * hi);
  const int64_t origin = movable ? lo + (hi - lo) / 2 : 0;
  if (lo - origin < -kMaxFrameExtent || hi - origin > kMaxFrameExtent) return std::nullopt;
  return origin;
}

/// The vertices of one frame of a deforming geometry.
class FrameVertices {
public:
  virtual ~FrameVertices() = default;

  /// Writes the vertices of one cluster in the order of its record. May be called from several threads, and several
  /// times for a cluster.
  /// @param cluster number within the geometry
  /// @param out one element per vertex of the cluster
  virtual void read(uint32_t cluster, std::span<FramePoint> out) const = 0;
};

} // namespace packtrace
