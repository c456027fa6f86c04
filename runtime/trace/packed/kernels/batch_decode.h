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

/// Reads a cluster's vertices one by one, in the tree's grid.
class VertexReader {
public:
  explicit VertexReader(const TraceCluster& cluster)
      : cluster_(cluster), x_bits_(cluster.position_bits[0]), y_bits_(cluster.position_bits[1]),
        z_bits_(cluster.position_bits[2]), scale_(power_of_two(cluster.down)) {}

  void operator()(uint32_t vertex, float (&point)[3]) const {
    const uint32_t stride = x_bits_ + y_bits_ + z_bits_;
    const PositionFields fields =
        read_position(cluster_.bits, cluster_.position_bit + vertex * stride, x_bits_, y_bits_, z_bits_);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t offset = static_cast<uint32_t>(fields.axis[axis]) << cluster_.up;
      point[axis] =
          static_cast<float>(static_cast<int32_t>(static_cast<uint32_t>(cluster_.base[axis]) + offset)) * scale_;
    }
  }

private:
  const TraceCluster& cluster_;
  uint32_t x_bits_, y_bits_, z_bits_;
  float scale_;
};

/// Decodes the vertices of one triangle, in the tree's grid.
inline void decode_triangle(const TraceCluster& cluster, uint32_t triangle, float (&vertex)[3][3]) {
  BatchStrips batch;
  read_strips(cluster, triangle, 1, batch);
  uint32_t fresh = batch.first_fresh, explicit_bit = batch.explicit_bit;
  const uint32_t width = index_bits(cluster);
  const VertexReader read_vertex(cluster);
  for (uint32_t corner = 0; corner < 3; ++corner) { // the batch's corner list is the triangle's corners
    uint32_t number = 0;
    if (corner < batch.lead_count)
      number = batch.lead[corner];
    else if (((batch.fresh >> corner) & 1u) != 0)
      number = fresh++;
    else
      number = static_cast<uint32_t>(read_bits(cluster.bits, explicit_bit, width)), explicit_bit += width;
    read_vertex(number, vertex[corner]);
  }
}

/// Decodes triangles from `first` on, as many of `count` as fit into a batch; returns their number. Portable code.
inline uint32_t decode_batch_scalar(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
  BatchStrips batch;
  read_strips(cluster, first, count, batch);
  uint32_t vertex[kBatchCorners];
  batch_vertices(cluster, batch, vertex);

  const VertexReader read_vertex(cluster);
  float position[3][kBatchCorners];
  for (uint32_t i = 0; i < kBatchCorners; ++i) {
    float point[3];
    read_vertex(vertex[i], point);
    for (uint32_t axis = 0; axis < 3; ++axis) position[axis][i] = point[axis];
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
