#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/scene/math.h"

namespace packtrace::gltf {

/// A node of the scene with its place at the scene's time.
struct PlacedNode {
  uint64_t node = 0; ///< index into the document's nodes
  DAffine world_from_node{1.0};
  std::vector<double> weights; ///< of morph targets, if the node or an animation sets them
};

/// Visits the nodes of the document's scene, parents before children, and places them. Nodes that would have two
/// parents or form a cycle are reported and left out.
/// @param time at which animations of nodes are evaluated, in seconds; they hold before their first and after their
/// last key. Throws MemoryError; Error(kInput) if the document has no usable scene.
std::vector<PlacedNode> place_nodes(Document& document, double time);

/// Maps of the instances that EXT_mesh_gpu_instancing makes of a node; a single identity without it.
std::vector<DAffine> instances_of(Document& document, const Value& node);

/// Map of translation, rotation (x, y, z, w; of any length but 0) and scale.
DAffine compose_trs(DVec3 translation, const std::vector<double>& rotation, DVec3 scale);

} // namespace packtrace::gltf
