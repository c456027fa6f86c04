#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace packtrace {

/// Disjoint sets of the numbers below a count (union-find with path halving). Each number begins as a set of its own.
class DisjointSets {
public:
  explicit DisjointSets(size_t count = 0) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0u); }

  size_t count() const { return parents_.size(); }

  /// Returns the least number of the set that holds `number`.
  uint32_t root(uint32_t number) {
    while (parents_[number] != number) number = parents_[number] = parents_[parents_[number]];
    return number;
  }

  /// Joins the sets that hold two numbers.
  void join(uint32_t a, uint32_t b) {
    a = root(a), b = root(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }

  /// Makes `number` a set of its own again. Call it for all numbers of its set.
  void reset(uint32_t number) { parents_[number] = number; }

private:
  std::vector<uint32_t> parents_;
};

} // namespace packtrace
