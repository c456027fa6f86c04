#include "runtime/motion/scene_motion.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/motion/motion_stream.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// A track or an instance takes a fraction of a microsecond, so threads get many at a time.
constexpr size_t kPosesPerTask = 512;

template <typename Work>
void for_each_index(size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kPosesPerTask), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

} // namespace

SceneMotion SceneMotion::of(const BakedFile& file) {
  RigidMotion motion;
  unpack_rigid_motion(file.sections().rigid_motion, motion); // validated when the file was opened
  return {std::move(motion), motion_targets(file), file.cameras()};
}

SceneMotion SceneMotion::of(const Scene& scene) { return {scene.motion, motion_targets(scene), scene.cameras}; }

SceneMotion::SceneMotion(RigidMotion motion, const MotionTargets& targets, std::vector<Camera> cameras)
    : motion_(std::move(motion)), cameras_(std::move(cameras)) {
  prepare(targets);
}

void SceneMotion::add(const RigidMotion& motion, const MotionTargets& targets) {
  for (const InstanceMotion& moving : motion.instances)
    if (moving.instance >= targets.instances.size() || targets.instances[moving.instance].fixed)
      throw Error(ErrorKind::kUsage, "instance " + std::to_string(moving.instance) + " cannot move");
  add_motion(motion_, motion);
  prepare(targets);
}

void SceneMotion::prepare(const MotionTargets& targets) {
  numbers_.clear(), placements_.clear(), bounds_ = {};
  for (const InstanceMotion& moving : motion_.instances) {
    const MotionTarget& target = targets.instances[moving.instance];
    numbers_.push_back(moving.instance);
    placements_.push_back(target.placement);
    bounds_.extend(swept_bounds(motion_, moving, target.placement, target.box));
  }
  const TimeSpan span = time_span(motion_);
  span_ = span.begin_s <= span.end_s ? span : TimeSpan{0.0, 0.0};
}

void SceneMotion::pose(double time_s, std::span<Affine> world_from_object) const {
  assert(world_from_object.size() == numbers_.size());
  std::vector<DAffine> tracks(motion_.tracks.size()); // many instances may share one
  for_each_index(tracks.size(), [&](size_t i) { tracks[i] = packtrace::pose(motion_.tracks[i], time_s); });
  for_each_index(numbers_.size(), [&](size_t i) {
    world_from_object[i] = Affine(pose_from_tracks(motion_.instances[i], placements_[i], tracks));
  });
}

DAffine SceneMotion::pose(size_t moving, double time_s) const {
  return packtrace::pose(motion_, motion_.instances[moving], placements_[moving], time_s);
}

bool SceneMotion::camera_moves(uint32_t index) const {
  return std::any_of(motion_.cameras.begin(), motion_.cameras.end(),
                     [&](const CameraMotion& one) { return one.camera == index; });
}

std::optional<Camera> SceneMotion::camera(uint32_t index, double time_s) const {
  if (index >= cameras_.size()) return std::nullopt;
  Camera camera = cameras_[index];
  for (const CameraMotion& moving : motion_.cameras)
    if (moving.camera == index) camera.world_from_camera = packtrace::pose(motion_.tracks[moving.track], time_s);
  return camera;
}

} // namespace packtrace
