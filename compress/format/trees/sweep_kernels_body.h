// Kernels of sweep_kernels.h, compiled once per instruction set. Code here must not use inline functions of other
// headers, because they would be compiled for AVX2.

#include "compress/format/trees/sweep_kernels.h"

namespace packtrace::sweep_kernels {
namespace {

using Float4 = float __attribute__((vector_size(16), may_alias));
using Float8 = float __attribute__((vector_size(32), may_alias));
using Int8 = int32_t __attribute__((vector_size(32), may_alias));
constexpr float kInfinity = __builtin_inff();

[[gnu::always_inline]] inline const Float8& lanes(const Box& box) { return reinterpret_cast<const Float8&>(box); }
[[gnu::always_inline]] inline Float8 max_of(const Float8& a, const Float8& b) { return a > b ? a : b; }
[[gnu::always_inline]] inline Float8 choose(const Int8& mask, const Float8& a, const Float8& b) { return mask ? a : b; }

/// The extents of two boxes: of the first in lanes 0..2, of the second in lanes 4..6.
[[gnu::always_inline]] inline Float8 extents(const Float8& a, const Float8& b) {
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11) +
         __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}

/// Half the surface areas of the boxes with these extents, in lanes 0 and 4.
[[gnu::always_inline]] inline Float8 half_areas(const Float8& size) {
  const Float8 faces = size * __builtin_shufflevector(size, size, 1, 2, 0, 3, 5, 6, 4, 7);
  return faces + __builtin_shufflevector(faces, faces, 1, 0, 3, 2, 5, 4, 7, 6) +
         __builtin_shufflevector(faces, faces, 2, 3, 0, 1, 6, 7, 4, 5);
}

/// The same of three boxes in lanes 0..2, and of three more in lanes 4..6. Lanes 3 and 7 repeat lanes 2 and 6.
[[gnu::always_inline]] inline Float8 half_areas(const Float8& a, const Float8& b, const Float8& c) {
  const Float8 low = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13),
               high = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  const Float8 x = __builtin_shufflevector(low, c, 0, 1, 8, 8, 4, 5, 12, 12),
               y = __builtin_shufflevector(low, c, 2, 3, 9, 9, 6, 7, 13, 13),
               z = __builtin_shufflevector(high, c, 0, 1, 10, 10, 4, 5, 14, 14);
  return x * y + y * z + z * x;
}

/// The best splits so far, per lane.
struct Best {
  Float8 cost, off_middle, left;

  /// @param left numbers of boxes on the left, which ascend
  [[gnu::always_inline]] void improve(const Float8& other, const Float8& at, const Float8& count) {
    const Float8 off = count - 2.0f * at, distance = max_of(off, -off);
    const Int8 better = (other < cost) | ((other == cost) & (distance < off_middle));
    cost = choose(better, other, cost);
    off_middle = choose(better, distance, off_middle);
    left = choose(better, at, left);
  }

  /// The same for the splits in the lanes of `other`, which may come earlier in the run.
  [[gnu::always_inline]] void improve(const Best& other) {
    const Int8 nearer = (other.off_middle < off_middle) | ((other.off_middle == off_middle) & (other.left < left));
    const Int8 better = (other.cost < cost) | ((other.cost == cost) & nearer);
    cost = choose(better, other.cost, cost);
    off_middle = choose(better, other.off_middle, off_middle);
    left = choose(better, other.left, left);
  }

  /// This with lanes 0..3 and 4..7 exchanged.
  [[gnu::always_inline]] Best exchanged() const {
    return {__builtin_shufflevector(cost, cost, 4, 5, 6, 7, 0, 1, 2, 3),
            __builtin_shufflevector(off_middle, off_middle, 4, 5, 6, 7, 0, 1, 2, 3),
            __builtin_shufflevector(left, left, 4, 5, 6, 7, 0, 1, 2, 3)};
  }

  /// Returns the best of lanes 0..3, of equal ones the first.
  /// @param area half the surface area of the run
  [[gnu::always_inline]] Split first_best(float area) const {
    float costs[8], distances[8], lefts[8];
    __builtin_memcpy(costs, &cost, sizeof costs);
    __builtin_memcpy(distances, &off_middle, sizeof distances);
    __builtin_memcpy(lefts, &left, sizeof lefts);
    uint32_t best = 0;
    for (uint32_t i = 1; i < 4; ++i)
      if (costs[i] < costs[best] || (costs[i] == costs[best] && distances[i] < distances[best])) best = i;
    return {area, static_cast<uint32_t>(lefts[best]), best};
  }
};

