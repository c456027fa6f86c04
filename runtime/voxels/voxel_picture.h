#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/voxels/voxel_scene.h"

namespace packtrace {

struct VoxelPictureConfig {
  uint32_t views = 1;   ///< rays per pixel from the camera, one of each view; >= 1
  uint32_t samples = 1; ///< occlusion rays per ray of the camera that hits; >= 1
  double radius = 1.0;  ///< of occlusion, world units; > 0
  uint32_t seed = 0;    ///< of the occlusion rays
};

/// An image of voxels.
struct VoxelPicture {
  std::vector<Vec3> color;     ///< linear: mean of albedo times visibility of the rays that hit; 0 where none does
  std::vector<float> coverage; ///< share of a pixel's rays that hit
  uint64_t rays = 0;           ///< camera and occlusion rays
  uint64_t field_pixels = 0;   ///< that show a distance field
  /// Mean over those of the difference of visibility from that of a pixel's occlusion rays: taps along the normal, and
  /// cones.
  double tap_error = 0.0, cone_error = 0.0;
};

/// Traces rays through pixels, and cosine-weighted occlusion rays from the faces that they hit. The result does not
/// depend on the number of threads.
/// @param view camera of ray 0..views - 1 of each pixel; all have the same size
/// @param progress advances by rows of each view
VoxelPicture trace_voxel_picture(const VoxelScene& scene, const std::function<PrimaryCamera(uint32_t)>& view,
                                 const VoxelPictureConfig& config, Progress& progress);

} // namespace packtrace
