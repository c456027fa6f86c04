#include "runtime/ao/ray_sorter.h"

#include <array>
#include <cmath>

#include "runtime/camera/tiles.h"

namespace packtrace {

uint32_t direction_key(Vec3 d) {
  const float scale = 1.0f / (std::abs(d.x) + std::abs(d.y) + std::abs(d.z));
  float u = d.x * scale, v = d.y * scale;
  if (d.z < 0.0f) {
    const float folded = std::copysign(1.0f - std::abs(v), u);
    v = std::copysign(1.0f - std::abs(u), v), u = folded;
  }
  const auto cell = [](float t) { return static_cast<uint32_t>(std::clamp((t + 1.0f) * 8.0f, 0.0f, 15.0f)); };
  return morton_code(cell(u), cell(v));
}

std::span<const Ray> RaySorter::sort(std::span<const Ray> rays) {
  keys_.resize(rays.size()), order_.resize(rays.size()), sorted_.resize(rays.size());
  std::array<uint32_t, kKeys + 1> begin{}; // the last key is that of inactive rays
  for (size_t i = 0; i < rays.size(); ++i) {
    keys_[i] = static_cast<uint16_t>(rays[i].tfar > rays[i].tnear ? direction_key(rays[i].direction) : kKeys);
    ++begin[keys_[i]];
  }
  uint32_t sum = 0;
  for (uint32_t& count : begin) sum += count, count = sum - count;
  for (size_t i = 0; i < rays.size(); ++i) {
    const uint32_t place = begin[keys_[i]]++;
    order_[place] = static_cast<uint32_t>(i), sorted_[place] = rays[i];
  }
  return sorted_;
}

} // namespace packtrace
