#pragma once

#include <immintrin.h>

#include "runtime/trace/packed/kernels/batch_corners.h"

/// Decodes a batch in AVX-512 registers.
namespace packtrace::packed {
namespace {

/// Returns the vertex numbers of a batch's corners; unused lanes are 0.
inline __m512i batch_vertices(const TraceCluster& cluster, const BatchStrips& batch) {
  const uint32_t named = explicit_entries(batch), width = index_bits(cluster);
  if (count_ones(uint64_t{named}) > kLoadedNumbers) {
    alignas(64) uint32_t vertex[kBatchCorners];
    batch_vertices(cluster, batch, vertex);
    return _mm512_load_si512(vertex);
  }
  const __m512i iota = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m512i next = _mm512_add_epi32(iota, _mm512_set1_epi32(static_cast<int>(batch.first_fresh)));
  __m512i vertices = _mm512_maskz_expand_epi32(static_cast<__mmask16>(batch.fresh), next);
  const uint64_t fields = load_explicit_numbers(cluster, batch);
  const __m128i shifts = _mm_cvtsi64_si128(static_cast<int64_t>(0x0706050403020100u * uint64_t{width}));
  const __m128i bytes = _mm_multishift_epi64_epi8(shifts, _mm_cvtsi64_si128(static_cast<int64_t>(fields)));
  const __m512i names = _mm512_and_si512(_mm512_cvtepu8_epi32(bytes), _mm512_set1_epi32((1 << width) - 1));
  vertices = _mm512_mask_expand_epi32(vertices, static_cast<__mmask16>(named), names);
  if (batch.lead_count != 0)
    vertices = _mm512_mask_mov_epi32(
        vertices, 3,
        _mm512_castsi128_si512(_mm_cvtsi64_si128(static_cast<int64_t>(batch.lead[0] | uint64_t{batch.lead[1]} << 32))));
  return vertices;
}

/// Computes the positions of up to 16 vertices in the tree's grid, one vector per axis.
/// @param count number of vertices; lanes beyond it are arbitrary
inline void batch_positions(const TraceCluster& cluster, __m512i vertices, uint32_t count, __m512 (&position)[3]) {
  const uint32_t x_bits = cluster.position_bits[0], y_bits = cluster.position_bits[1],
                 z_bits = cluster.position_bits[2];
  const __m512i bit =
      _mm512_add_epi32(_mm512_mullo_epi32(vertices, _mm512_set1_epi32(static_cast<int>(x_bits + y_bits + z_bits))),
                       _mm512_set1_epi32(cluster.position_bit));
  const __m512i byte = _mm512_srli_epi32(bit, 3), within = _mm512_and_si512(bit, _mm512_set1_epi32(7));
  const auto words = [&](__m256i at, __m256i shift) {
    return _mm512_srlv_epi64(_mm512_i32gather_epi64(at, cluster.bits, 1), _mm512_cvtepu32_epi64(shift));
  };
  const __m512i first = words(_mm512_castsi512_si256(byte), _mm512_castsi512_si256(within));
  const __m512i second =
      count <= 8 ? first : words(_mm512_extracti64x4_epi64(byte, 1), _mm512_extracti64x4_epi64(within, 1));
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

/// Decodes triangles from `first` on, as many of `count` as fit into a batch; returns their number.
inline uint32_t decode_batch_avx512(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
  BatchStrips batch;
  read_strips(cluster, first, count, batch);
  __m512 position[3];
  batch_positions(cluster, batch_vertices(cluster, batch), batch.corner_count, position);

  const auto highest = [](__m256i word) { return _mm256_sub_epi32(_mm256_set1_epi32(31), _mm256_lzcnt_epi32(word)); };
  const auto ones = [](__m256i word) { return _mm256_popcnt_epi32(word); };
  __m256i corner[3];
  batch_corners(batch, highest, ones, corner);
  for (uint32_t axis = 0; axis < 3; ++axis)
    for (uint32_t i = 0; i < 3; ++i)
      _mm256_store_ps(out.vertex[axis][i],
                      _mm512_castps512_ps256(_mm512_permutexvar_ps(_mm512_castsi256_si512(corner[i]), position[axis])));
  return batch.count;
}

} // namespace
} // namespace packtrace::packed
