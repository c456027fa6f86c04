#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace packtrace {

/// Wall times of a frame's passes in seconds.
struct PassTimes {
  double update_s = 0;   ///< transforms of moving instances, and the tree over placements
  double plan_s = 0;     ///< choice of LOD cuts and their clusters
  double build_s = 0;    ///< decoding and BVH construction
  double primary_s = 0;  ///< camera rays
  double ao_s = 0;       ///< occlusion rays
  double shade_s = 0;    ///< shading: paths and shadow rays
  double denoise_s = 0;  ///< reprojection, accumulation and blurs
  double upsample_s = 0; ///< of AO traced at a lower resolution, and selecting its pixels
  double resolve_s = 0;  ///< layers of the image

  PassTimes& operator+=(const PassTimes& other);
  double total_s() const {
    return update_s + plan_s + build_s + primary_s + ao_s + shade_s + denoise_s + upsample_s + resolve_s;
  }
};

/// The passes with their names in reports, in their order.
inline constexpr std::array<std::pair<const char*, double PassTimes::*>, 9> kPasses{
    {{"update", &PassTimes::update_s},
     {"plan", &PassTimes::plan_s},
     {"build", &PassTimes::build_s},
     {"primary", &PassTimes::primary_s},
     {"ao", &PassTimes::ao_s},
     {"shade", &PassTimes::shade_s},
     {"denoise", &PassTimes::denoise_s},
     {"upsample", &PassTimes::upsample_s},
     {"resolve", &PassTimes::resolve_s}}};

/// Report of a frame.
struct FrameReport {
  uint64_t number = 0; ///< from 0
  bool moved = true;   ///< false: camera and scene are those of the previous frame
  bool seen = true;    ///< false: all camera rays miss
  PassTimes times;
  uint64_t primary_rays = 0, ao_rays = 0, shade_rays = 0;
  uint32_t level_changes = 0; ///< instances that show another level by distance than in the frame before
  uint32_t rebuilt_trees = 0; ///< trees of deforming meshes that were rebuilt instead of refitted
  uint64_t hit_pixels = 0;    ///< traced pixels whose camera ray hits
  bool rebuilt = false;       ///< the LOD plan needed other trees
};

/// Sums over the frames of a picture.
struct PictureReport {
  PassTimes times;
  uint32_t frames = 0;
  uint64_t primary_rays = 0, ao_rays = 0, shade_rays = 0;
  bool seen = false;         ///< some camera ray hit
  bool rebuilt = false;      ///< as in FrameReport, in some frame
  double mean_history = 0.0; ///< mean over hit pixels of the frames of history behind them (DenoisedAo::tspp)

  void add(const FrameReport& frame);
};

} // namespace packtrace
