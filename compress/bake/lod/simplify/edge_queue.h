#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace packtrace {

/// Edges in the order of their collapse costs, compared as floats; edges of equal cost are ordered by number. A heap
/// holds the edges of the lowest costs. All others wait in unordered lists, one per range of costs, until the heap
/// is empty and open_next() moves the next list into it. Most edges vanish or change their costs while they wait, so
/// they are never sorted.
class EdgeQueue {
public:
  /// Removes all edges.
  /// @param count edges have numbers below this
  void reset(size_t count) {
    next_.resize(count);
    first_.fill(kNone);
    filled_.fill(0);
    heap_.clear();
    open_ = -1;
  }

  /// @param cost negative costs count as 0, infinity and NaN as the largest float
  void add(double cost, uint32_t edge) {
    const uint64_t key = key_of(cost, edge);
    const auto range = static_cast<int32_t>(key >> kRangeShift);
    if (range <= open_) {
      heap_.push_back(key);
      std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
      return;
    }
    const auto at = static_cast<size_t>(range);
    next_[edge] = std::exchange(first_[at], edge);
    filled_[at / 64] |= uint64_t{1} << (at % 64);
  }

  bool heap_empty() const { return heap_.empty(); }
  /// The edge of the lowest cost. The heap must not be empty.
  uint32_t top() const { return static_cast<uint32_t>(heap_.front()); }
  void pop() {
    const uint64_t last = heap_.back();
    heap_.pop_back();
    if (!heap_.empty()) sink(0, last);
  }

  /// Opens the next range of costs that has edges and appends these edges to `out`; the caller adds them again with
  /// their present costs. The heap must be empty. Returns false if no edges are left.
  bool open_next(std::vector<uint32_t>& out) {
    for (auto word = static_cast<size_t>(open_ + 1) / 64; word < filled_.size(); ++word) {
      if (filled_[word] == 0) continue;
      const size_t at = 64 * word + static_cast<size_t>(std::countr_zero(filled_[word]));
      filled_[word] &= filled_[word] - 1;
      open_ = static_cast<int32_t>(at);
      for (uint32_t edge = std::exchange(first_[at], kNone); edge != kNone; edge = next_[edge]) out.push_back(edge);
      return true;
    }
    return false;
  }

private:
  static constexpr uint32_t kNone = ~0u;
  static constexpr uint32_t kRangeShift = 32 + 19; // of keys: ranges share the exponent and four bits of the mantissa
  static constexpr size_t kRanges = size_t{1} << (64 - kRangeShift - 1);

  /// The bits of non-negative floats have the same order as their values.
  static uint64_t key_of(double cost, uint32_t edge) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const auto rounded = static_cast<float>(cost < kLargest ? (cost > 0.0 ? cost : 0.0) : kLargest); // -0 becomes 0
    return (uint64_t{std::bit_cast<uint32_t>(rounded)} << 32) | edge;
  }

  void sink(size_t at, uint64_t key) {
    const size_t size = heap_.size();
    for (size_t child; (child = 2 * at + 1) < size; at = child) {
      if (child + 1 < size) child += heap_[child + 1] < heap_[child];
      if (heap_[child] >= key) break;
      heap_[at] = heap_[child];
    }
    heap_[at] = key;
  }

  std::vector<uint64_t> heap_;                ///< keys, smallest first
  std::vector<uint32_t> next_;                ///< per edge: the next one of its range
  std::array<uint32_t, kRanges> first_;       ///< per range: its first waiting edge, or kNone
  std::array<uint64_t, kRanges / 64> filled_; ///< bit per range: whether edges wait
  int32_t open_ = -1;                         ///< the highest range whose edges are in the heap
};

} // namespace packtrace
