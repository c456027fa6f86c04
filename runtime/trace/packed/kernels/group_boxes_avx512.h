#pragma once

#include <immintrin.h>

#include "runtime/trace/packed/kernels/beam.h"
#include "runtime/trace/packed/kernels/group_bounds.h"

/// The tests of group_boxes.h with all planes of an axis in one register: per child the near plane and the negated far
/// plane, so that a maximum narrows both ends of an interval.
namespace packtrace::packed {
namespace {

struct Avx512GroupBoxes {
  __m512 plane[3];

  [[gnu::always_inline]] Avx512GroupBoxes(const baked::PackedNode& node, uint32_t octant) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const NodeAxis at(node, axis, ((octant >> axis) & 1u) != 0);
      const __m128i near = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(at.near));
      const __m128i far = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(at.far));
      const __m512 q = _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_unpacklo_epi8(near, far)));
      plane[axis] = negate_far(_mm512_fmadd_ps(q, _mm512_set1_ps(at.unit), _mm512_set1_ps(at.origin)));
    }
  }

  /// See GroupBoxes::enlarge().
  void enlarge(float pad, uint32_t octant) {
    for (uint32_t axis = 0; axis < 3; ++axis)
      plane[axis] = _mm512_sub_ps(plane[axis], _mm512_set1_ps(((octant >> axis) & 1u) != 0 ? -pad : pad));
  }

  [[gnu::always_inline]] Avx512GroupBoxes(const TopNode& node, uint32_t octant) {
    const __m512i pairs = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool backward = ((octant >> axis) & 1u) != 0;
      const __m256 near = _mm256_load_ps(backward ? node.hi[axis] : node.lo[axis]);
      const __m256 far = _mm256_load_ps(backward ? node.lo[axis] : node.hi[axis]);
      plane[axis] =
          negate_far(_mm512_permutex2var_ps(_mm512_castps256_ps512(near), pairs, _mm512_castps256_ps512(far)));
    }
  }

private:
  static __m512 negate_far(__m512 planes) {
    return _mm512_castsi512_ps(
        _mm512_xor_si512(_mm512_castps_si512(planes), _mm512_set1_epi64(static_cast<int64_t>(uint64_t{1} << 63))));
  }
};

inline __m512 both(const float (&two)[2]) {
  double pair;
  __builtin_memcpy(&pair, two, sizeof pair);
  return _mm512_castpd_ps(_mm512_set1_pd(pair));
}

/// Returns the children with begin <= end, as a bit mask; `pairs` holds begin and -end per child. The sign of the sum
/// begin + -end is exact, and both halves of a 64-bit lane hold the sum.
inline __mmask8 begin_before_end(__m512 pairs) {
  const __m512 sum = _mm512_add_ps(pairs, _mm512_permute_ps(pairs, 0xb1));
  return _mm512_cmple_epi64_mask(_mm512_castps_si512(sum), _mm512_setzero_si512());
}

/// Returns the first element of each pair.
inline __m256 firsts(__m512 pairs) {
  return _mm512_castps512_ps256(
      _mm512_permutexvar_ps(_mm512_castsi256_si512(_mm256_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14)), pairs));
}

/// See the overload for GroupBoxes.
inline uint32_t pass_group_bounds(const Avx512GroupBoxes& boxes, const GroupBounds& reach) {
  const __m512 most_pad = both(reach.pad);
  const auto beyond = [&](uint32_t axis) {
    const __m512 plane = boxes.plane[axis], sign = _mm512_set1_ps(reach.sign[axis]);
    const __m512 less = _mm512_mul_ps(_mm512_add_ps(plane, _mm512_permute_ps(plane, 0xb1)), sign); // -extent
    const __m512 extent = _mm512_sub_ps(_mm512_set1_ps(-reach.flat), less);
    const __m512 pad = _mm512_min_ps(
        _mm512_max_ps(_mm512_mul_ps(extent, _mm512_set1_ps(kExtentScale)), _mm512_setzero_ps()), most_pad);
    return _mm512_fmadd_ps(plane, sign, _mm512_sub_ps(both(reach.shift[axis]), pad));
  };
  const __m512 most = _mm512_max_ps(_mm512_max_ps(beyond(0), beyond(1)), beyond(2));
  const __m512 most_of_pair = _mm512_max_ps(most, _mm512_permute_ps(most, 0xb1));
  return _mm512_cmple_epi64_mask(_mm512_castps_si512(most_of_pair), _mm512_setzero_si512());
}

