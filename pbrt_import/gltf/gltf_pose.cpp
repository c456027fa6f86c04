#include "pbrt_import/gltf/gltf_pose.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/gltf/gltf_accessors.h"

namespace packtrace::gltf {

std::vector<DAffine> joint_maps(Document& document, uint64_t number, std::span<const PlacedNode> nodes) {
  const Value skin = document.element("skins", number);
  const Value joints = skin.at("joints");
  std::vector<DAffine> maps;
  for (size_t i = 0; i < joints.size(); ++i) {
    const auto placed = std::ranges::find(nodes, joints[i].integer(), &PlacedNode::node);
    if (placed == nodes.end()) joints[i].fail("is a node outside the scene");
    maps.push_back(placed->world_from_node);
  }
  const std::optional<uint64_t> accessor = skin.find_integer("inverseBindMatrices");
  if (!accessor) return maps;
  const AccessorValues bind = read_floats(document, *accessor);
  constexpr uint32_t kMatrix = 16;
  if (bind.components != kMatrix || bind.count < maps.size()) skin.fail("has fewer inverse bind matrices than joints");
  for (size_t i = 0; i < maps.size(); ++i) {
    const float* const m = bind.values.data() + i * kMatrix;
    maps[i] = compose(maps[i], DAffine(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[12], m[13], m[14]));
  }
  return maps;
}

void move_with_joints(std::span<const DAffine> joint_maps, std::span<const JointSet> sets, const Value& primitive,
                      std::vector<float>& positions, std::vector<float>& normals) {
  for (size_t v = 0; v < positions.size() / 3; ++v) {
    DAffine map(0.0);
    double total = 0.0;
    for (const JointSet& set : sets)
      for (size_t k = 4 * v; k < 4 * v + 4; ++k) {
        const double weight = double{set.weights[k]};
        if (!(weight > 0.0)) continue;
        const float joint = set.joints[k];
        if (!(joint >= 0.0f && joint < static_cast<float>(joint_maps.size())))
          primitive.fail("has a joint that its skin lacks");
        map += weight * joint_maps[static_cast<size_t>(joint)];
        total += weight;
      }
    if (!(total > 0.0) || !std::isfinite(total)) continue;
    map /= total;
    const auto replace = [v](std::vector<float>& values, const DVec3& by) {
      for (int axis = 0; axis < 3; ++axis) values[3 * v + static_cast<size_t>(axis)] = static_cast<float>(by[axis]);
    };
    const auto vector = [v](const std::vector<float>& values) {
      return DVec3(values[3 * v], values[3 * v + 1], values[3 * v + 2]);
    };
    replace(positions, transform_point(map, vector(positions)));
    if (!normals.empty()) {
      const DVec3 turned = normal_matrix(map) * vector(normals);
      const double length = glm::length(turned);
      if (length > 0.0) replace(normals, turned / length);
    }
  }
}

} // namespace packtrace::gltf
