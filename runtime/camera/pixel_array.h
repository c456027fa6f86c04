#pragma once

#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace packtrace {

/// Leaves elements uninitialised unless a value is given.
template <typename T>
struct PixelAllocator : std::allocator<T> {
  template <typename U>
  struct rebind {
    using other = PixelAllocator<U>;
  };
  template <typename U>
  void construct(U* place) {
    ::new (static_cast<void*>(place)) U;
  }
  template <typename U, typename... Values>
  void construct(U* place, Values&&... values) {
    ::new (static_cast<void*>(place)) U(std::forward<Values>(values)...);
  }
};

/// A vector whose resize() adds uninitialised elements, for pixels that are written before they are read.
template <typename T>
using PixelArray = std::vector<T, PixelAllocator<T>>;

} // namespace packtrace
