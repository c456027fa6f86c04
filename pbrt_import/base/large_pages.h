#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

namespace packtrace {

/// Asks the kernel to back a block of memory with large pages (2 MiB) when it is first written. No effect on blocks
/// below 8 MiB.
void prefer_large_pages(void* memory, size_t bytes);

/// Requests large pages for memory that malloc will return to the calling thread, about `bytes` in total. This works
/// only if malloc keeps freed blocks of that size (mallopt(3), M_TRIM_THRESHOLD). It reserves address space at once;
/// the kernel provides memory when a page is first written.
void prefer_large_heap_pages(size_t bytes);

/// Requests large pages for the small blocks that malloc returns to one thread. Page faults for 4 KiB pages take the
/// kernel longer than most readers take to fill the pages.
class LargeHeapPages {
public:
  /// Call before allocating this number of bytes in total.
  void about_to_allocate(uint64_t bytes) {
    allocated_ += bytes;
    if (allocated_ >= next_) prepare();
  }

private:
  void prepare();

  uint64_t allocated_ = 0;
  uint64_t next_ = 2u << 20; ///< smaller amounts are not worth the cost
};

/// Like reserve(), but calls prefer_large_pages() on the new block before the elements are moved to it.
template <class T>
void reserve_large(std::vector<T>& elements, size_t capacity) {
  std::vector<T> larger;
  larger.reserve(capacity);
  prefer_large_pages(larger.data(), capacity * sizeof(T));
  larger.insert(larger.end(), std::make_move_iterator(elements.begin()), std::make_move_iterator(elements.end()));
  elements = std::move(larger);
}

/// Reserves room for at least one more element of an array that may grow large: by a factor of 16 while there are few,
/// or to a million small ones, then by a factor of 4. Unused capacity costs address space only, whereas frequent growth
/// costs time for copies and memory for the second array.
template <class T>
void reserve_one_more(std::vector<T>& elements) {
  constexpr size_t kFirst = 1024, kFew = 1u << 14, kMany = sizeof(T) <= 64 ? 1u << 20 : 1u << 18;
  const size_t size = elements.size();
  if (size < elements.capacity()) return;
  reserve_large(elements, size == 0 ? kFirst : size < kFew ? 16 * size : std::max(4 * size, kMany));
}

} // namespace packtrace
