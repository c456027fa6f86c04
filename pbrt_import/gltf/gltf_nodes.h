#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/gltf/gltf_animation.h"
#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/scene/math.h"

namespace packtrace::gltf {

inline constexpr size_t kNoNode = ~size_t{0};

/// A node of the scene with its place at the scene's time.
struct PlacedNode {
  uint64_t node = 0; ///< index into the document's nodes
  DAffine world_from_node{1.0};
  std::vector<double> weights;  ///< of morph targets, if the node or an animation sets them
  size_t parent = kNoNode;      ///< index into the placed nodes
  size_t mover = kNoNode;       ///< the nearest placed node among itself and its ancestors that the animation moves
  DAffine mover_from_node{1.0}; ///< does not change with time
};

/// Visits the nodes of the document's scene, parents before children, and places them. Nodes that would have two
/// parents or form a cycle are reported and left out.
/// @param time at which the animation is evaluated, in seconds. Throws MemoryError; Error(kInput) if the document has
/// no usable scene.
std::vector<PlacedNode> place_nodes(Document& document, const Animation& animation, double time);

/// Evaluates the animation at another time.
/// @param nodes those that place_nodes() returned, at any time
/// @return the same nodes with the transforms and weights of that time
std::vector<PlacedNode> nodes_at(Document& document, const Animation& animation, std::span<const PlacedNode> nodes,
                                 double time);

/// Transforms of the instances of a node with EXT_mesh_gpu_instancing; a single identity without it.
std::vector<DAffine> instances_of(Document& document, const Value& node);

/// Translation, rotation (of unit length) and scale, which act in the reverse order.
struct Trs {
  DVec3 translation{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  DVec3 scale{1.0};
};

/// The parts of a node without a matrix.
Trs local_parts(const Value& node, const AnimatedValues& animated);
DAffine compose_trs(const Trs& parts);

} // namespace packtrace::gltf
