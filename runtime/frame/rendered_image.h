#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/scene/image_size.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Layers of a rendered view, rows top to bottom, one entry per pixel. They are means over the camera rays of a pixel
/// that hit, unless stated otherwise: those of all sub-pixels (FrameConfig::supersample) in all frames since something
/// moved (FrameConfig::jitter). Where all camera rays of a pixel miss, ao and ao_raw are kInvalidAo, instance is
/// kNoInstance and all other layers are 0.
struct RenderedImage {
  ImageSize size;
  std::vector<float> ao;          ///< denoised; without the denoiser the mean over all frames
  std::vector<float> ao_raw;      ///< AO of the last frame alone, not denoised; kInvalidAo where its camera rays miss
  std::vector<float> depth;       ///< camera-space z, world units
  std::vector<float> coverage;    ///< fraction of the camera rays that hit, [0, 1]
  std::vector<Vec3> normal;       ///< world space
  std::vector<Vec3> albedo;       ///< linear sRGB
  std::vector<Vec3> shaded;       ///< albedo times ao, as under a uniform white sky; emitters are white; linear sRGB
  std::vector<uint32_t> instance; ///< of the first camera ray that hits
  // The next three are empty unless FrameConfig::shades(). They are means over all camera rays, those that miss too.
  std::vector<Vec3> pbr;      ///< direct + specular + ambient light; linear sRGB radiance, not exposed
  std::vector<Vec3> direct;   ///< light of lights at the surface, its emission; the background where nothing is hit
  std::vector<Vec3> specular; ///< seen by reflection and through glass
  // The views (runtime/frame/view_layers.h) are empty unless FrameConfig::view_layers is set; the last three also
  // without the denoiser. They are those of the last frame, and 0 where its camera rays miss.
  std::vector<float>
      hit_distance;         ///< mean distance of the occlusion rays' hits, world units; a miss counts as the radius
  std::vector<Vec2> motion; ///< pixels from where the previous image shows the surface, x right, y down
  std::vector<float> previous_depth; ///< depth of the surface in the previous image; 0 where its camera cannot see it
  std::vector<float> local_variance; ///< of the samples in 7 x 7 pixels
  std::vector<float> variance;       ///< of the mean that is denoised (DenoisedAo::variance)
  std::vector<float> history;        ///< frames of history (DenoisedAo::tspp)
  std::vector<float> disocclusion;   ///< 1 where the history began after the last movement
  // Of the last frame's camera rays; empty unless FrameConfig::surface_layers is set, then `cluster` is set, too.
  std::vector<uint32_t> material_flags; ///< bits of MaterialFlags
  // The costs are empty unless FrameConfig::cost_layers is set. They count for rays that miss, too.
  std::vector<float> visited_nodes, visited_leaves; ///< of all trees, by a camera ray that is traced alone
  std::vector<float> tested_triangles;              ///< the same
  // The LOD layers are empty unless FrameConfig::lod_layers is set.
  std::vector<uint32_t> lod;     ///< LOD level at the last camera ray that hits
  std::vector<uint32_t> cluster; ///< cluster number at the last camera ray that hits
  std::vector<float> lod_error;  ///< largest error bound (distance from level 0), in traced pixels
  double max_lod_error_px = 0.0; ///< DetailConfig::error_px; 0 without levels
};

} // namespace packtrace
