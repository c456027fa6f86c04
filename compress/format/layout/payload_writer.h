#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

#include "compress/format/layout/bit_stream.h"

namespace packtrace {

/// Writes the bit streams of clusters one after another into a buffer of fixed size. Unlike BitWriter it gets the
/// length of each cluster in advance and then checks nothing.
class PayloadWriter {
public:
  /// Starts a new buffer of `bytes` bytes.
  void begin(size_t bytes) {
    limit_ = bytes;
    bytes_.assign(bytes + 2 * kReadSlackBytes, 0);
    word_ = 0;
  }

  /// Begins the next cluster at a multiple of 4 bytes. Returns false if the buffer has no room for `bits` bits.
  bool begin_cluster(uint64_t bits) {
    const uint64_t words = (bits + 31) / 32;
    if (words > limit_ / 4 - word_) return false;
    at_ = bytes_.data() + 4 * word_;
    word_ += words;
    pending_ = 0, pending_bits_ = 0;
    return true;
  }

  /// @param bits 0..57; value must fit
  void put(uint64_t value, uint32_t bits) {
    put_each(1, bits, [&](uint32_t) { return value; });
  }

  /// Writes value_of(0) to value_of(count - 1) with `bits` bits each.
  template <class ValueOf>
  void put_each(uint32_t count, uint32_t bits, const ValueOf& value_of) {
    // Local copies stay in registers; the compiler must assume that byte stores modify the members.
    uint8_t* at = at_;
    uint64_t pending = pending_;
    uint32_t pending_bits = pending_bits_;
    for (uint32_t i = 0; i < count; ++i) {
      pending |= value_of(i) << pending_bits;
      pending_bits += bits;
      std::memcpy(at, &pending, sizeof pending);
      const uint32_t whole = pending_bits & ~7u;
      at += whole >> 3;
      pending = whole == 64 ? 0 : pending >> whole;
      pending_bits -= whole;
    }
    at_ = at, pending_ = pending, pending_bits_ = pending_bits;
  }

  size_t size() const { return static_cast<size_t>(word_ * 4); }
  const uint8_t* data() const { return bytes_.data(); }

private:
  std::vector<uint8_t> bytes_;
  uint64_t word_ = 0;  // start of the next cluster, in units of 4 bytes
  uint64_t limit_ = 0; // in bytes
  uint8_t* at_ = nullptr;
  uint64_t pending_ = 0; // at most 7 bits between calls
  uint32_t pending_bits_ = 0;
};

} // namespace packtrace
