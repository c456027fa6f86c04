#include "compress/format/motion/motion_summary.h"

#include <algorithm>

#include "compress/format/file/baked_file.h"
#include "compress/format/motion/motion_stream.h"

namespace packtrace {

MotionSummary summarize_motion(const BakedFile& file) {
  const BakedSections& s = file.sections();
  RigidMotion motion;
  unpack_rigid_motion(s.rigid_motion, motion); // validated when the file was opened
  MotionSummary summary;
  summary.instances = motion.instances.size(), summary.cameras = motion.cameras.size();
  summary.tracks = motion.tracks.size();
  for (const MotionTrack& track : motion.tracks) summary.keys += track.keys.size();
  summary.time = time_span(motion);
  std::vector<uint64_t> moving(s.geometries.size());
  for (const InstanceMotion& instance : motion.instances) {
    ++moving[s.instances[instance.instance].geometry];
    summary.max_error_world = std::max(summary.max_error_world, instance.error_world);
  }
  for (const CameraMotion& camera : motion.cameras)
    summary.max_camera_error = std::max(summary.max_camera_error, camera.error_world);
  for (size_t i = 0; i < moving.size(); ++i)
    if (moving[i] > 0) summary.geometries.push_back({std::string(s.text(s.geometries[i].name)), moving[i]});
  return summary;
}

} // namespace packtrace
