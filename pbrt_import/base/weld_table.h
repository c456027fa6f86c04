#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace packtrace {

/// Spreads a few words over 64 bits; the same on every machine.
constexpr uint64_t mix_words(uint64_t a, uint64_t b, uint64_t c = 0) {
  uint64_t h = (a ^ std::rotl(b, 23) ^ std::rotl(c, 46)) * 0x9e3779b97f4a7c15u;
  h = (h ^ (h >> 32) ^ b) * 0xd6e8feb86659fd93u;
  h = (h ^ (h >> 29) ^ c) * 0xa0761d6478bd642fu;
  return h ^ (h >> 32);
}

/// Numbers distinct values 0, 1, ... in order of first appearance. The values live with the caller.
class WeldTable {
public:
  /// @param capacity distinct values at most
  explicit WeldTable(size_t capacity) : slots_(std::bit_ceil(capacity * 2 + 1), kEmpty), mask_(slots_.size() - 1) {}

  /// The number of the value with this hash for which equals(number) holds; else `next`, which it has from now on.
  template <typename Equals>
  uint32_t find_or_add(uint64_t hash, uint32_t next, Equals&& equals) {
    for (size_t slot = hash & mask_;; slot = (slot + 1) & mask_) {
      if (slots_[slot] == kEmpty) return slots_[slot] = next;
      if (equals(slots_[slot])) return slots_[slot];
    }
  }

private:
  static constexpr uint32_t kEmpty = ~0u;
  std::vector<uint32_t> slots_;
  size_t mask_;
};

} // namespace packtrace
