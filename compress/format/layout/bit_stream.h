#pragma once

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace packtrace {

static_assert(std::endian::native == std::endian::little, "the file is read in place: little-endian machines only");

/// Widest field that one unaligned 64-bit load holds at any bit offset.
inline constexpr uint32_t kMaxFieldBits = 57;

/// Readers load 8 bytes from the byte in which a field starts, so buffers end in this many bytes outside every field.
inline constexpr size_t kReadSlackBytes = 8;

/// Bits per value of 0 .. count-1; 0 for count <= 1.
constexpr uint32_t bits_for_count(uint64_t count) {
  return count <= 1 ? 0u : static_cast<uint32_t>(std::bit_width(count - 1));
}

/// Returns the field of `bits` (0..57) bits at bit offset `bit`, least significant bit first within and across bytes.
/// Reads base[bit/8 .. bit/8+8).
inline uint64_t read_bits(const uint8_t* base, uint64_t bit, uint32_t bits) {
  uint64_t word = 0;
  std::memcpy(&word, base + (bit >> 3), sizeof word);
  return (word >> (bit & 7u)) & ((uint64_t{1} << bits) - 1);
}

/// Like read_bits() for up to 64 bits, in up to two loads.
inline uint64_t read_bits64(const uint8_t* base, uint64_t bit, uint32_t bits) {
  if (bits <= 32) return read_bits(base, bit, bits);
  return read_bits(base, bit, 32) | (read_bits(base, bit + 32, bits - 32) << 32);
}

/// Appends bit fields, least significant bit first.
class BitWriter {
public:
  /// @param bits 0..57; value must fit
  void put(uint64_t value, uint32_t bits) {
    assert(bits <= kMaxFieldBits && (value >> bits) == 0);
    pending_ |= value << pending_bits_;
    pending_bits_ += bits;
    for (; pending_bits_ >= 8; pending_bits_ -= 8, pending_ >>= 8) bytes_.push_back(static_cast<uint8_t>(pending_));
  }

  uint64_t bit_count() const { return bytes_.size() * uint64_t{8} + pending_bits_; }

  /// Pads with zero bits to a multiple of `alignment` bytes.
  void align(size_t alignment) {
    if (pending_bits_ > 0) put(0, 8 - pending_bits_);
    while (bytes_.size() % alignment != 0) bytes_.push_back(0);
  }

  /// Whole bytes written so far; call align() first.
  const std::vector<uint8_t>& bytes() const {
    assert(pending_bits_ == 0);
    return bytes_;
  }

private:
  std::vector<uint8_t> bytes_;
  uint64_t pending_ = 0; // at most 7 bits between calls
  uint32_t pending_bits_ = 0;
};

} // namespace packtrace
