#pragma once

#include <cstdint>

/// SIMD kernels that split runs of boxes between bins of their centres, one set per instruction set. All sets return
/// the same bits. The interface uses arrays of plain types only, because no inline function of another header may be
/// compiled for AVX2.
namespace packtrace::bin_kernels {

inline constexpr uint32_t kMaxBins = 64;

/// A run of boxes, by their numbers.
struct Run {
  const float* boxes; ///< six per box: lo x, y, z, hi x, y, z; finite
  uint32_t* order;    ///< numbers of the run's boxes
  uint32_t count;     ///< at least 1, below 2^31
};

/// Bounds of a run, each as six floats like a box.
struct RunBounds {
  float boxes[6];
  float centres[6]; ///< of the boxes' centres, rounded to floats
};

/// Maps centres to bins: a place p, twice a rounded centre, is in the bin floor((p - low) scale), at most bins - 1.
struct Bins {
  double low[3], scale[3]; ///< by axis; a scale is 0 if all centres are equal
  uint32_t count;          ///< of the bins, 2..kMaxBins
};

using Measure = void (*)(const Run& run, RunBounds& out);
/// Splits a run between two bins, at the least cost by the surface area heuristic; of equal costs at the lowest axis,
/// then the lowest bin. Moves the boxes on the left to the front, as std::partition() moves them.
/// @param unit number of boxes per leaf: any count up to it costs as much as one leaf
/// @return the number of boxes on the left; 0 if all boxes are in one bin along each axis
using Split = uint32_t (*)(const Run& run, const Bins& bins, uint32_t unit);

struct Kernels {
  Measure measure;
  Split split;
};

extern const Kernels kPortable;
extern const Kernels kAvx2;

/// Returns the fastest set that this processor supports.
const Kernels& kernels();

} // namespace packtrace::bin_kernels
