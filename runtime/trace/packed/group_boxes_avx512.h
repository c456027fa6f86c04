#pragma once

#include <immintrin.h>

#include "runtime/trace/packed/group_boxes.h"

/// The same with all planes of an axis in one register: eight near ones, then eight far ones, negated, so that the
/// largest parameter counts in both halves.
namespace packtrace::packed {
namespace {

struct Avx512GroupBoxes {
  __m512 plane[3];

  Avx512GroupBoxes(const baked::PackedNode& node, const uint32_t (&near_at)[3]) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&node);
    const uint8_t* bounds = bytes + offsetof(baked::PackedNode, lo);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t exponent = (uint32_t{node.exponents} >> (5 * axis)) & 31u;
      int32_t origin;
      __builtin_memcpy(&origin, bytes + 4 * axis, sizeof origin);
      const __m128i near = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(bounds + near_at[axis]));
      const __m128i far =
          _mm_loadl_epi64(reinterpret_cast<const __m128i*>(bounds + 16 * axis + kBoundBytes - near_at[axis]));
      const __m512 q = _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_unpacklo_epi64(near, far)));
      const __m512 unit = _mm512_castsi512_ps(_mm512_set1_epi32(static_cast<int>((exponent + 127u) << 23)));
      plane[axis] = negate_far(_mm512_fmadd_ps(q, unit, _mm512_set1_ps(static_cast<float>(origin))));
    }
  }

  Avx512GroupBoxes(const TopNode& node, const uint32_t (&near_at)[3]) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool forward = near_at[axis] < kBoundBytes;
      const __m256 near = _mm256_load_ps(forward ? node.lo[axis] : node.hi[axis]);
      const __m256 far = _mm256_load_ps(forward ? node.hi[axis] : node.lo[axis]);
      plane[axis] = negate_far(_mm512_insertf32x8(_mm512_castps256_ps512(near), far, 1));
    }
  }

private:
  static __m512 negate_far(__m512 planes) {
    const __m512i sign = _mm512_inserti64x4(_mm512_setzero_si512(), _mm256_set1_epi32(static_cast<int>(0x80000000u)), 1);
    return _mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(planes), sign));
  }
};

struct alignas(64) Avx512GroupRay {
  float limits[16]; ///< eight times tnear, then -tmax
  float bias[3][16];
  float inverse[3];

  void set(const GridRay& ray) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const float back = ray.origin[axis] * ray.inverse[axis];
      inverse[axis] = ray.inverse[axis];
      _mm256_store_ps(bias[axis], _mm256_set1_ps(-back - ray.pad[axis]));
      _mm256_store_ps(bias[axis] + 8, _mm256_set1_ps(back - ray.pad[axis]));
    }
    _mm256_store_ps(limits, _mm256_set1_ps(ray.tnear));
    set_tmax(ray.tmax);
  }
  void set_tmax(float t) { _mm256_store_ps(limits + 8, _mm256_set1_ps(-t)); }
};

struct Avx512ChildRays {
  __m512i rays = _mm512_setzero_si512();

  void add(const Avx512GroupBoxes& boxes, const Avx512GroupRay& ray, uint32_t number) {
    const auto parameter = [&](uint32_t axis) {
      return _mm512_fmadd_ps(boxes.plane[axis], _mm512_set1_ps(ray.inverse[axis]), _mm512_load_ps(ray.bias[axis]));
    };
    const __m512 latest = _mm512_max_ps(_mm512_max_ps(parameter(0), parameter(1)),
                                        _mm512_max_ps(parameter(2), _mm512_load_ps(ray.limits)));
    // begin <= end, that is begin + -end <= 0: the sign of a sum is exact.
    const __m256 sum = _mm256_add_ps(_mm512_castps512_ps256(latest), _mm512_extractf32x8_ps(latest, 1));
    const __mmask8 hit = _mm256_cmp_ps_mask(sum, _mm256_setzero_ps(), _CMP_LE_OQ);
    rays = _mm512_mask_or_epi64(rays, hit, rays, _mm512_set1_epi64(static_cast<int64_t>(uint64_t{1} << number)));
  }

  static void enter(const Avx512GroupBoxes& boxes, const Avx512GroupRay& ray, float (&t)[baked::kNodeWidth]) {
    const auto at = [&](uint32_t axis) {
      return _mm256_fmadd_ps(_mm512_castps512_ps256(boxes.plane[axis]), _mm256_set1_ps(ray.inverse[axis]),
                             _mm256_load_ps(ray.bias[axis]));
    };
    _mm256_storeu_ps(t, _mm256_max_ps(_mm256_max_ps(at(0), at(1)), at(2)));
  }

  uint32_t read(uint64_t (&out)[baked::kNodeWidth]) const {
    _mm512_storeu_si512(out, rays);
    return _mm512_test_epi64_mask(rays, rays);
  }
};

} // namespace
} // namespace packtrace::packed
