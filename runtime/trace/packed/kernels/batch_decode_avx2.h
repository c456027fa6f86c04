#pragma once

#include <immintrin.h>

#include "runtime/trace/packed/kernels/batch_corners.h"

/// Decodes a batch in AVX2 registers.
namespace packtrace::packed {
namespace {

/// Returns the vertex numbers of a batch's corners, a byte each; those of unused entries are 0.
inline __m128i batch_vertices(const TraceCluster& cluster, const BatchStrips& batch) {
  const uint32_t width = index_bits(cluster);
  if (count_ones(uint64_t{explicit_entries(batch)}) > kLoadedNumbers) {
    alignas(64) uint32_t vertex[kBatchCorners];
    batch_vertices(cluster, batch, vertex);
    const __m256i first = _mm256_load_si256(reinterpret_cast<const __m256i*>(vertex)),
                  second = _mm256_load_si256(reinterpret_cast<const __m256i*>(vertex + 8));
    const __m256i pairs = _mm256_permute4x64_epi64(_mm256_packus_epi32(first, second), 0xd8);
    return _mm_packus_epi16(_mm256_castsi256_si128(pairs), _mm256_extracti128_si256(pairs, 1));
  }
  const __m128i iota = _mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m128i bit = _mm_set1_epi64x(static_cast<int64_t>(0x8040201008040201u));
  const __m128i byte_of_entry = _mm_setr_epi8(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1);
  const __m128i bits = _mm_shuffle_epi8(_mm_cvtsi32_si128(static_cast<int>(batch.fresh)), byte_of_entry);
  const __m128i is_fresh = _mm_cmpeq_epi8(_mm_and_si128(bits, bit), bit);
  // Minus the number of fresh entries up to and including each entry.
  __m128i less = _mm_add_epi8(is_fresh, _mm_slli_si128(is_fresh, 1));
  less = _mm_add_epi8(less, _mm_slli_si128(less, 2));
  less = _mm_add_epi8(less, _mm_slli_si128(less, 4));
  less = _mm_add_epi8(less, _mm_slli_si128(less, 8));
  const __m128i fresh = _mm_sub_epi8(_mm_set1_epi8(static_cast<char>(batch.first_fresh - 1)), less);

  // Explicit numbers 0 to 3 are in the low, 4 to 7 in the high half of the register.
  const uint64_t fields = load_explicit_numbers(cluster, batch);
  const __m256i words = _mm256_inserti128_si256(_mm256_set1_epi32(static_cast<int>(static_cast<uint32_t>(fields))),
                                                _mm_set1_epi32(static_cast<int>(fields >> (4 * width))), 1);
  const __m256i shifts =
      _mm256_mullo_epi32(_mm256_setr_epi32(0, 1, 2, 3, 0, 1, 2, 3), _mm256_set1_epi32(static_cast<int>(width)));
  const __m256i names = _mm256_and_si256(_mm256_srlv_epi32(words, shifts), _mm256_set1_epi32((1 << width) - 1));
  const __m128i name_bytes = _mm_packus_epi16(
      _mm_packus_epi32(_mm256_castsi256_si128(names), _mm256_extracti128_si256(names, 1)), _mm_setzero_si128());
  const __m128i name = _mm_add_epi8(_mm_sub_epi8(iota, _mm_set1_epi8(static_cast<char>(batch.lead_count))), less);

  __m128i vertices = _mm_blendv_epi8(_mm_shuffle_epi8(name_bytes, name), fresh, is_fresh);
  if (batch.lead_count != 0)
    vertices = _mm_insert_epi16(vertices, static_cast<int16_t>(batch.lead[0] | batch.lead[1] << 8), 0);
  return _mm_and_si128(vertices, _mm_cmpgt_epi8(_mm_set1_epi8(static_cast<char>(batch.corner_count)), iota));
}

/// Computes the positions of eight vertices in the tree's grid, one vector per axis.
/// @param vertices their numbers
inline void vertex_positions(const TraceCluster& cluster, __m256i vertices, __m256 (&position)[3]) {
  const uint32_t x_bits = cluster.position_bits[0], y_bits = cluster.position_bits[1],
                 z_bits = cluster.position_bits[2];
  const __m256i bit =
      _mm256_add_epi32(_mm256_mullo_epi32(vertices, _mm256_set1_epi32(static_cast<int>(x_bits + y_bits + z_bits))),
                       _mm256_set1_epi32(cluster.position_bit));
  const __m256i byte = _mm256_srli_epi32(bit, 3), within = _mm256_and_si256(bit, _mm256_set1_epi32(7));
  // Vertices 0, 1, 4, 5 and 2, 3, 6, 7, so that a shuffle within 128 bits restores their order.
  const auto words = [&](__m128i at, __m128i shift) {
    return _mm256_srlv_epi64(_mm256_i32gather_epi64(reinterpret_cast<const long long*>(cluster.bits), at, 1),
                             _mm256_cvtepu32_epi64(shift));
  };
  const __m128i byte_low = _mm256_castsi256_si128(byte), byte_high = _mm256_extracti128_si256(byte, 1);
  const __m128i within_low = _mm256_castsi256_si128(within), within_high = _mm256_extracti128_si256(within, 1);
  const __m256i first = words(_mm_unpacklo_epi64(byte_low, byte_high), _mm_unpacklo_epi64(within_low, within_high));
  const __m256i second = words(_mm_unpackhi_epi64(byte_low, byte_high), _mm_unpackhi_epi64(within_low, within_high));
  const __m256 scale = _mm256_castsi256_ps(_mm256_set1_epi32((127 - cluster.down) << 23));
  const auto axis = [&](uint32_t number, uint32_t bits, uint32_t skipped) {
    const __m128i skip = _mm_cvtsi32_si128(static_cast<int>(skipped));
    const __m256i value = _mm256_castps_si256(_mm256_shuffle_ps(
        _mm256_castsi256_ps(_mm256_srl_epi64(first, skip)), _mm256_castsi256_ps(_mm256_srl_epi64(second, skip)), 0x88));
    const __m256i field = _mm256_and_si256(value, _mm256_set1_epi32(static_cast<int>((uint64_t{1} << bits) - 1)));
    const __m256i point = _mm256_add_epi32(_mm256_sll_epi32(field, _mm_cvtsi32_si128(cluster.up)),
                                           _mm256_set1_epi32(cluster.base[number]));
    position[number] = _mm256_mul_ps(_mm256_cvtepi32_ps(point), scale);
  };
  axis(0, x_bits, 0);
  axis(1, y_bits, x_bits);
  axis(2, z_bits, x_bits + y_bits);
}

/// Returns the highest set bits of positive numbers below 2^24: their exponents as floats.
inline __m256i highest_bits(__m256i words) {
  return _mm256_sub_epi32(_mm256_srli_epi32(_mm256_castps_si256(_mm256_cvtepi32_ps(words)), 23),
                          _mm256_set1_epi32(127));
}

/// Returns how many bits are set in each of eight numbers below 256.
inline __m256i count_bits(__m256i words) {
  const __m256i of_four_bits =
      _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
  return _mm256_add_epi32(_mm256_shuffle_epi8(of_four_bits, _mm256_and_si256(words, _mm256_set1_epi32(15))),
                          _mm256_shuffle_epi8(of_four_bits, _mm256_srli_epi32(words, 4)));
}

/// Decodes triangles from `first` on, as many of `count` as fit into a batch; returns their number.
inline uint32_t decode_batch_avx2(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
  BatchStrips batch;
  read_strips(cluster, first, count, batch);
  const __m128i vertices = batch_vertices(cluster, batch);
  __m256i corner[3];
  batch_corners(batch, highest_bits, count_bits, corner);
  __m256 low[3], high[3];
  vertex_positions(cluster, _mm256_cvtepu8_epi32(vertices), low);
  if (batch.corner_count <= 8) {
    // Lanes beyond the batch's triangles may name entries beyond 7, of which the permutation uses the low three bits.
    for (uint32_t axis = 0; axis < 3; ++axis)
      for (uint32_t i = 0; i < 3; ++i)
        _mm256_store_ps(out.vertex[axis][i], _mm256_permutevar8x32_ps(low[axis], corner[i]));
    return batch.count;
  }
  vertex_positions(cluster, _mm256_cvtepu8_epi32(_mm_srli_si128(vertices, 8)), high);
  for (uint32_t axis = 0; axis < 3; ++axis)
    for (uint32_t i = 0; i < 3; ++i) {
      const __m256 in_high = _mm256_castsi256_ps(_mm256_slli_epi32(corner[i], 28)); // bit 3 as the sign
      _mm256_store_ps(out.vertex[axis][i], _mm256_blendv_ps(_mm256_permutevar8x32_ps(low[axis], corner[i]),
                                                            _mm256_permutevar8x32_ps(high[axis], corner[i]), in_high));
    }
  return batch.count;
}

} // namespace
} // namespace packtrace::packed
