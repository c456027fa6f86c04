#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/gltf/gltf_pose.h"
#include "pbrt_import/scene/mesh_sequence.h"

namespace packtrace::gltf {

/// The frames of a primitive that morph targets and a skin deform. Frames are evaluated on demand.
class PosedFrames final : public MeshFrames {
public:
  /// Data that all frames share.
  struct Source {
    std::vector<float> positions;            ///< without morph targets and skin, 3 per vertex
    std::vector<std::vector<float>> targets; ///< displacements of each morph target; empty if its weight is always 0
    std::vector<JointSet> joints;            ///< checked by check_joints()
    std::vector<uint8_t> used;               ///< by vertex: whether the mesh of the scene uses it
    std::vector<double> mesh_weights;        ///< weights of morph targets in frames without weights
  };

  /// @param name of the primitive, for messages
  /// @param memory budget that the source counts against. Throws MemoryError.
  PosedFrames(std::string name, std::shared_ptr<const PoseFrames> poses, Source source, const MemoryBudget& memory);

  uint32_t count() const override { return poses_->count; }
  std::vector<Vec3> positions(uint32_t frame) const override;
  std::string name(uint32_t frame) const override;

private:
  const std::string name_;
  const std::shared_ptr<const PoseFrames> poses_;
  const Source source_;
  MemoryReservation memory_;
};

} // namespace packtrace::gltf
