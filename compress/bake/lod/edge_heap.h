#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace packtrace {

/// Edges by what their collapse costs, the cheapest on top; those of equal cost by number.
class EdgeHeap {
public:
  struct Entry {
    double cost;
    uint32_t edge;
    bool operator<(const Entry& o) const { return cost != o.cost ? cost < o.cost : edge < o.edge; }
  };

  bool empty() const { return entries_.empty(); }
  size_t size() const { return entries_.size(); }
  const Entry& top() const { return entries_.front(); }
  void reserve(size_t count) { entries_.reserve(count); }

  /// Without order, until sort() is called.
  void add(const Entry& entry) { entries_.push_back(entry); }
  void sort() {
    for (size_t i = entries_.size() / 2; i-- > 0;) sink(i, entries_[i]);
  }

  void pop() {
    const Entry last = entries_.back();
    entries_.pop_back();
    if (!entries_.empty()) sink(0, last);
  }

  /// Whether a top of that cost would be one still.
  bool stays_top(double cost) const {
    return (entries_.size() < 2 || cost <= entries_[1].cost) && (entries_.size() < 3 || cost <= entries_[2].cost);
  }

  void replace_top(const Entry& entry) { sink(0, entry); }

private:
  void sink(size_t at, const Entry entry) {
    const size_t size = entries_.size();
    for (size_t child; (child = 2 * at + 1) < size; at = child) {
      if (child + 1 < size && entries_[child + 1] < entries_[child]) ++child;
      if (!(entries_[child] < entry)) break;
      entries_[at] = entries_[child];
    }
    entries_[at] = entry;
  }

  std::vector<Entry> entries_;
};

} // namespace packtrace
