#pragma once

#include "runtime/trace/packed/batch_strips.h"
#include "runtime/trace/packed/grid_ray.h"
#include "runtime/trace/packed/lanes_avx2.h"

/// What AVX-512 does better than eight lanes of AVX2.
namespace packtrace::packed {
namespace {

/// Bytes 16.. of a node into floats 1 + q / 2^15, by a choice among them and the bytes of constants: eight near planes of
/// an axis, then eight far ones. [far planes first][axis]
struct PlaneBytes {
  alignas(64) uint8_t from[2][3][64];
};

constexpr uint8_t kConstantBytes = 64; // from here on an index means the other operand

constexpr PlaneBytes plane_bytes() {
  PlaneBytes bytes{};
  for (uint32_t backward = 0; backward < 2; ++backward)
    for (uint32_t axis = 0; axis < 3; ++axis)
      for (uint32_t lane = 0; lane < 16; ++lane) {
        const bool high = (lane >= 8) != (backward != 0);
        uint8_t* at = bytes.from[backward][axis] + 4 * lane;
        at[0] = kConstantBytes; // 0x00
        at[1] = static_cast<uint8_t>(offsetof(baked::PackedNode, lo) - 16 + 8 * axis + lane % 8 + (high ? kBoundBytes : 0));
        at[2] = kConstantBytes + 2; // 0x80
        at[3] = kConstantBytes + 3; // 0x3f
      }
  return bytes;
}

constexpr PlaneBytes kPlaneBytes = plane_bytes();
constexpr float kPlaneUnit = 0x1p15f;

/// A ray for test_boxes(): vectors of x, y, z and nothing, twice, and twice the negated.
struct Avx512NodeRay {
  __m512i bytes[3];
  __m512 origin, inverse, bias, pad, tnear;

  explicit Avx512NodeRay(const GridRay& ray) {
    const __m512 sign = _mm512_castsi512_ps(
        _mm512_maskz_set1_epi32(static_cast<__mmask16>(0xff00), static_cast<int>(0x80000000u)));
    for (uint32_t axis = 0; axis < 3; ++axis)
      bytes[axis] = _mm512_load_si512(kPlaneBytes.from[ray.near_at[axis] >= kBoundBytes ? 1 : 0][axis]);
    const auto repeat = [](const float (&v)[3]) { return _mm512_broadcast_f32x4(_mm_setr_ps(v[0], v[1], v[2], 0.0f)); };
    origin = repeat(ray.origin);
    const __m512 plain = repeat(ray.inverse);
    inverse = _mm512_xor_ps(plain, sign);
    // The constant 1 in planes makes sums in which 2^15 planes cancel: their rounding is 2^-24 of those, or 2^-9 planes.
    bias = _mm512_fmadd_ps(_mm512_abs_ps(plain), _mm512_set1_ps(0x1p-22f), inverse);
    pad = repeat(ray.pad);
    tnear = _mm512_set1_ps(ray.tnear);
  }
};

/// As test_boxes() in node_test.h, all planes of an axis in one register: the far ones negated, so that the largest
/// parameter counts in both halves.
inline uint32_t test_boxes(const baked::PackedNode& node, const Avx512NodeRay& ray, float tmax, float (&entry)[8]) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(&node);
  const __m512i head = _mm512_broadcast_i32x4(_mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes)));
  const __m512 from_origin = _mm512_sub_ps(_mm512_cvtepi32_ps(head), ray.origin);
  const __m512 at = _mm512_fmsub_ps(from_origin, ray.inverse, ray.pad);
  const __m512i exponents = _mm512_and_si512(
      _mm512_srlv_epi32(_mm512_shuffle_epi32(head, _MM_PERM_DDDD),
                        _mm512_setr_epi32(0, 5, 10, 0, 0, 5, 10, 0, 0, 5, 10, 0, 0, 5, 10, 0)),
      _mm512_set1_epi32(31));
  const __m512 unit =
      _mm512_castsi512_ps(_mm512_slli_epi32(_mm512_add_epi32(exponents, _mm512_set1_epi32(127 + 15)), 23));
  const __m512 scale = _mm512_mul_ps(unit, ray.inverse);
  const __m512 bias = _mm512_fnmadd_ps(unit, ray.bias, at);
  const __m512i planes = _mm512_loadu_si512(bytes + 16);
  const __m512i constants = _mm512_set1_epi32(0x3f800000);
  const auto parameter = [&](const __m512i& from, __m512 axis_scale, __m512 axis_bias) {
    return _mm512_fmadd_ps(_mm512_castsi512_ps(_mm512_permutex2var_epi8(planes, from, constants)), axis_scale, axis_bias);
  };
  const __m512 limits = _mm512_mask_blend_ps(static_cast<__mmask16>(0xff00), ray.tnear, _mm512_set1_ps(-tmax));
  const __m512 x = parameter(ray.bytes[0], _mm512_permute_ps(scale, 0x00), _mm512_permute_ps(bias, 0x00));
  const __m512 y = parameter(ray.bytes[1], _mm512_permute_ps(scale, 0x55), _mm512_permute_ps(bias, 0x55));
  const __m512 z = parameter(ray.bytes[2], _mm512_permute_ps(scale, 0xaa), _mm512_permute_ps(bias, 0xaa));
  const __m512 latest = _mm512_max_ps(_mm512_max_ps(x, y), _mm512_max_ps(z, limits));
  const __m256 begin = _mm512_castps512_ps256(latest);
  const __m256 end = _mm256_xor_ps(_mm512_extractf32x8_ps(latest, 1), _mm256_set1_ps(-0.0f));
  _mm256_store_ps(entry, begin);
  return _mm256_cmp_ps_mask(begin, end, _CMP_LE_OQ);
}

