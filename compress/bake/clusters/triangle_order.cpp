#include "compress/bake/clusters/triangle_order.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace packtrace {
namespace {

/// Moves the triangles to `to`, sorted by keys below `key_count`; stable.
template <typename Key>
void sort_by(const std::vector<PlacedTriangle>& from, std::vector<PlacedTriangle>& to, std::vector<uint32_t>& begins,
             size_t key_count, const Key& key) {
  begins.assign(key_count + 1, 0);
  for (const PlacedTriangle& t : from) ++begins[key(t) + 1];
  for (size_t i = 1; i < begins.size(); ++i) begins[i] += begins[i - 1];
  for (const PlacedTriangle& t : from) to[begins[key(t)]++] = t;
}

} // namespace

void sort_by_place(std::vector<PlacedTriangle>& triangles, uint32_t rank_count) {
  constexpr size_t kFewTriangles = 2048; // up to here, comparing is faster than counting digits
  if (triangles.size() <= kFewTriangles) {
    std::stable_sort(triangles.begin(), triangles.end(), [](const PlacedTriangle& a, const PlacedTriangle& b) {
      return a.rank != b.rank ? a.rank < b.rank : a.morton < b.morton;
    });
    return;
  }
  uint64_t used = 0; // bits that are set in any place
  for (const PlacedTriangle& t : triangles) used |= t.morton;
  constexpr uint32_t kDigitBits = 11;
  std::vector<PlacedTriangle> other(triangles.size());
  std::vector<uint32_t> begins;
  const auto bits = static_cast<uint32_t>(std::bit_width(used));
  for (uint32_t shift = 0; shift < bits; shift += kDigitBits) {
    const auto digit = [shift](const PlacedTriangle& t) { return t.morton >> shift & ((1u << kDigitBits) - 1); };
    sort_by(triangles, other, begins, size_t{1} << kDigitBits, digit);
    triangles.swap(other);
  }
  if (rank_count < 2) return;
  sort_by(triangles, other, begins, rank_count, [](const PlacedTriangle& t) { return size_t{t.rank}; });
  triangles.swap(other);
}

} // namespace packtrace
