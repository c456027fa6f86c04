#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/voxels/voxel_scene.h"

namespace packtrace {

struct VoxelPictureConfig {
  uint32_t samples = 16; ///< occlusion rays per pixel
  double radius = 1.0;   ///< of occlusion, world units; > 0
};

/// What a camera sees of voxels.
struct VoxelPicture {
  std::vector<Vec3> color;     ///< linear: albedo times visibility; 0 where nothing is hit
  std::vector<float> coverage; ///< 1 where a voxel is hit, else 0
  uint64_t rays = 0;           ///< camera and occlusion rays
  uint64_t field_pixels = 0;   ///< that show a distance field
  /// Mean over those of the difference of visibility from that of the occlusion rays: taps along the normal, and cones.
  double tap_error = 0.0, cone_error = 0.0;
};

/// Traces a ray through each pixel's centre, and cosine-weighted occlusion rays from the face that it hits. The result
/// does not depend on the number of threads.
/// @param progress advances by rows
VoxelPicture trace_voxel_picture(const VoxelScene& scene, const PrimaryCamera& camera, const VoxelPictureConfig& config,
                                 Progress& progress);

} // namespace packtrace
