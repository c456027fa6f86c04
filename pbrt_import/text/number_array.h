#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "pbrt_import/base/large_pages.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A growing array of numbers, stored in groups of three, so that large arrays can be taken out as points or triangles
/// without a copy.
template <class Number, class Triplet>
class NumberArray {
  static_assert(sizeof(Triplet) == 3 * sizeof(Number));

public:
  using value_type = Number;

  NumberArray() = default;
  explicit NumberArray(std::span<const Number> values) { append(values); }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  Number operator[](size_t i) const { return data()[i]; }
  operator std::span<const Number>() const { return {data(), size_}; }

  void push_back(Number value) { append(std::span<const Number>(&value, 1)); }

  /// Appends values, converted to Number.
  template <class Other>
  void append(std::span<const Other> values) {
    grow(values.size());
    std::copy(values.begin(), values.end(), reinterpret_cast<Number*>(triplets_.data()) + size_);
    size_ += values.size();
  }

  /// @param size at most size()
  void truncate(size_t size) {
    size_ = size;
    triplets_.resize((size + 2) / 3);
  }

  /// Empties the array and gives back its memory, unless it is small.
  void clear() {
    constexpr size_t kSmall = 256;
    if (triplets_.capacity() > kSmall) triplets_ = {};
    triplets_.clear();
    size_ = 0;
  }

  /// Moves out all complete groups of three and leaves the array empty.
  std::vector<Triplet> take_triplets() {
    triplets_.resize(size_ / 3);
    size_ = 0;
    return std::move(triplets_);
  }

private:
  const Number* data() const { return reinterpret_cast<const Number*>(triplets_.data()); }

  /// Resizes the storage for `more` numbers. The first append allocates exactly, since most arrays arrive in one piece.
  /// Later ones grow large arrays by a factor of 4: unused capacity of large arrays costs address space, not memory.
  void grow(size_t more) {
    constexpr size_t kLarge = 1u << 18;
    const size_t needed = (size_ + more + 2) / 3;
    if (needed > triplets_.capacity())
      reserve_large(triplets_,
                    size_ == 0 ? needed : std::max(needed, triplets_.capacity() * (needed < kLarge ? 2 : 4)));
    triplets_.resize(needed);
  }

  std::vector<Triplet> triplets_;
  size_t size_ = 0;
};

using FloatArray = NumberArray<float, Vec3>;
using IntegerArray = NumberArray<int32_t, Triangle>;

} // namespace packtrace