/// See the overload for GroupBoxes.
inline uint32_t pass_beam(const Avx512GroupBoxes& boxes, const Beam& beam, float (&t)[baked::kNodeWidth]) {
  __m512 latest = both(beam.limits);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const __m512 distance = _mm512_sub_ps(boxes.plane[axis], both(beam.origin[axis]));
    latest = _mm512_max_ps(latest, _mm512_min_ps(_mm512_mul_ps(distance, _mm512_set1_ps(beam.inverse[axis][0])),
                                                 _mm512_mul_ps(distance, _mm512_set1_ps(beam.inverse[axis][1]))));
  }
  _mm256_storeu_ps(t, firsts(latest));
  return begin_before_end(latest);
}

inline void read_planes(const Avx512GroupBoxes& boxes, BoxPlanes& planes) {
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const __m512 swapped = _mm512_permute_ps(boxes.plane[axis], 0xb1);
    _mm256_storeu_ps(planes.near[axis], firsts(boxes.plane[axis]));
    _mm256_storeu_ps(planes.far[axis], _mm256_xor_ps(firsts(swapped), _mm256_set1_ps(-0.0f)));
  }
}

/// The 64 single-bit masks.
struct BitTable {
  uint64_t bit[64];
  constexpr BitTable() : bit{} {
    for (uint32_t i = 0; i < 64; ++i) bit[i] = uint64_t{1} << i;
  }
};
alignas(64) constexpr BitTable kBits;

struct Avx512ChildRays {
  [[gnu::always_inline]] static uint32_t pass(const Avx512GroupBoxes& boxes, const BoxRays& group, uint64_t rays,
                                              uint64_t (&out)[baked::kNodeWidth]) {
    __m512i by_child = _mm512_setzero_si512();
    for (; rays != 0; rays &= rays - 1) {
      const auto ray = static_cast<uint32_t>(__builtin_ctzll(rays));
      by_child = _mm512_mask_or_epi64(by_child, pass_boxes(boxes, group, ray), by_child,
                                      _mm512_set1_epi64(static_cast<int64_t>(kBits.bit[ray])));
    }
    _mm512_storeu_si512(out, by_child);
    return _mm512_test_epi64_mask(by_child, by_child);
  }

  static void enter(const Avx512GroupBoxes& boxes, const BoxRays& group, uint32_t ray, float (&t)[baked::kNodeWidth]) {
    const auto at = [&](uint32_t axis) {
      return _mm512_fmadd_ps(boxes.plane[axis], _mm512_set1_ps(group.inverse[axis][ray]),
                             _mm512_set1_ps(group.bias[axis][ray][0]));
    };
    const __m512 begin = _mm512_max_ps(_mm512_max_ps(at(0), at(1)), at(2));
    _mm256_storeu_ps(t, firsts(begin));
  }

private:
  static __mmask8 pass_boxes(const Avx512GroupBoxes& boxes, const BoxRays& group, uint32_t ray) {
    const auto parameter = [&](uint32_t axis) {
      return _mm512_fmadd_ps(boxes.plane[axis], _mm512_set1_ps(group.inverse[axis][ray]), both(group.bias[axis][ray]));
    };
    const __m512 latest =
        _mm512_max_ps(_mm512_max_ps(parameter(0), parameter(1)), _mm512_max_ps(parameter(2), both(group.limits[ray])));
    return begin_before_end(latest);
  }
};

} // namespace
} // namespace packtrace::packed
