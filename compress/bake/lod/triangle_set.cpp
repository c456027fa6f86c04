#include "compress/bake/lod/triangle_set.h"

#include <algorithm>
#include <cstring>

namespace packtrace {
namespace {

DistanceKernel pick_kernel() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return avx2::triangle_distances;
#endif
  return triangle_distances;
}

} // namespace

TriangleBlock& TriangleSet::next_block(uint32_t number, size_t& lane) {
  lane = numbers_.size() % 4;
  if (lane == 0) {
    blocks_.emplace_back();
    for (double& x : blocks_.back().a[0]) x = 2.0 * kFar;
  }
  numbers_.push_back(number);
  return blocks_.back();
}

void TriangleSet::add(const std::array<DVec3, 3>& corners, uint32_t number) {
  size_t lane = 0;
  TriangleBlock& block = next_block(number, lane);
  const DVec3 &a = corners[0], ab = corners[1] - a, ac = corners[2] - a;
  for (int axis = 0; axis < 3; ++axis)
    block.a[axis][lane] = a[axis], block.ab[axis][lane] = ab[axis], block.ac[axis][lane] = ac[axis];
}

void TriangleSet::add(const TriangleSet& other, size_t i) {
  size_t lane = 0;
  TriangleBlock& block = next_block(other.numbers_[i], lane);
  const TriangleBlock& from = other.blocks_[i / 4];
  for (int axis = 0; axis < 3; ++axis) {
    block.a[axis][lane] = from.a[axis][i % 4];
    block.ab[axis][lane] = from.ab[axis][i % 4];
    block.ac[axis][lane] = from.ac[axis][i % 4];
  }
}

void TriangleSet::distances(const DVec3& point, double* out) const {
  static const DistanceKernel kernel = pick_kernel();
  kernel(&point.x, blocks_.data(), blocks_.size(), out);
}

NearestTriangle TriangleSet::nearest(const double* a, const double* b, const double* c) const {
  using Lanes = double __attribute__((vector_size(16)));
  using Loaded = double __attribute__((vector_size(16), may_alias, aligned(8)));
  using Places = int64_t __attribute__((vector_size(16)));
  const Lanes far = {2.0 * kFar, 2.0 * kFar};
  Lanes nearest_a = far, nearest_b = far, nearest_c = far, best = far;
  Places at = {}, place = {0, 1};
  for (size_t i = 0; i < padded_size(); i += 2) {
    const Lanes from_a = *reinterpret_cast<const Loaded*>(a + i), from_b = *reinterpret_cast<const Loaded*>(b + i),
                from_c = *reinterpret_cast<const Loaded*>(c + i);
    nearest_a = from_a < nearest_a ? from_a : nearest_a;
    nearest_b = from_b < nearest_b ? from_b : nearest_b;
    nearest_c = from_c < nearest_c ? from_c : nearest_c;
    Lanes largest = from_a > from_b ? from_a : from_b;
    largest = largest > from_c ? largest : from_c;
    const Places less = largest < best;
    best = less ? largest : best;
    at = less ? place : at;
    place += 2;
  }
  double bests[2], least[3][2];
  int64_t places[2];
  std::memcpy(bests, &best, sizeof bests), std::memcpy(places, &at, sizeof places);
  std::memcpy(least[0], &nearest_a, sizeof least[0]), std::memcpy(least[1], &nearest_b, sizeof least[1]);
  std::memcpy(least[2], &nearest_c, sizeof least[2]);
  const size_t lane = bests[1] < bests[0] || (bests[1] == bests[0] && places[1] < places[0]) ? 1 : 0;
  return {static_cast<size_t>(places[lane]), bests[lane],
          std::max({std::min(least[0][0], least[0][1]), std::min(least[1][0], least[1][1]),
                    std::min(least[2][0], least[2][1])})};
}

} // namespace packtrace
