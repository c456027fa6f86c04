#pragma once

#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace::packed {
namespace {

/// Computes the octant of a ray's direction in a placement's grid in floats. The result may differ from that of the
/// exact transform where a component is almost 0.
class ApproximateOctant {
public:
  explicit ApproximateOctant(const TracePlacement& placement) {
    for (uint32_t i = 0; i < 3; ++i)
      for (uint32_t axis = 0; axis < 3; ++axis)
        column_[i][axis] = static_cast<float>(placement.grid_from_unit[3 * i + axis]);
  }

  uint32_t operator()(const float (&v)[3]) const {
    Four column[3];
    __builtin_memcpy(column, column_, sizeof column);
    const Four turned = v[0] * column[0] + v[1] * column[1] + v[2] * column[2];
#if defined(__x86_64__)
    return static_cast<uint32_t>(__builtin_ia32_movmskps(turned)) & 7u;
#else
    float lanes[4];
    __builtin_memcpy(lanes, &turned, sizeof lanes);
    uint32_t octant = 0;
    for (uint32_t axis = 0; axis < 3; ++axis) octant |= (__builtin_signbit(lanes[axis]) ? 1u : 0u) << axis;
    return octant;
#endif
  }

private:
  using Four = float __attribute__((vector_size(16)));
  alignas(16) float column_[3][4] = {};
};

} // namespace
} // namespace packtrace::packed
