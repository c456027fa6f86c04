#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace packtrace {

/// Numbers distinct values 0, 1, ... in order of first appearance. Optimised for corners of neighbouring triangles,
/// where most values repeat recent ones.
class Renumbering {
public:
  /// @param expected approximate number of distinct values
  explicit Renumbering(size_t expected) : slots_(std::bit_ceil(2 * expected + 2), kEmpty) { recent_.fill(kEmpty); }

  uint32_t operator()(uint32_t value) {
    uint32_t& recent = recent_[value % recent_.size()];
    if (recent == kEmpty || values[recent] != value) recent = find_or_add(value);
    return recent;
  }

  /// Takes time proportional to the number of values, whatever the capacity.
  void clear() {
    // Removal in reverse order of insertion keeps all probe sequences intact.
    for (; !values.empty(); values.pop_back()) slots_[slot_of(values.back())] = kEmpty;
    recent_.fill(kEmpty);
  }

  std::vector<uint32_t> values; ///< values by number

private:
  static constexpr uint32_t kEmpty = ~0u;

  /// Slot of the value, or the empty slot where it would be inserted.
  size_t slot_of(uint32_t value) const {
    const size_t mask = slots_.size() - 1;
    size_t slot = (value * uint64_t{0x9e3779b97f4a7c15u}) >> 32 & mask;
    while (slots_[slot] != kEmpty && values[slots_[slot]] != value) slot = (slot + 1) & mask;
    return slot;
  }

  uint32_t find_or_add(uint32_t value) {
    const size_t slot = slot_of(value);
    if (slots_[slot] != kEmpty) return slots_[slot];
    const auto number = static_cast<uint32_t>(values.size());
    slots_[slot] = number;
    values.push_back(value);
    if (2 * values.size() > slots_.size()) grow();
    return number;
  }

  void grow() {
    slots_.assign(2 * slots_.size(), kEmpty);
    for (uint32_t number = 0; number < values.size(); ++number) slots_[slot_of(values[number])] = number;
  }

  std::vector<uint32_t> slots_;
  std::array<uint32_t, 256> recent_; ///< cache: numbers of recent values, indexed by value modulo its size
};

} // namespace packtrace
