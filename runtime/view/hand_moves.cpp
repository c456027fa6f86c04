#include "runtime/view/hand_moves.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr double kFarthest = 1e30; ///< as files of keys

} // namespace

void HandMoves::move(const ViewFile& file, uint32_t instance, DVec3 by) {
  const MotionTarget* const target =
      file.targets && instance < file.targets().instances.size() ? &file.targets().instances[instance] : nullptr;
  if (target == nullptr || target->fixed)
    throw Error(ErrorKind::kUsage, "\"" + (target != nullptr ? target->name : file.name) +
                                       "\" is part of the world's geometry, which cannot move");
  const auto found = moved_.find(instance);
  const DVec3 moved = by + (found != moved_.end() ? found->second : DVec3(0.0));
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(moved[axis]) <= kFarthest)) throw Error(ErrorKind::kUsage, "an instance cannot be moved that far");
  moved_[instance] = moved;
  update(file);
}

void HandMoves::put_back(const ViewFile& file, uint32_t instance) {
  if (moved_.erase(instance) > 0) update(file);
}

std::vector<Displacement> HandMoves::displacements() const {
  std::vector<Displacement> all;
  for (const auto& [instance, by] : moved_) all.push_back({instance, by});
  return all;
}

void HandMoves::update(const ViewFile& file) {
  keys_file_ = kUnsavedKeys;
  motion_.reset();
  if (moved_.empty()) return;
  const MotionTargets& targets = file.targets();
  SceneMotion motion = *file.motion;
  motion.add(displacement_motion(displacements(), targets), targets);
  motion_ = std::make_shared<const SceneMotion>(std::move(motion));
}

DVec3 HandMoves::centre(const ViewFile& file, uint32_t instance, double time_s) const {
  const MotionTarget& target = file.targets().instances[instance];
  const SceneMotion& motion = motion_ ? *motion_ : *file.motion;
  const auto moving = motion.moving_instances();
  const auto found = std::ranges::lower_bound(moving, instance);
  const DAffine world_from_object = found != moving.end() && *found == instance
                                        ? motion.pose(static_cast<size_t>(found - moving.begin()), time_s)
                                        : DAffine(target.placement);
  return target.box.empty() ? DVec3(world_from_object[3]) : transform_bounds(world_from_object, target.box).centre();
}

std::string HandMoves::keys_text(const ViewFile& file) const {
  return displacement_keys(displacements(), file.targets());
}

} // namespace packtrace
