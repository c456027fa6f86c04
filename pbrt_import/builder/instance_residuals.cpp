#include "pbrt_import/builder/instance_residuals.h"

#include <algorithm>
#include <array>
#include <bit>

#include "pbrt_import/base/large_pages.h"

namespace packtrace {

namespace {

/// Whether all components are +0.
template <class T>
bool is_plus_zero(const T& value) {
  using Bits = std::array<uint32_t, sizeof(T) / sizeof(float)>;
  return std::bit_cast<Bits>(value) == Bits{};
}

} // namespace

template <class T>
T* MostlyZeros<T>::block_of(size_t i) {
  uint32_t& block = blocks_[i / kBlock];
  if (block == kAbsent) {
    block = static_cast<uint32_t>(values_.size() / kBlock);
    const size_t needed = values_.size() + kBlock;
    constexpr size_t kFew = 1u << 16;
    if (needed > values_.capacity())
      reserve_large(values_, std::max(4 * kBlock, values_.size() * (values_.size() < kFew ? 16 : 4)));
    values_.resize(needed, T(0.0f));
  }
  return values_.data() + size_t{block} * kBlock;
}

void InstanceResiduals::push_back(const DAffine& exact, const Affine& rounded) {
  // The difference of equal numbers is +0, never -0.
  const auto differ = [&](int column) {
    const DVec3 a = exact[column], b(rounded[column]);
    return (a.x != b.x) | (a.y != b.y) | (a.z != b.z);
  };
  const auto lost = [&](int column) { return Vec3(exact[column] - DVec3(rounded[column])); };
  if (differ(0) | differ(1) | differ(2))
    linear_parts_.push_back(glm::mat3(lost(0), lost(1), lost(2)), false);
  else
    linear_parts_.push_back(glm::mat3(0.0f), true);
  translations_.push_back(lost(3), !differ(3));
}

void InstanceResiduals::add_to(DAffine& map, size_t instance) const {
  const glm::mat3 linear = linear_parts_[instance];
  map += DAffine(Affine(linear[0], linear[1], linear[2], translations_[instance]));
}

void InstanceResiduals::keep(const std::vector<uint8_t>& kept) {
  InstanceResiduals rest;
  for (size_t i = 0; i < size(); ++i) {
    if (!kept[i]) continue;
    const glm::mat3 linear = linear_parts_[i];
    const Vec3 translation = translations_[i];
    rest.linear_parts_.push_back(linear, is_plus_zero(linear));
    rest.translations_.push_back(translation, is_plus_zero(translation));
  }
  *this = std::move(rest);
}

} // namespace packtrace