/// The vertices of a batch's corners. Lanes behind them are 0.
inline __m512i batch_vertices(const TraceCluster& cluster, const BatchStrips& batch) {
  const uint32_t all = (1u << batch.corner_count) - 1, lead = (1u << batch.lead_count) - 1;
  const uint32_t named = all & ~lead & ~batch.fresh, width = index_bits(cluster);
  if (count_ones(uint64_t{named}) > 7) { // more than one 64-bit load holds
    alignas(64) uint32_t vertex[kBatchCorners];
    batch_vertices(cluster, batch, vertex);
    return _mm512_load_si512(vertex);
  }
  const __m512i iota = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m512i next = _mm512_add_epi32(iota, _mm512_set1_epi32(static_cast<int>(batch.first_fresh)));
  __m512i vertices = _mm512_maskz_expand_epi32(static_cast<__mmask16>(batch.fresh), next);
  const uint64_t fields =
      load64(cluster.bits + (batch.explicit_bit >> 3)) >> (batch.explicit_bit & 7u);
  const __m128i shifts = _mm_cvtsi64_si128(static_cast<int64_t>(0x0706050403020100u * uint64_t{width}));
  const __m128i bytes = _mm_multishift_epi64_epi8(shifts, _mm_cvtsi64_si128(static_cast<int64_t>(fields)));
  const __m512i names = _mm512_and_si512(_mm512_cvtepu8_epi32(bytes), _mm512_set1_epi32((1 << width) - 1));
  vertices = _mm512_mask_expand_epi32(vertices, static_cast<__mmask16>(named), names);
  if (lead != 0)
    vertices = _mm512_mask_mov_epi32(
        vertices, 3, _mm512_castsi128_si512(_mm_cvtsi64_si128(static_cast<int64_t>(batch.lead[0] | uint64_t{batch.lead[1]} << 32))));
  return vertices;
}

