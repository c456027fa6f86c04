#pragma once

#include <cstdint>

namespace packtrace {

/// The positions of a cluster's payload (docs/baked_format.md, "Cluster").
struct PositionStream {
  const uint8_t* bits = nullptr; ///< 8 bytes are readable behind the last position
  uint64_t first_bit = 0;
  uint32_t stride = 0, count = 0;
  uint32_t width[3] = {}; ///< each at most kMaxKernelPositionBits; not std::array, whose functions are inline
  double base[3] = {};    ///< lattice point of field 0, within +-2^kMaxKernelPositionBits
  double step = 0.0;
};
/// Up to this width doubles represent all lattice coordinates, and a field becomes a double by placing its bits in the
/// mantissa of 2^52.
inline constexpr uint32_t kMaxKernelPositionBits = 51;

/// Decodes all positions to x, y, z triples.
using PositionKernel = void (*)(const PositionStream& stream, float* out);

/// Returns the kernel for this processor, which gives the same bits as ClusterView::position(); null if there is none.
PositionKernel position_kernel();

namespace avx2 {
void decode_positions(const PositionStream& stream, float* out);
}

} // namespace packtrace
