#pragma once

#include <array>
#include <optional>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Translation, rotation and scale of an instance, as EXT_mesh_gpu_instancing stores them.
struct InstanceTransform {
  std::array<float, 3> translation{};
  std::array<float, 4> rotation{0, 0, 0, 1}; ///< unit quaternion x, y, z, w
  std::array<float, 3> scale{1, 1, 1};       ///< x is negative if the map mirrors
};

/// Decomposes a map; none if it shears or flattens, so that the decomposition would move a point of the unit ball by
/// more than 4e-6 of the map's size.
std::optional<InstanceTransform> decompose(const Affine& map);

} // namespace packtrace
