#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/gltf/gltf_nodes.h"

namespace packtrace::gltf {

/// What deforms a mesh at the scene's time.
struct Pose {
  std::vector<double> weights; ///< of morph targets; empty: the mesh's own
  std::vector<DAffine> joints; ///< world_from_bind of each joint of the skin; empty: no skin
  bool empty() const { return weights.empty() && joints.empty(); }
};

/// Maps of a skin's joints from where the mesh is bound to the world. Throws Error(kInput) if the skin is malformed or
/// has a joint outside the scene.
std::vector<DAffine> joint_maps(Document& document, uint64_t skin, std::span<const PlacedNode> nodes);

/// The joints that move a vertex: four at a time.
struct JointSet {
  std::vector<float> joints, weights; ///< four of each per vertex
};

/// Moves positions and normals (empty: none) with the joints. Source: glTF 2.0 specification, section 3.7.3.3.
/// Vertices without weights stay. Throws Error(kInput), at the primitive, for joints that the skin lacks.
void move_with_joints(std::span<const DAffine> joint_maps, std::span<const JointSet> sets, const Value& primitive,
                      std::vector<float>& positions, std::vector<float>& normals);

} // namespace packtrace::gltf
