#pragma once

#include <immintrin.h>

#include "runtime/trace/packed/kernels/batch_strips.h"

namespace packtrace::packed {
namespace {

/// Returns the corners of a batch's triangles as entries of its corner list, a triangle per lane. batch_triangle()
/// explains how they are found.
/// @param highest_bit function of eight nonzero numbers below 256 that returns their highest set bits
/// @param count_bits function of eight numbers below 256 that returns how many bits are set in each
template <typename HighestBit, typename CountBits>
inline void batch_corners(const BatchStrips& batch, HighestBit highest_bit, CountBits count_bits,
                          __m256i (&corner)[3]) {
  const __m256i up_to = _mm256_setr_epi32(1, 3, 7, 15, 31, 63, 127, 255), one = _mm256_set1_epi32(1);
  const __m256i restarts = _mm256_set1_epi32(static_cast<int>(batch.restarts)),
                lefts = _mm256_set1_epi32(static_cast<int>(batch.lefts));
  const __m256i a = highest_bit(_mm256_andnot_si256(lefts, up_to));
  const __m256i b = highest_bit(_mm256_and_si256(_mm256_or_si256(lefts, restarts), up_to));
  const __m256i ones = count_bits(_mm256_and_si256(restarts, up_to));
  const __m256i newest = _mm256_add_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), _mm256_add_epi32(ones, ones));
  const __m256i at_a = _mm256_sub_epi32(_mm256_permutevar8x32_epi32(newest, a), one),
                at_b = _mm256_permutevar8x32_epi32(newest, b);
  corner[0] = _mm256_sub_epi32(at_a, _mm256_and_si256(_mm256_srlv_epi32(restarts, a), one));
  corner[1] = _mm256_sub_epi32(at_b, one);
  corner[2] = newest;
}

} // namespace
} // namespace packtrace::packed
