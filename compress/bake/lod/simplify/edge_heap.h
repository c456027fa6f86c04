#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

namespace packtrace {

/// Binary min-heap of edges by collapse cost, compared as float. Edges of equal cost are ordered by number.
class EdgeHeap {
public:
  bool empty() const { return keys_.empty(); }
  uint32_t top() const { return static_cast<uint32_t>(keys_.front()); }
  void reserve(size_t count) { keys_.reserve(count); }

  /// Appends without restoring the heap order; call sort() afterwards.
  /// @param cost not negative
  void add(double cost, uint32_t edge) { keys_.push_back(key(cost, edge)); }
  void sort() {
    for (size_t i = keys_.size() / 2; i-- > 0;) sink(i, keys_[i]);
  }

  void pop() {
    const uint64_t last = keys_.back();
    keys_.pop_back();
    if (!keys_.empty()) sink(0, last);
  }

  /// The first kNear heap entries: the top and edges that are likely to follow soon.
  static constexpr size_t kNear = 7;
  size_t near_count() const { return std::min(kNear, keys_.size()); }
  uint32_t near(size_t place) const { return static_cast<uint32_t>(keys_[place]); }
  /// Changes the cost of one of them without restoring the heap order; call restore_order() afterwards.
  void change_near(size_t place, double cost) { keys_[place] = key(cost, near(place)); }
  void restore_order() {
    for (size_t i = near_count(); i-- > 0;) sink(i, keys_[i]);
  }

private:
  /// The bits of non-negative floats have the same order as their values.
  static uint64_t key(double cost, uint32_t edge) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const auto rounded = static_cast<float>(std::min(cost, kLargest));
    return (uint64_t{std::bit_cast<uint32_t>(rounded)} << 32) | edge;
  }

  void sink(size_t at, uint64_t key) {
    const size_t size = keys_.size();
    for (size_t child; (child = 2 * at + 1) < size; at = child) {
      if (child + 1 < size) child += keys_[child + 1] < keys_[child];
      if (keys_[child] >= key) break;
      keys_[at] = keys_[child];
    }
    keys_[at] = key;
  }

  std::vector<uint64_t> keys_;
};

} // namespace packtrace
