#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

/// Reads bit fields in place, least significant bit first within and across bytes. The functions are always inlined, so
/// kernels compiled for one instruction set may call them: no object file holds a copy that other callers could be
/// linked to.
namespace packtrace {

static_assert(std::endian::native == std::endian::little, "the file is read in place: little-endian machines only");

/// Widest field that one unaligned 64-bit load holds at any bit offset.
inline constexpr uint32_t kMaxFieldBits = 57;

/// Readers load 8 bytes from the byte in which a field starts, so buffers end in this many bytes outside every field.
inline constexpr size_t kReadSlackBytes = 8;

/// Reads 8 bytes at any address.
[[gnu::always_inline]] inline uint64_t load64(const uint8_t* from) {
  uint64_t word;
  __builtin_memcpy(&word, from, sizeof word);
  return word;
}

/// Returns the field of `bits` (0..57) bits at bit offset `bit`. Reads base[bit/8 .. bit/8+8).
[[gnu::always_inline]] inline uint64_t read_bits(const uint8_t* base, uint64_t bit, uint32_t bits) {
  return (load64(base + (bit >> 3)) >> (bit & 7u)) & ((uint64_t{1} << bits) - 1);
}

/// Like read_bits() for up to 64 bits, in up to two loads.
[[gnu::always_inline]] inline uint64_t read_bits64(const uint8_t* base, uint64_t bit, uint32_t bits) {
  if (bits <= 32) return read_bits(base, bit, bits);
  return read_bits(base, bit, 32) | (read_bits(base, bit + 32, bits - 32) << 32);
}

/// Position fields of one vertex, which adjoin in the stream: x, then y, then z.
struct PositionFields {
  uint64_t axis[3];
};

/// Returns the position fields at bit offset `bit` with one load.
/// @param x_bits,y_bits,z_bits widths; their sum is at most kMaxFieldBits
[[gnu::always_inline]] inline PositionFields read_position(const uint8_t* base, uint64_t bit, uint32_t x_bits,
                                                           uint32_t y_bits, uint32_t z_bits) {
  const uint64_t fields = read_bits(base, bit, x_bits + y_bits + z_bits), one = 1;
  return {{fields & ((one << x_bits) - 1), (fields >> x_bits) & ((one << y_bits) - 1), fields >> (x_bits + y_bits)}};
}

} // namespace packtrace
