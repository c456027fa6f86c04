#pragma once

#include "runtime/trace/packed/kernels/ray_group.h"

namespace packtrace::packed {
namespace {

/// The nearest hits that the rays of a run have found so far, one array per value, so that a register of hits is
/// recorded at once. They are written to the caller's records when the run has been traced.
struct alignas(64) RunHits {
  static constexpr uint32_t kNone = ~0u; ///< placement of a ray without a hit

  float u[kGroup], v[kGroup];
  uint32_t placement[kGroup], cluster[kGroup], triangle[kGroup];

  void clear() {
    const Ints none = Ints{} - 1, zero{};
    for (uint32_t first = 0; first < kGroup; first += kBlock) {
      write_block(&u[first], zero);
      write_block(&v[first], zero);
      write_block(&placement[first], none);
      write_block(&cluster[first], zero);
      write_block(&triangle[first], zero);
    }
  }

  void set(uint32_t i, const KernelHit& hit) {
    u[i] = hit.u, v[i] = hit.v, placement[i] = hit.placement, cluster[i] = hit.cluster, triangle[i] = hit.triangle;
  }

  /// Writes kGroup records.
  /// @param tmax UnitRays::tmax: t of the rays that have a hit
  void write(const float (&tmax)[kGroup], KernelHit* out) const {
    static_assert(sizeof(KernelHit) == 24 && offsetof(KernelHit, placement) == 12);
    for (uint32_t first = 0; first < kGroup; first += kBlock) {
      Floats rows[8]{};
      Ints at_placement;
      read_block(rows[0], &tmax[first]);
      read_block(rows[1], &u[first]);
      read_block(rows[2], &v[first]);
      read_block(at_placement, &placement[first]);
      read_block(rows[4], reinterpret_cast<const float*>(&cluster[first]));
      read_block(rows[5], reinterpret_cast<const float*>(&triangle[first]));
      rows[0] = at_placement == static_cast<int32_t>(kNone) ? Floats{} + __builtin_inff() : rows[0];
      rows[3] = reinterpret_cast<Floats>(at_placement);
#if defined(__AVX512F__)
      write_sixes(rows, reinterpret_cast<float*>(out + first));
#else
      transpose(rows);
      write_rows(rows, out + first);
#endif
    }
  }

private:
#if defined(__AVX512F__)
  /// Writes the first six rows column by column: 16 records of 24 bytes fill six registers.
  static void write_sixes(const Floats (&rows)[8], float* out) {
    for (uint32_t half = 0; half < 2; ++half) {
      Doubles pairs[3]; // of rows 2 i and 2 i + 1, columns 8 half to 8 half + 7
      for (uint32_t i = 0; i < 3; ++i) {
        const Floats a = rows[2 * i], b = rows[2 * i + 1];
        pairs[i] = reinterpret_cast<Doubles>(
            half == 0 ? __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23)
                      : __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31));
      }
      const Doubles lines[3] = {
          __builtin_shufflevector(__builtin_shufflevector(pairs[0], pairs[1], 0, 8, -1, 1, 9, -1, 2, 10), pairs[2], 0,
                                  1, 8, 3, 4, 9, 6, 7),
          __builtin_shufflevector(__builtin_shufflevector(pairs[0], pairs[1], -1, 3, 11, -1, 4, 12, -1, 5), pairs[2],
                                  10, 1, 2, 11, 4, 5, 12, 7),
          __builtin_shufflevector(__builtin_shufflevector(pairs[0], pairs[1], 13, -1, 6, 14, -1, 7, 15, -1), pairs[2],
                                  0, 13, 2, 3, 14, 5, 6, 15)};
      for (uint32_t i = 0; i < 3; ++i) write_block(out + 48 * half + 16 * i, lines[i]);
    }
  }
#endif
};

} // namespace
} // namespace packtrace::packed
