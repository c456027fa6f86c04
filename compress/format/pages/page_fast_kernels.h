#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "compress/format/cluster/index_codec.h"
#include "compress/format/pages/page_fast.h"

namespace packtrace::page_fast {

/// Kernels read and write whole words: so many bytes behind the parts and the arrays belong to nobody.
inline constexpr size_t kPartSlackBytes = 64;
inline constexpr size_t kSpareWords = 8;

/// Of one cluster. Bits are expanded to a byte each.
struct WalkMemory {
  using Words = std::array<uint64_t, kMaxClusterVertices + kSpareWords>;

  std::array<uint8_t, kMaxClusterTriangles + kSpareWords> left{};
  std::array<uint8_t, kMaxClusterCorners + kSpareWords> fresh{};
  std::array<uint8_t, kMaxClusterVertices + kSpareWords> crease{}; ///< by vertex
  std::array<uint8_t, kMaxClusterCorners + kMaxClusterVertices + kSpareWords> olds{};
  std::array<uint8_t, kMaxClusterCorners + kSpareWords> explicits{}; ///< vertices that corners name which are not fresh
  std::array<Words, kChannels> residuals{};                          ///< by vertex: what it is off its guess
  std::array<Words, kChannels> words{};
};

struct WalkInput {
  const uint8_t* runs = nullptr; ///< triangles of each strip, at most 128 in all
  uint32_t run_count = 0;
  std::array<bool, kChannels> has{}; ///< of the positions always
  bool creases = false;              ///< `crease` is to be looked at, and olds[] holds their originals as well
};

/// Bit i as byte i, 0 or 1, for i < count; some bytes behind are zeroed. Returns how many are 1.
uint32_t expand_bits(const uint8_t* bits, uint32_t count, uint8_t* out);

/// Zigzag differences to the last, modulo 256, added up.
void add_up_olds(const uint8_t* differences, uint32_t count, uint8_t* out);

/// Where the residuals of one field lie.
struct FieldCode {
  const uint8_t* bytes = nullptr;    ///< above the low bits
  uint32_t low_bits = 0, low_at = 0; ///< within the low bits of a vertex
  uint32_t shift = 0;                ///< of the field in its word
};

/// The low bits of all of a channel's fields lie together.
struct ChannelCode {
  uint32_t field_count = 0;         ///< 1..3
  FieldCode fields[kChannelFields]; ///< no std::array, whose functions are inline
  const uint8_t* low = nullptr;
  uint64_t low_bit = 0;    ///< where they begin
  uint32_t low_stride = 0; ///< bits of a vertex, 0..57

  uint64_t low_of(uint32_t index) const { return read_bits(low, low_bit + uint64_t{index} * low_stride, low_stride); }
};

/// What one field adds to a word: a zigzag number, `high` above the field's low bits.
inline uint64_t residual_word(const FieldCode& field, uint64_t high, uint64_t low) {
  const uint64_t below = (low >> field.low_at) & ((uint64_t{1} << field.low_bits) - 1);
  return unzigzag((high << field.low_bits) | below) << field.shift;
}

/// Makes room for the vertices with flags[i] != 0: out[i] = residuals[k] for the k-th of the others. Those get any.
void spread_residuals(const uint64_t* residuals, const uint8_t* flags, uint32_t count, uint64_t* out);

/// Words and explicit vertices of a cluster. Stays within its memory whatever it is given, if as many corners are fresh
/// as there are vertices.
void walk_strips(const WalkInput& input, WalkMemory& memory);

/// The low bits of four bytes as one number of 4 width bits; width 0..8.
uint64_t pack_four(const uint8_t* bytes, uint32_t width);

/// out[i] = the sum of all fields of residual i. Up to kSpareWords words behind out[count - 1] may be overwritten.
void read_residuals(const ChannelCode& code, uint32_t count, uint64_t* out);

/// The same, by the instructions of this processor.
using ResidualKernel = void (*)(const ChannelCode& code, uint32_t count, uint64_t* out);
ResidualKernel residual_kernel();

namespace avx2 {
void read_residuals(const ChannelCode& code, uint32_t count, uint64_t* out);
}

} // namespace packtrace::page_fast
