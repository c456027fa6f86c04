#include "runtime/ao/multi_jitter.h"

#include <memory>
#include <utility>

#include "runtime/ao/hash.h"

namespace packtrace {
namespace {

constexpr uint32_t kSide = 8; ///< cells per axis

/// A permutation of 0..7.
std::array<uint32_t, kSide> shuffled(uint32_t seed) {
  std::array<uint32_t, kSide> order{};
  for (uint32_t i = 0; i < kSide; ++i) order[i] = i;
  for (uint32_t i = kSide - 1; i > 0; --i) std::swap(order[i], order[hash_combine(seed, i) % (i + 1)]);
  return order;
}

MultiJitterSet make_set(uint32_t seed) {
  MultiJitterSet set;
  for (uint32_t column = 0; column < kSide; ++column) {
    const auto rows = shuffled(hash_combine(seed, column)), columns = shuffled(hash_combine(seed, kSide + column));
    for (uint32_t i = 0; i < kSide; ++i) {
      set[i * kSide + column].x = static_cast<float>(rows[i]);    // within the cell, in 64ths
      set[column * kSide + i].y = static_cast<float>(columns[i]); // cells of row `column`
    }
  }
  for (uint32_t i = 0; i < kSetPoints; ++i) {
    const Vec2 jitter(unit_float(hash_combine(seed, 100 + 2 * i)), unit_float(hash_combine(seed, 101 + 2 * i)));
    set[i] = (Vec2(float(i % kSide), float(i / kSide)) * float(kSide) + set[i] + jitter) / float(kSetPoints);
    set[i] = glm::min(set[i], Vec2(0x1.fffffep-1f)); // rounding reaches 1 otherwise
  }
  return set;
}

} // namespace

const std::array<MultiJitterSet, kSetCount>& multi_jitter_sets() {
  static const auto sets = [] {
    auto made = std::make_unique<std::array<MultiJitterSet, kSetCount>>();
    for (uint32_t i = 0; i < kSetCount; ++i) (*made)[i] = make_set(hash32(i));
    return made;
  }();
  return *sets;
}

} // namespace packtrace
