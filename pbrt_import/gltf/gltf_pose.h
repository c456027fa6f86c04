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

/// Weights and joint maps that deform a mesh in each frame of its animation.
struct PoseFrames {
  uint32_t count = 0;                       ///< at least 2
  double frames_per_second = 0.0;           ///< count / span of the animation, so that both repeat together
  std::vector<std::vector<double>> weights; ///< weights of morph targets by frame; empty: the mesh's own
  std::vector<JointMaps> joints;            ///< joint maps of the skin by frame; null: no skin
  MemoryReservation memory{};               ///< of weights and joints
};

/// Weights and joint maps that deform a mesh at the scene's time.
struct Pose {
  std::span<const double> weights;          ///< of morph targets, of the placed node; empty: the mesh's own
  JointMaps joints;                         ///< of the skin; null: no skin
  std::shared_ptr<const PoseFrames> frames; ///< null: no frames are kept
  bool skinned() const { return joints && !joints->empty(); }
  bool empty() const { return weights.empty() && !skinned(); }
};

/// The skins of a document.
class Skins {
public:
  /// @param nodes of the scene; only their numbers are used
  Skins(Document& document, std::span<const PlacedNode> nodes);

  /// Maps of a skin's joints. Throws Error(kInput) if the skin is malformed or has a joint outside the scene;
  /// MemoryError.
  /// @param nodes the constructor's, at the time for which the maps are wanted
  std::vector<DAffine> joint_maps(uint64_t skin, std::span<const PlacedNode> nodes);
  /// Whether an animation moves any of a skin's joints. Throws like joint_maps().
  bool moves(uint64_t skin, std::span<const PlacedNode> nodes);

private:
  struct Skin {
    std::vector<size_t> joints;           ///< indices of placed nodes
    std::vector<DAffine> joint_from_mesh; ///< inverse bind matrices by joint; empty: identities
  };
  const Skin& skin(uint64_t number);
  Skin read(uint64_t skin) const;

  Document& document_;
  std::vector<size_t> places_; ///< index of each node of the document among the placed ones; kNoNode: none
  std::map<uint64_t, Skin> known_;
};

/// The joints that move a vertex: four at a time.
struct JointSet {
  std::vector<float> joints, weights; ///< four of each per vertex
};

/// The joint maps of a document's skins at one time. Meshes with the same skin share them.
class PosedSkins {
public:
  /// The arguments must outlive this.
  PosedSkins(Skins& skins, std::span<const PlacedNode> nodes) : skins_(skins), nodes_(nodes) {}
  /// Throws like Skins::joint_maps().
  JointMaps maps(uint64_t skin);

private:
  Skins& skins_;
  std::span<const PlacedNode> nodes_;
  std::map<uint64_t, JointMaps> known_;
};

/// Throws Error(kInput), at the primitive, unless each set has four joints and four weights per vertex, and the skin
/// has all joints whose weight is above 0.
void check_joints(std::span<const JointSet> sets, uint64_t vertices, size_t joint_count, const Value& primitive);

/// Adds the displacements of a morph target, times its weight, to positions or normals. If the arrays differ in length,
/// only their common part is used.
void add_target(std::span<const float> displacements, double weight, std::span<float> values);

/// Moves positions and normals (empty: none) with the joints. Source: glTF 2.0 specification, section 3.7.3.3.
/// Vertices without weights do not move.
/// @param sets checked by check_joints()
void move_with_joints(std::span<const DAffine> joint_maps, std::span<const JointSet> sets,
                      std::vector<float>& positions, std::vector<float>& normals);

} // namespace packtrace::gltf
