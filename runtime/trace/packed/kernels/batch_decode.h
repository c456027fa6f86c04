#pragma once

#include "runtime/trace/packed/kernels/batch_strips.h"

namespace packtrace::packed {
namespace {

inline float power_of_two(uint32_t negated_exponent) { // 2^-n
  const uint32_t bits = (127u - negated_exponent) << 23;
  float result;
  __builtin_memcpy(&result, &bits, sizeof result);
  return result;
}

/// Decodes triangles from `first` on, as many of `count` as fit into a batch; returns their number. Portable code.
inline uint32_t decode_batch_scalar(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
  BatchStrips batch;
  read_strips(cluster, first, count, batch);
  uint32_t vertex[kBatchCorners];
  batch_vertices(cluster, batch, vertex);

  const uint32_t widths[3] = {cluster.position_bits[0], cluster.position_bits[1], cluster.position_bits[2]};
  const uint32_t stride = widths[0] + widths[1] + widths[2];
  const float scale = power_of_two(cluster.down);
  float position[3][kBatchCorners];
  for (uint32_t i = 0; i < kBatchCorners; ++i) {
    uint64_t fields = field(cluster.bits, cluster.position_bit + vertex[i] * stride, stride);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const auto value = static_cast<uint32_t>(fields & ((uint64_t{1} << widths[axis]) - 1));
      fields >>= widths[axis];
      position[axis][i] =
          static_cast<float>(static_cast<int32_t>(static_cast<uint32_t>(cluster.base[axis]) + (value << cluster.up))) *
          scale;
    }
  }
  for (uint32_t i = 0; i < kBatch; ++i) {
    const BatchTriangle triangle = batch_triangle(batch, i < batch.count ? i : 0);
    for (uint32_t axis = 0; axis < 3; ++axis)
      for (uint32_t corner = 0; corner < 3; ++corner)
        out.vertex[axis][corner][i] = position[axis][triangle.corner[corner]];
  }
  return batch.count;
}

} // namespace
} // namespace packtrace::packed
