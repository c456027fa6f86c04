#include "pbrt_import/gltf/gltf_frames.h"

#include <utility>

#include "pbrt_import/language/transforms.h"

namespace packtrace::gltf {

PosedFrames::PosedFrames(std::string name, std::shared_ptr<const PoseFrames> poses, Source source,
                         const MemoryBudget& memory)
    : name_(std::move(name)), poses_(std::move(poses)), source_(std::move(source)), memory_(memory) {
  uint64_t floats = source_.positions.size();
  for (const std::vector<float>& target : source_.targets) floats += target.size();
  for (const JointSet& set : source_.joints) floats += set.joints.size() + set.weights.size();
  memory_.resize(floats * sizeof(float) + source_.used.size(), "the frames of " + name_);
}

std::vector<Vec3> PosedFrames::positions(uint32_t frame) const {
  std::vector<float> moved = source_.positions;
  const std::vector<double>& own = poses_->weights[frame];
  const std::vector<double>& weights = own.empty() ? source_.mesh_weights : own;
  for (size_t i = 0; i < source_.targets.size() && i < weights.size(); ++i)
    if (weights[i] != 0.0) add_target(source_.targets[i], weights[i], moved);
  std::vector<float> no_normals;
  if (const JointMaps& joints = poses_->joints[frame]) move_with_joints(*joints, source_.joints, moved, no_normals);
  std::vector<Vec3> result;
  result.reserve(moved.size() / 3);
  for (size_t v = 0; v < moved.size() / 3; ++v)
    if (source_.used[v]) result.emplace_back(moved[3 * v], moved[3 * v + 1], moved[3 * v + 2]);
  return result;
}

std::string PosedFrames::name(uint32_t frame) const {
  return name_ + " at " + to_text(static_cast<double>(frame) / poses_->frames_per_second) + " s";
}

} // namespace packtrace::gltf