[[gnu::always_inline]] inline Float8 load(const float* from) {
  Float8 out;
  __builtin_memcpy(&out, from, sizeof out);
  return out;
}
[[gnu::always_inline]] inline void store_halves(const Float8& both, float* low, float* high) {
  const Float4 first = __builtin_shufflevector(both, both, 0, 1, 2, 3),
               second = __builtin_shufflevector(both, both, 4, 5, 6, 7);
  __builtin_memcpy(low, &first, sizeof first);
  __builtin_memcpy(high, &second, sizeof second);
}
[[gnu::always_inline]] inline float first_lane(const Float8& from) {
  float first;
  __builtin_memcpy(&first, &from, sizeof first);
  return first;
}

constexpr Best kNone{{kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity},
                     {kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity},
                     {1, 1, 1, 1, 1, 1, 1, 1}};

Split split_run(const Box* boxes, uint32_t count) {
  alignas(32) float left[kMaxBoxes + 8], right[kMaxBoxes + 8]; // [i - 1]: areas of the first i boxes and of the others
  Float8 front = lanes(boxes[0]), back = lanes(boxes[count - 1]);
  for (uint32_t i = 1; i < count; ++i) {
    float areas[8];
    const Float8 both = half_areas(extents(front, back));
    __builtin_memcpy(areas, &both, sizeof areas);
    left[i - 1] = areas[0], right[count - 1 - i] = areas[4];
    front = max_of(front, lanes(boxes[i]));
    back = max_of(back, lanes(boxes[count - 1 - i]));
  }
  for (uint32_t i = count - 1; i < ((count + 6) & ~7u); ++i) left[i] = kInfinity, right[i] = 0.0f;
  Best best = kNone;
  const auto all = static_cast<float>(count);
  const Float8 counts = Float8{} + all;
  Float8 at{1, 2, 3, 4, 5, 6, 7, 8};
  for (uint32_t i = 0; i + 1 < count; i += 8, at += 8.0f)
    best.improve(load(left + i) * at + load(right + i) * (counts - at), at, counts);
  best.improve(best.exchanged());
  best.improve({__builtin_shufflevector(best.cost, best.cost, 2, 3, 0, 1, 6, 7, 4, 5),
                __builtin_shufflevector(best.off_middle, best.off_middle, 2, 3, 0, 1, 6, 7, 4, 5),
                __builtin_shufflevector(best.left, best.left, 2, 3, 0, 1, 6, 7, 4, 5)});
  best.improve({__builtin_shufflevector(best.cost, best.cost, 1, 0, 3, 2, 5, 4, 7, 6),
                __builtin_shufflevector(best.off_middle, best.off_middle, 1, 0, 3, 2, 5, 4, 7, 6),
                __builtin_shufflevector(best.left, best.left, 1, 0, 3, 2, 5, 4, 7, 6)});
  return {first_lane(half_areas(extents(front, front))), static_cast<uint32_t>(first_lane(best.left)), 0};
}

Split split_orders(const Box* boxes, const uint8_t* const* orders, uint32_t count) {
  // Four lanes per place, one per order: [4 (i - 1)]: areas of the first i boxes and of the others.
  alignas(32) float left[4 * (kMaxBoxes + 1)], right[4 * (kMaxBoxes + 1)];
  const uint8_t *const x = orders[0], *const y = orders[1], *const z = orders[2];
  const uint32_t last = count - 1;
  Float8 front_x = lanes(boxes[x[0]]), front_y = lanes(boxes[y[0]]), front_z = lanes(boxes[z[0]]);
  Float8 back_x = lanes(boxes[x[last]]), back_y = lanes(boxes[y[last]]), back_z = lanes(boxes[z[last]]);
  for (uint32_t i = 1; i < count; ++i) {
    const Float8 areas = half_areas(extents(front_x, back_x), extents(front_y, back_y), extents(front_z, back_z));
    store_halves(areas, left + 4 * (i - 1), right + 4 * (last - i));
    front_x = max_of(front_x, lanes(boxes[x[i]]));
    front_y = max_of(front_y, lanes(boxes[y[i]]));
    front_z = max_of(front_z, lanes(boxes[z[i]]));
    back_x = max_of(back_x, lanes(boxes[x[last - i]]));
    back_y = max_of(back_y, lanes(boxes[y[last - i]]));
    back_z = max_of(back_z, lanes(boxes[z[last - i]]));
  }
  for (uint32_t i = 4 * last; i < 4 * last + 4; ++i) left[i] = kInfinity, right[i] = 0.0f;
  Best best = kNone;
  const auto all = static_cast<float>(count);
  const Float8 counts = Float8{} + all;
  Float8 at{1, 1, 1, 1, 2, 2, 2, 2};
  for (uint32_t i = 0; i < last; i += 2, at += 2.0f)
    best.improve(load(left + 4 * i) * at + load(right + 4 * i) * (counts - at), at, counts);
  best.improve(best.exchanged());
  return best.first_best(first_lane(half_areas(extents(front_x, front_x)))); // lane 3 repeats lane 2
}

} // namespace
} // namespace packtrace::sweep_kernels
