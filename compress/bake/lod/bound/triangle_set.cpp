#include "compress/bake/lod/bound/triangle_set.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace {
namespace {

constexpr double kFar = 1e150; // coordinate of padding; its square is finite

DistanceKernel pick_distance_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::triangle_distances;
#endif
  return triangle_distances;
}

NearestKernel pick_nearest_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::nearest_triangle;
#endif
  return nearest_triangle;
}

} // namespace

TriangleBlock& TriangleSet::next_block(uint32_t number, size_t& lane) {
  lane = numbers_.size() % 4;
  if (lane == 0) {
    blocks_.emplace_back();
    for (double& x : blocks_.back().a[0]) x = kFar;
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

void TriangleSet::distances(std::span<const DVec3> points, std::span<double* const> rows) const {
  static const DistanceKernel kernel = pick_distance_kernel();
  kernel(&points[0].x, points.size(), blocks_.data(), blocks_.size(), rows.data());
}

NearestTriangle TriangleSet::nearest(const double* a, const double* b, const double* c) const {
  static const NearestKernel kernel = pick_nearest_kernel();
  return kernel(a, b, c, blocks_.size());
}

} // namespace packtrace
