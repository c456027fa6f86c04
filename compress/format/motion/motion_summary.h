#pragma once

#include <string>
#include <vector>

#include "pbrt_import/scene/motion_pose.h"

namespace packtrace {

class BakedFile;

/// Moving instances of one geometry.
struct MovingGeometry {
  std::string name;
  uint64_t instances = 0;
};

/// The rigid motion of a file.
struct MotionSummary {
  uint64_t instances = 0, cameras = 0, tracks = 0, keys = 0;
  TimeSpan time;                          ///< empty if nothing moves
  double max_error_world = 0.0;           ///< largest stated error of the instances, world units
  double max_camera_error = 0.0;          ///< largest stated error of the cameras
  std::vector<MovingGeometry> geometries; ///< in the order of the file's geometries
};

MotionSummary summarize_motion(const BakedFile& file);

} // namespace packtrace
