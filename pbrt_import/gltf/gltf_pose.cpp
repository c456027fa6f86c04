#include "pbrt_import/gltf/gltf_pose.h"

#include <cmath>

#include "pbrt_import/gltf/gltf_accessors.h"

namespace packtrace::gltf {

Skins::Skins(Document& document, std::span<const PlacedNode> nodes)
    : document_(document), nodes_(nodes), places_(document.count("nodes"), nodes.size()) {
  for (size_t i = 0; i < nodes.size(); ++i) places_[static_cast<size_t>(nodes[i].node)] = i;
}

JointMaps Skins::joint_maps(uint64_t skin) {
  JointMaps& maps = known_[skin];
  if (!maps) maps = std::make_shared<const std::vector<DAffine>>(read(skin));
  return maps;
}

bool Skins::moves(uint64_t number) {
  const auto [found, inserted] = moving_.try_emplace(number, false);
  if (!inserted) return found->second;
  const Value joints = document_.element("skins", number).at("joints");
  for (size_t i = 0; i < joints.size() && !found->second; ++i)
    found->second = nodes_[places_[static_cast<size_t>(joints[i].integer())]].mover != kNoNode;
  return found->second;
}

std::vector<DAffine> Skins::read(uint64_t number) const {
  const Value skin = document_.element("skins", number);
  const Value joints = skin.at("joints");
  std::vector<DAffine> maps;
  for (size_t i = 0; i < joints.size(); ++i) {
    const uint64_t node = joints[i].integer();
    const size_t place = node < places_.size() ? places_[static_cast<size_t>(node)] : nodes_.size();
    if (place == nodes_.size()) joints[i].fail("is a node outside the scene");
    maps.push_back(nodes_[place].world_from_node);
  }
  const std::optional<uint64_t> accessor = skin.find_integer("inverseBindMatrices");
  if (!accessor) return maps;
  const ValuesInUse values(document_);
  const AccessorValues bind = read_floats(document_, *accessor);
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
