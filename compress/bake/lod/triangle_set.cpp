#include "compress/bake/lod/triangle_set.h"

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
  if (lane == 0) blocks_.emplace_back();
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

} // namespace packtrace
