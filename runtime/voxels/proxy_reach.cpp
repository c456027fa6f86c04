#include "runtime/voxels/proxy_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace packtrace {

ProxyReach::ProxyReach(const Proxy& proxy) {
  constexpr uint32_t kMaxDecodedSide = 256;
  const VoxelIndex size = proxy.frame().size;
  reach_.fill(-std::numeric_limits<double>::infinity());
  const auto add = [&](VoxelIndex low, VoxelIndex high) {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const double dot = static_cast<double>(x) * (x > 0 ? high : low)[0] +
                             static_cast<double>(y) * (y > 0 ? high : low)[1] +
                             static_cast<double>(z) * (z > 0 ? high : low)[2];
          double& reach = reach_[number(x, y, z)];
          reach = std::max(reach, dot);
        }
  };
  bool any = false;
  if (!proxy.is_field() && std::ranges::max(size) <= kMaxDecodedSide) {
    const VoxelSet set = decode_occupancy(proxy.voxels);
    VoxelIndex first{}, last{};
    set.for_each([&](VoxelIndex v) {
      if (any && v[1] == last[1] && v[2] == last[2]) {
        last = v;
        return;
      }
      if (any) add(first, {last[0] + 1, last[1] + 1, last[2] + 1});
      any = true, first = last = v;
    });
    if (any) add(first, {last[0] + 1, last[1] + 1, last[2] + 1});
  }
  if (!any) add({0, 0, 0}, size);
}

double ProxyReach::along(DVec3 direction) const {
  std::array<int, 3> order = {0, 1, 2}, step{};
  std::ranges::sort(order, [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  double result = 0.0;
  for (size_t i = 0; i < 3; ++i) {
    const double length = std::abs(direction[order[i]]), next = i < 2 ? std::abs(direction[order[i + 1]]) : 0.0;
    step[static_cast<size_t>(order[i])] = direction[order[i]] < 0.0 ? -1 : 1;
    result += (length - next) * reach_[number(step[0], step[1], step[2])];
  }
  return result;
}

Bounds ProxyReach::bounds(const DAffine& world_from_grid) const {
  DVec3 low, high;
  for (int a = 0; a < 3; ++a) {
    const DVec3 row(world_from_grid[0][a], world_from_grid[1][a], world_from_grid[2][a]);
    low[a] = world_from_grid[3][a] - along(-row), high[a] = world_from_grid[3][a] + along(row);
  }
  Bounds box;
  box.extend(low), box.extend(high);
  return box;
}

} // namespace packtrace
