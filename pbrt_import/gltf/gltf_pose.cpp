#include "pbrt_import/gltf/gltf_pose.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/gltf/gltf_accessors.h"

namespace packtrace::gltf {

Skins::Skins(Document& document, std::span<const PlacedNode> nodes)
    : document_(document), places_(document.count("nodes"), kNoNode) {
  for (size_t i = 0; i < nodes.size(); ++i) places_[static_cast<size_t>(nodes[i].node)] = i;
}

const Skins::Skin& Skins::skin(uint64_t number) {
  const auto found = known_.find(number);
  return found != known_.end() ? found->second : known_.emplace(number, read(number)).first->second;
}

std::vector<DAffine> Skins::joint_maps(uint64_t number, std::span<const PlacedNode> nodes) {
  const Skin& known = skin(number);
  std::vector<DAffine> maps;
  maps.reserve(known.joints.size());
  for (size_t i = 0; i < known.joints.size(); ++i) {
    const DAffine& world_from_joint = nodes[known.joints[i]].world_from_node;
    maps.push_back(known.joint_from_mesh.empty() ? world_from_joint
                                                 : compose(world_from_joint, known.joint_from_mesh[i]));
  }
  return maps;
}

bool Skins::moves(uint64_t number, std::span<const PlacedNode> nodes) {
  return std::ranges::any_of(skin(number).joints, [&](size_t joint) { return nodes[joint].mover != kNoNode; });
}

JointMaps PosedSkins::maps(uint64_t skin) {
  JointMaps& maps = known_[skin];
  if (!maps) maps = std::make_shared<const std::vector<DAffine>>(skins_.joint_maps(skin, nodes_));
  return maps;
}

Skins::Skin Skins::read(uint64_t number) const {
  const Value skin = document_.element("skins", number);
  const Value joints = skin.at("joints");
  Skin result;
  const uint64_t bytes = joints.size() * (sizeof(size_t) + sizeof(DAffine));
  document_.memory().resize(document_.memory().bytes() + bytes, "skins of the glTF document");
  for (size_t i = 0; i < joints.size(); ++i) {
    const uint64_t node = joints[i].integer();
    const size_t place = node < places_.size() ? places_[static_cast<size_t>(node)] : kNoNode;
    if (place == kNoNode) joints[i].fail("is a node outside the scene");
    result.joints.push_back(place);
  }
  const std::optional<uint64_t> accessor = skin.find_integer("inverseBindMatrices");
  if (!accessor) return result;
  const ValuesInUse values(document_);
  const AccessorValues bind = read_floats(document_, *accessor);
  constexpr uint32_t kMatrix = 16;
  if (bind.components != kMatrix || bind.count < joints.size())
    skin.fail("has fewer inverse bind matrices than joints");
  for (size_t i = 0; i < joints.size(); ++i) {
    const float* const m = bind.values.data() + i * kMatrix;
    result.joint_from_mesh.emplace_back(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[12], m[13], m[14]);
  }
  return result;
}

void check_joints(std::span<const JointSet> sets, uint64_t vertices, size_t joint_count, const Value& primitive) {
  for (const JointSet& set : sets) {
    if (set.joints.size() != vertices * 4 || set.weights.size() != vertices * 4)
      primitive.fail("has joints without weights");
    for (size_t k = 0; k < set.joints.size(); ++k)
      if (set.weights[k] > 0.0f && !(set.joints[k] >= 0.0f && set.joints[k] < static_cast<float>(joint_count)))
        primitive.fail("has a joint that its skin lacks");
  }
}

void add_target(std::span<const float> displacements, double weight, std::span<float> values) {
  for (size_t k = 0; k < std::min(displacements.size(), values.size()); ++k)
    values[k] += static_cast<float>(weight * double{displacements[k]});
}

void move_with_joints(std::span<const DAffine> joint_maps, std::span<const JointSet> sets,
                      std::vector<float>& positions, std::vector<float>& normals) {
  for (size_t v = 0; v < positions.size() / 3; ++v) {
    DAffine map(0.0);
    double total = 0.0;
    for (const JointSet& set : sets)
      for (size_t k = 4 * v; k < 4 * v + 4; ++k) {
        const double weight = double{set.weights[k]};
        if (!(weight > 0.0)) continue;
        map += weight * joint_maps[static_cast<size_t>(set.joints[k])];
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
