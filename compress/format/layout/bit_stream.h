#pragma once

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "compress/format/layout/bit_fields.h"

namespace packtrace {

/// Bits per value of 0 .. count-1; 0 for count <= 1.
constexpr uint32_t bits_for_count(uint64_t count) {
  return count <= 1 ? 0u : static_cast<uint32_t>(std::bit_width(count - 1));
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
