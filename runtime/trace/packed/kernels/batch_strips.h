#pragma once

#include <cstdint>

#include "compress/format/layout/bit_fields.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

/// Finds the corners of a batch's triangles from the bits of the cluster's strips
/// (compress/format/cluster/index_codec.h), without walking from triangle to triangle.
namespace packtrace::packed {
namespace {

inline uint32_t count_ones(uint64_t word) { return static_cast<uint32_t>(__builtin_popcountll(word)); }

/// Number of set bits in [bit, bit + count).
inline uint32_t count_ones(const uint8_t* bits, uint32_t bit, uint32_t count) {
  const uint8_t* p = bits + (bit >> 3);
  uint32_t end = (bit & 7u) + count, ones = 0;
  uint64_t word = load64(p) & (~uint64_t{0} << (bit & 7u));
  for (; end >= 64; end -= 64, p += 8, word = load64(p)) ones += count_ones(word);
  return ones + count_ones(word & ((uint64_t{1} << end) - 1));
}

/// Returns the offset from `bit` of the highest set bit in [bit, bit + count), or -1 if there is none. If `zeros` is
/// all ones, it looks for a zero bit instead.
inline int32_t last_one(const uint8_t* bits, uint32_t bit, uint32_t count, uint64_t zeros) {
  while (count > 0) {
    const uint32_t step = count < 57 ? count : 57;
    count -= step;
    const uint64_t word = (read_bits(bits, bit + count, step) ^ zeros) & ((uint64_t{1} << step) - 1);
    if (word != 0) return static_cast<int32_t>(count) + 63 - __builtin_clzll(word);
  }
  return -1;
}

/// A batch's own corner list. The list treats the batch's first triangle as the beginning of a strip, so its first
/// three entries are that triangle's corners wherever the triangle lies in its strip. Bits of the masks, from bit 0 on,
/// stand for the batch's triangles or for the list's entries.
struct BatchStrips {
  uint32_t count;        ///< number of triangles
  uint32_t restarts;     ///< triangles that begin a strip; bit 0 is set
  uint32_t lefts;        ///< triangles reached by a left turn; bit 0 is clear
  uint32_t corner_count; ///< number of entries of the list, <= kBatchCorners
  uint32_t lead_count;   ///< 2 if the first two entries are lead[], else 0
  uint32_t lead[2];      ///< vertex numbers of the first two entries
  uint32_t fresh;        ///< entries that name a new vertex, counted up from first_fresh; bits below lead_count are 0
  uint32_t first_fresh;  ///< vertex number of the first fresh entry
  uint32_t explicit_bit; ///< first bit of the explicit vertex numbers of the other entries
};

inline uint32_t index_bits(const TraceCluster& cluster) { return uint32_t{cluster.flags} >> kIndexBitsShift; }

/// Returns the vertex number of one entry of the cluster's corner list.
inline uint32_t corner_vertex(const TraceCluster& cluster, uint32_t corner) {
  const uint32_t fresh_bit = 2u * cluster.triangle_count;
  const uint32_t rank = count_ones(cluster.bits, fresh_bit, corner);
  if (read_bits(cluster.bits, fresh_bit + corner, 1) != 0) return rank;
  const uint32_t explicit_bit = fresh_bit + cluster.triangle_count + 2u * cluster.strip_count;
  return static_cast<uint32_t>(
      read_bits(cluster.bits, explicit_bit + (corner - rank) * index_bits(cluster), index_bits(cluster)));
}

/// Returns the vertex numbers of the first two corners of a triangle that does not begin a strip.
/// @param corner entry of the triangle's newest vertex in the cluster's corner list
inline void lead_corners(const TraceCluster& cluster, uint32_t triangle, uint32_t corner, uint32_t lead[2]) {
  const uint8_t* bits = cluster.bits;
  const uint32_t left_bit = cluster.triangle_count;
  const auto first = static_cast<uint32_t>(last_one(bits, 0, triangle + 1, 0)); // first triangle of the strip
  const bool left = read_bits(bits, left_bit + triangle, 1) != 0;
  // One of the two corners is the previous entry. The other one was last replaced at the strip's last turn to the other
  // side, by the entry just before that turn's entry. Without such a turn it is one of the strip's first two corners.
  const int32_t turn = last_one(bits, left_bit + first + 1, triangle - first, left ? ~uint64_t{0} : 0);
  const uint32_t first_corner = corner - (triangle - first); // entry of the newest vertex of the strip's first triangle
  const uint32_t kept = turn >= 0 ? first_corner + static_cast<uint32_t>(turn) : first_corner - (left ? 2u : 1u);
  const uint32_t vertex = corner_vertex(cluster, kept), previous = corner_vertex(cluster, corner - 1);
  lead[0] = left ? vertex : previous;
  lead[1] = left ? previous : vertex;
}

/// Reads the batch that begins with triangle `first` and has as many of `count` triangles as fit.
inline void read_strips(const TraceCluster& cluster, uint32_t first, uint32_t count, BatchStrips& batch) {
  const uint8_t* bits = cluster.bits;
  const uint32_t triangle_count = cluster.triangle_count;
  count = count < kBatch ? count : kBatch;
  uint32_t restarts = static_cast<uint32_t>(read_bits(bits, first, count));
  const bool begins = (restarts & 1u) != 0;
  restarts |= 1u;
  while (count + 2 * count_ones(restarts & ((1u << count) - 1)) > kBatchCorners) --count;
  restarts &= (1u << count) - 1;
  batch.count = count;
  batch.restarts = restarts;
  batch.lefts = static_cast<uint32_t>(read_bits(bits, triangle_count + first, count)) & ~1u;
  batch.corner_count = count + 2 * count_ones(restarts);
  batch.lead_count = begins ? 0 : 2;

  // The cluster's entry of the list's first entry, or of the one after lead[].
  uint32_t corner = first + 2 * count_ones(bits, 0, first);
  if (!begins) lead_corners(cluster, first, corner, batch.lead);
  const uint32_t fresh_bit = 2 * triangle_count;
  const uint32_t rank = count_ones(bits, fresh_bit, corner);
  batch.first_fresh = rank;
  batch.fresh = static_cast<uint32_t>(read_bits(bits, fresh_bit + corner, batch.corner_count - batch.lead_count))
                << batch.lead_count;
  batch.explicit_bit = fresh_bit + triangle_count + 2u * cluster.strip_count + (corner - rank) * index_bits(cluster);
}

/// A triangle's corners as entries of the batch's corner list.
struct BatchTriangle {
  uint32_t corner[3];
};

inline uint32_t highest_bit(uint32_t word) { return 31u - static_cast<uint32_t>(__builtin_clz(word)); }

/// Returns the corners of triangle i. Its newest corner is entry i + 2 (restarts up to and including i). Its first
/// corner was set by the last right turn and its second by the last left turn, or each by the beginning of the strip.
inline BatchTriangle batch_triangle(const BatchStrips& batch, uint32_t i) {
  const uint32_t up_to = (2u << i) - 1;
  const auto newest = [&](uint32_t j) { return j + 2 * count_ones(batch.restarts & ((2u << j) - 1)); };
  const uint32_t a = highest_bit(~batch.lefts & up_to), b = highest_bit((batch.lefts | batch.restarts) & up_to);
  return {{newest(a) - 1 - ((batch.restarts >> a) & 1u), newest(b) - 1, newest(i)}};
}

/// Returns the entries of the corner list that have explicit vertex numbers, as a bit mask.
inline uint32_t explicit_entries(const BatchStrips& batch) {
  return ((1u << batch.corner_count) - 1) & ~((1u << batch.lead_count) - 1) & ~batch.fresh;
}

/// As many explicit vertex numbers as one 64-bit load holds at any bit.
constexpr uint32_t kLoadedNumbers = 7;

/// Returns a word with the first kLoadedNumbers explicit vertex numbers, from bit 0 on.
inline uint64_t load_explicit_numbers(const TraceCluster& cluster, const BatchStrips& batch) {
  return load64(cluster.bits + (batch.explicit_bit >> 3)) >> (batch.explicit_bit & 7u);
}

/// Computes the vertex number of each corner of the batch; unused entries are 0.
inline void batch_vertices(const TraceCluster& cluster, const BatchStrips& batch, uint32_t vertex[kBatchCorners]) {
  uint32_t fresh = batch.first_fresh, explicit_bit = batch.explicit_bit;
  const uint32_t width = index_bits(cluster);
  for (uint32_t i = 0; i < kBatchCorners; ++i) {
    if (i >= batch.corner_count) {
      vertex[i] = 0;
    } else if (i < batch.lead_count) {
      vertex[i] = batch.lead[i];
    } else if (((batch.fresh >> i) & 1u) != 0) {
      vertex[i] = fresh++;
    } else {
      vertex[i] = static_cast<uint32_t>(read_bits(cluster.bits, explicit_bit, width));
      explicit_bit += width;
    }
  }
}

} // namespace
} // namespace packtrace::packed
