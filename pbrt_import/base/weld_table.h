#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace packtrace {

/// Hashes three words to 64 bits, equally on every machine.
constexpr uint64_t mix_words(uint64_t a, uint64_t b, uint64_t c = 0) {
  uint64_t h = (a ^ std::rotl(b, 23) ^ std::rotl(c, 46)) * 0x9e3779b97f4a7c15u;
  h = (h ^ (h >> 32) ^ b) * 0xd6e8feb86659fd93u;
  h = (h ^ (h >> 29) ^ c) * 0xa0761d6478bd642fu;
  return h ^ (h >> 32);
}

/// Numbers distinct values 0, 1, ... in order of first appearance. The caller stores the values.
class WeldTable {
public:
  /// @param capacity maximum number of distinct values
  explicit WeldTable(size_t capacity) : slots_(std::bit_ceil(capacity * 2 + 1), kEmpty), mask_(slots_.size() - 1) {}

  /// Returns the number of the value with this hash for which equals(number) holds. If there is none, stores `next` as
  /// its number and returns it.
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
