#include "compress/bake/lod/bound/surface_side.h"

#include <algorithm>
#include <numeric>

namespace packtrace {
namespace {

constexpr size_t kLargeFan = 48; // triangles around a point

} // namespace

void SurfaceSide::link() {
  if (!first_.empty()) return;
  stamp_.resize(surface_.triangles.size());
  const auto for_each = [&](const auto& visit) {
    for (uint32_t i = 0; i < surface_.triangles.size(); ++i) {
      const Triangle t = corner_points(i);
      visit(t.x, i);
      if (t.y != t.x) visit(t.y, i);
      if (t.z != t.x && t.z != t.y) visit(t.z, i);
    }
  };
  first_.assign(surface_.points.size() + 1, 0);
  for_each([&](uint32_t p, uint32_t) { ++first_[p]; });
  std::exclusive_scan(first_.begin(), first_.end(), first_.begin(), 0u);
  fans_.resize(first_.back());
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for_each([&](uint32_t p, uint32_t i) { fans_[next[p]++] = i; });
}

void SurfaceSide::gather(const Triangle& corners, std::span<const uint32_t> first) {
  candidates_.clear();
  ++stamp_value_;
  for (const uint32_t t : first) add(t);
  for (int i = 0; i < 3; ++i) {
    const std::span<const uint32_t> fan = around(corners[i]);
    if (fan.size() > kLargeFan)
      add_large_fan(fan, corners, i);
    else
      for (const uint32_t t : fan) add(t);
  }
}

/// Adds the triangles of the fan that have another of the corners too, up to kLargeFan; if there are none, its first
/// ones.
void SurfaceSide::add_large_fan(std::span<const uint32_t> fan, const Triangle& corners, int corner) {
  size_t added = 0;
  for (size_t k = 0; k < fan.size() && added < kLargeFan; ++k)
    for (const Triangle around = corner_points(fan[k]); const uint32_t p : {around.x, around.y, around.z})
      if (p != corners[corner] && (p == corners.x || p == corners.y || p == corners.z)) {
        add(fan[k]), ++added;
        break;
      }
  for (size_t k = 0; k < kLargeFan && added == 0; ++k) add(fan[k]);
}

void SurfaceSide::gather_within(const std::array<DVec3, 3>& triangle, double distance) {
  candidates_.clear();
  if (boxes_.empty()) {
    boxes_.reserve(surface_.triangles.size());
    for (uint32_t t = 0; t < surface_.triangles.size(); ++t) {
      const DVec3 &a = surface_.corner(t, 0), &b = surface_.corner(t, 1), &c = surface_.corner(t, 2);
      boxes_.push_back({glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c)});
    }
  }
  const DVec3 lo = glm::min(glm::min(triangle[0], triangle[1]), triangle[2]) - distance;
  const DVec3 hi = glm::max(glm::max(triangle[0], triangle[1]), triangle[2]) + distance;
  for (uint32_t t = 0; t < boxes_.size(); ++t)
    if (const auto& [least, most] = boxes_[t];
        least.x <= hi.x && most.x >= lo.x && least.y <= hi.y && most.y >= lo.y && least.z <= hi.z && most.z >= lo.z)
      candidates_.push_back(t);
}

void SurfaceSide::gather_near(DVec3 point) {
  constexpr size_t kTried = 16;
  std::vector<std::pair<double, uint32_t>> near(surface_.triangles.size());
  for (uint32_t t = 0; t < near.size(); ++t) {
    const DVec3 d = surface_.corner(t, 0) - point;
    near[t] = {glm::dot(d, d), t};
  }
  const size_t count = std::min(near.size(), kTried);
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  for (size_t i = 0; i < count; ++i) add(near[i].second);
}

} // namespace packtrace
