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
      transpose(rows);
      write_rows(rows, out + first);
    }
  }
};

} // namespace
} // namespace packtrace::packed