/// Positions of 16 vertices, along x, y and z.
inline void batch_positions(const TraceCluster& cluster, __m512i vertices, uint32_t count, __m512 (&position)[3]) {
  const uint32_t x_bits = cluster.position_bits[0], y_bits = cluster.position_bits[1], z_bits = cluster.position_bits[2];
  const __m512i bit = _mm512_add_epi32(
      _mm512_mullo_epi32(vertices, _mm512_set1_epi32(static_cast<int>(x_bits + y_bits + z_bits))),
      _mm512_set1_epi32(cluster.position_bit));
  const __m512i byte = _mm512_srli_epi32(bit, 3), within = _mm512_and_si512(bit, _mm512_set1_epi32(7));
  const auto words = [&](__m256i at, __m256i shift) {
    return _mm512_srlv_epi64(_mm512_i32gather_epi64(at, cluster.bits, 1), _mm512_cvtepu32_epi64(shift));
  };
  const __m512i first = words(_mm512_castsi512_si256(byte), _mm512_castsi512_si256(within));
  const __m512i second = count <= 8 ? first
                                    : words(_mm512_extracti64x4_epi64(byte, 1), _mm512_extracti64x4_epi64(within, 1));
  const __m512i low = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const __m512 scale = _mm512_castsi512_ps(_mm512_set1_epi32((127 - cluster.down) << 23));
  const auto axis = [&](uint32_t number, uint32_t bits, uint32_t skipped) {
    const __m128i skip = _mm_cvtsi32_si128(static_cast<int>(skipped));
    const __m512i value = _mm512_permutex2var_epi32(_mm512_srl_epi64(first, skip), low, _mm512_srl_epi64(second, skip));
    const __m512i field = _mm512_and_si512(value, _mm512_set1_epi32(static_cast<int>((uint64_t{1} << bits) - 1)));
    const __m512i point = _mm512_add_epi32(_mm512_sll_epi32(field, _mm_cvtsi32_si128(cluster.up)),
                                           _mm512_set1_epi32(cluster.base[number]));
    position[number] = _mm512_mul_ps(_mm512_cvtepi32_ps(point), scale);
  };
  axis(0, x_bits, 0);
  axis(1, y_bits, x_bits);
  axis(2, z_bits, x_bits + y_bits);
}

/// Decodes as many of `count` triangles from `first` on as fit; returns how many. See batch_triangle() for the corners.
inline uint32_t decode_batch_avx512(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
  BatchStrips batch;
  read_strips(cluster, first, count, batch);
  __m512 position[3];
  batch_positions(cluster, batch_vertices(cluster, batch), batch.corner_count, position);

  const __m256i up_to = _mm256_setr_epi32(1, 3, 7, 15, 31, 63, 127, 255);
  const __m256i restarts = _mm256_set1_epi32(static_cast<int>(batch.restarts)),
                lefts = _mm256_set1_epi32(static_cast<int>(batch.lefts)), one = _mm256_set1_epi32(1);
  const auto highest = [](__m256i word) { return _mm256_sub_epi32(_mm256_set1_epi32(31), _mm256_lzcnt_epi32(word)); };
  const __m256i a = highest(_mm256_andnot_si256(lefts, up_to));
  const __m256i b = highest(_mm256_and_si256(_mm256_or_si256(lefts, restarts), up_to));
  const __m256i ones = _mm256_popcnt_epi32(_mm256_and_si256(restarts, up_to));
  const __m256i newest =
      _mm256_add_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), _mm256_add_epi32(ones, ones));
  const __m256i at_a = _mm256_sub_epi32(_mm256_permutevar8x32_epi32(newest, a), one),
                at_b = _mm256_permutevar8x32_epi32(newest, b);
  const __m256i corner[3] = {_mm256_sub_epi32(at_a, _mm256_and_si256(_mm256_srlv_epi32(restarts, a), one)),
                             _mm256_sub_epi32(at_b, one), newest};
  for (uint32_t axis = 0; axis < 3; ++axis)
    for (uint32_t i = 0; i < 3; ++i)
      _mm256_store_ps(out.vertex[axis][i], _mm512_castps512_ps256(_mm512_permutexvar_ps(
                                               _mm512_castsi256_si512(corner[i]), position[axis])));
  return batch.count;
}

} // namespace
} // namespace packtrace::packed
