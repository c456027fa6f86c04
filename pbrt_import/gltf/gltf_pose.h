#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/gltf/gltf_nodes.h"

namespace packtrace::gltf {

/// Maps of joints from where the mesh is bound to the world.
using JointMaps = std::shared_ptr<const std::vector<DAffine>>;

/// What deforms a mesh at the scene's time.
struct Pose {
  std::span<const double> weights; ///< of morph targets, of the placed node; empty: the mesh's own
  JointMaps joints;                ///< of the skin; null: no skin
  bool skinned() const { return joints && !joints->empty(); }
  bool empty() const { return weights.empty() && !skinned(); }
};

/// The skins of a document at the scene's time.
class Skins {
public:
  /// @param nodes must outlive this
  Skins(Document& document, std::span<const PlacedNode> nodes);

  /// Maps of a skin's joints; nodes with one skin share them. Throws Error(kInput) if the skin is malformed or has a
  /// joint outside the scene.
  JointMaps joint_maps(uint64_t skin);
  /// Whether an animation moves any of a skin's joints; joint_maps() has succeeded for it.
  bool moves(uint64_t skin);

private:
  std::vector<DAffine> read(uint64_t skin) const;

  Document& document_;
  std::span<const PlacedNode> nodes_;
  std::vector<size_t> places_; ///< in nodes_ by number of a node; nodes_.size(): outside the scene
  std::map<uint64_t, JointMaps> known_;
  std::map<uint64_t, bool> moving_;
};

/// The joints that move a vertex: four at a time.
struct JointSet {
  std::vector<float> joints, weights; ///< four of each per vertex
};

/// Moves positions and normals (empty: none) with the joints. Source: glTF 2.0 specification, section 3.7.3.3.
/// Vertices without weights stay. Throws Error(kInput), at the primitive, for joints that the skin lacks.
void move_with_joints(std::span<const DAffine> joint_maps, std::span<const JointSet> sets, const Value& primitive,
                      std::vector<float>& positions, std::vector<float>& normals);

} // namespace packtrace::gltf
