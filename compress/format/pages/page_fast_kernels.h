#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "compress/format/cluster/index_codec.h"
#include "compress/format/pages/page_fast.h"

namespace packtrace::page_fast {

/// Kernels read and write whole words, so parts and arrays need this much unused space behind them.
inline constexpr size_t kPartSlackBytes = 64;
inline constexpr size_t kSpareWords = 8;

/// Working memory for one cluster. Bits are expanded to one byte each.
struct WalkMemory {
  using Words = std::array<uint64_t, kMaxClusterVertices + kSpareWords>;

  std::array<uint8_t, kMaxClusterTriangles + kSpareWords> left{};
  std::array<uint8_t, kMaxClusterCorners + kSpareWords> fresh{};
  std::array<uint8_t, kMaxClusterVertices + kSpareWords> crease{}; ///< by vertex
  std::array<uint8_t, kMaxClusterCorners + kMaxClusterVertices + kSpareWords> reused_vertices{};
  std::array<uint8_t, kMaxClusterCorners + kSpareWords> explicits{}; ///< vertices of the corners that are not fresh
  std::array<Words, kChannels> residuals{};                          ///< by vertex: difference to its prediction
  std::array<Words, kChannels> words{};
};

struct WalkInput {
  const uint8_t* runs = nullptr; ///< triangle count of each strip; the sum is at most 128
  uint32_t run_count = 0;
  std::array<bool, kChannels> has{}; ///< channels of the cluster; positions are always present
  bool creases = false;              ///< `crease` is valid, and reused_vertices[] also holds the originals of creases
};

/// Writes bit i as byte i (0 or 1) for i < count, and zeroes up to 7 bytes behind. Returns the number of ones.
uint32_t expand_bits(const uint8_t* bits, uint32_t count, uint8_t* out);

/// Prefix sums, modulo 256, of zigzag differences.
void sum_reused_vertices(const uint8_t* differences, uint32_t count, uint8_t* out);

/// Place of the residuals of one field.
struct FieldCode {
  const uint8_t* bytes = nullptr;    ///< high bytes, above the low bits
  uint32_t low_bits = 0, low_at = 0; ///< width and offset within the low bits of a vertex
  uint32_t shift = 0;                ///< bit offset of the field in its word
};

/// Place of the residuals of one channel. The low bits of all its fields are stored together per vertex.
struct ChannelCode {
  uint32_t field_count = 0;         ///< 1..3
  FieldCode fields[kChannelFields]; ///< not std::array, whose functions are inline
  const uint8_t* low = nullptr;
  uint64_t low_bit = 0;    ///< first of the low bits
  uint32_t low_stride = 0; ///< low bits per vertex, 0..57

  uint64_t low_of(uint32_t index) const { return read_bits(low, low_bit + uint64_t{index} * low_stride, low_stride); }
};

/// Contribution of one field to a residual word: the zigzag number with `high` above the field's low bits, at the
/// field's place.
inline uint64_t residual_word(const FieldCode& field, uint64_t high, uint64_t low) {
  const uint64_t below = (low >> field.low_at) & ((uint64_t{1} << field.low_bits) - 1);
  return unzigzag((high << field.low_bits) | below) << field.shift;
}

/// Leaves gaps at the vertices with flags[i] != 0: out[i] = residuals[k] for the k-th of the other vertices. The values
/// in the gaps are unspecified.
void expand_residuals(const uint64_t* residuals, const uint8_t* flags, uint32_t count, uint64_t* out);

/// Computes the words and explicit vertices of a cluster. Stays within its memory for any input, provided that as many
/// corners are fresh as there are vertices.
void walk_strips(const WalkInput& input, WalkMemory& memory);

/// Packs the low `width` bits (0..8) of four bytes into one number of 4 width bits.
uint64_t pack_four(const uint8_t* bytes, uint32_t width);

/// out[i] = residual word i, the sum over all fields. May overwrite up to kSpareWords words behind out[count - 1].
void read_residuals(const ChannelCode& code, uint32_t count, uint64_t* out);

/// read_residuals() for this processor.
using ResidualKernel = void (*)(const ChannelCode& code, uint32_t count, uint64_t* out);
ResidualKernel residual_kernel();

namespace avx2 {
void read_residuals(const ChannelCode& code, uint32_t count, uint64_t* out);
}

} // namespace packtrace::page_fast
