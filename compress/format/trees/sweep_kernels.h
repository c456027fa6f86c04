#pragma once

#include <cstdint>

/// SIMD kernels that find where runs of a cluster's triangles are split best, one set per instruction set. All sets
/// return the same bits. The interface uses arrays of plain types only, because no inline function of another header
/// may be compiled for AVX2.
namespace packtrace::sweep_kernels {

inline constexpr uint32_t kMaxBoxes = 128; ///< of a run

/// A box of integers below 2^24, which floats represent exactly. The low end is negated, so that one maximum extends
/// the box.
struct alignas(32) Box {
  float minus_lo[4]; ///< x, y, z, 0
  float hi[4];       ///< x, y, z, 0
};

/// The split of a run with the least cost by the surface area heuristic. Of equal costs it is the one nearest to the
/// middle of the run, then the one of the lowest axis, then the one with fewer boxes on the left.
struct Split {
  float area;    ///< half the surface area of all boxes together
  uint32_t left; ///< number of boxes on the left, at least 1
  uint32_t axis; ///< in whose order the boxes are split
};

/// Splits a run of 2..kMaxBoxes boxes in the order in which they lie.
using SplitRun = Split (*)(const Box* boxes, uint32_t count);
/// Splits a run of 2..kMaxBoxes boxes in one of three orders.
/// @param orders per axis, the numbers of the same `count` boxes
using SplitOrders = Split (*)(const Box* boxes, const uint8_t* const* orders, uint32_t count);

struct Kernels {
  SplitRun split_run;
  SplitOrders split_orders;
};

extern const Kernels kPortable;
extern const Kernels kAvx2;

/// Returns the fastest set that this processor supports.
const Kernels& kernels();

} // namespace packtrace::sweep_kernels
