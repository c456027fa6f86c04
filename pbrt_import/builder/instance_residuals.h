#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Values of which most are zero, by index. A block of indices whose values are all zero takes no memory.
template <class T>
class MostlyZeros {
public:
  static constexpr size_t kBlock = 256;

  /// Appends a value.
  /// @param zero whether all its components are +0
  void push_back(const T& value, bool zero) {
    if (size_ % kBlock == 0) blocks_.push_back(kAbsent);
    if (!zero) block_of(size_)[size_ % kBlock] = value;
    ++size_;
  }
  T operator[](size_t i) const {
    const uint32_t block = blocks_[i / kBlock];
    return block == kAbsent ? T(0.0f) : values_[size_t{block} * kBlock + i % kBlock];
  }
  size_t size() const { return size_; }
  /// Number of values that take memory.
  size_t stored() const { return values_.size(); }

private:
  static constexpr uint32_t kAbsent = ~0u;
  T* block_of(size_t i);

  std::vector<uint32_t> blocks_; ///< number of the block in values_, or kAbsent
  std::vector<T> values_;
  size_t size_ = 0;
};

/// What the transforms of instances lose when they are rounded to floats, by instance.
class InstanceResiduals {
public:
  /// Appends exact - rounded, rounded to floats.
  void push_back(const DAffine& exact, const Affine& rounded);
  /// Adds the residual of an instance to its rounded transform.
  void add_to(DAffine& map, size_t instance) const;
  /// Removes the instances for which kept is 0.
  void keep(const std::vector<uint8_t>& kept);
  size_t size() const { return translations_.size(); }
  size_t stored_bytes() const {
    return translations_.stored() * sizeof(Vec3) + linear_parts_.stored() * sizeof(glm::mat3);
  }

private:
  MostlyZeros<Vec3> translations_; ///< apart from the linear parts, because many scenes only translate
  MostlyZeros<glm::mat3> linear_parts_;
};

} // namespace packtrace
