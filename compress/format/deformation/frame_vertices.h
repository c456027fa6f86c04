#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace packtrace {

/// A vertex of a frame in lattice steps from the low corner of the whole animation's box: x, y, z, and 0 so that four
/// lanes are processed at once.
using FramePoint = std::array<int32_t, 4>;

/// Largest extent of an animation's box along an axis, in lattice steps.
inline constexpr int64_t kMaxFrameExtent = (int64_t{1} << 30) - (int64_t{1} << 23);

/// The vertices of one frame of a deforming geometry.
class FrameVertices {
public:
  virtual ~FrameVertices() = default;

  /// Writes the vertices of one cluster in the order of its record. May be called from several threads, and several
  /// times for a cluster.
  /// @param cluster number within the geometry
  /// @param out as many elements as the cluster has vertices
  virtual void read(uint32_t cluster, std::span<FramePoint> out) const = 0;
};

} // namespace packtrace
