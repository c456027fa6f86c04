#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

namespace packtrace {

/// Asks for memory that is about to be written for the first time to come in large pages, if it is large.
void prefer_large_pages(void* memory, size_t bytes);

/// The same for what malloc hands out to one thread in small blocks. The kernel takes longer to give a page of 4 KiB
/// than most readers to fill it.
class LargeHeapPages {
public:
  /// Call ahead of allocations of that many bytes in all.
  void about_to_allocate(uint64_t bytes) {
    allocated_ += bytes;
    if (allocated_ >= next_) prepare();
  }

private:
  void prepare();

  uint64_t allocated_ = 0;
  uint64_t next_ = 2u << 20; ///< less is not worth it
};

/// Makes room for capacity elements like reserve(), the old ones moved only after prefer_large_pages().
template <class T>
void reserve_large(std::vector<T>& elements, size_t capacity) {
  std::vector<T> larger;
  larger.reserve(capacity);
  prefer_large_pages(larger.data(), capacity * sizeof(T));
  larger.insert(larger.end(), std::make_move_iterator(elements.begin()), std::make_move_iterator(elements.end()));
  elements = std::move(larger);
}

/// Room for one more of what there may be many of. Room that is never used costs address space only, where copies
/// would cost time, and memory while they are made.
template <class T>
void reserve_one_more(std::vector<T>& elements) {
  constexpr size_t kFirst = 1024, kFew = 1u << 16;
  if (elements.size() < elements.capacity()) return;
  reserve_large(elements, elements.empty() ? kFirst : elements.size() * (elements.size() < kFew ? 16 : 4));
}

} // namespace packtrace
