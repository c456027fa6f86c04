#include "runtime/denoise/reference/reference_config.h"

namespace packtrace {
namespace {

using R = ReferenceConfig;

constexpr Setting<ReferenceConfig> kReferenceSettings[] = {
    {{"pixel_spread", "World-space length of a pixel at depth 1; 0: that of the camera", 0, 10}, &R::pixel_spread},
    {{"ray_length", "Length of occlusion rays in world units; 0: that of the frame", 0, 1e12}, &R::ray_length},
    {{"depth_epsilon", "Tolerance of depths, relative to the power of two below", 0, 0.0625}, &R::depth_epsilon},
    {{"reprojection_depth_sigma", "Tolerance of old depths, in units of the change of depth per pixel", 0, 10},
     &R::reprojection_depth_sigma},
    {{"reprojection_depth_cutoff", "Weight for depth below which an old pixel is rejected", 0, 1},
     &R::reprojection_depth_cutoff},
    {{"reprojection_normal_slack", "Factor of the cosine between old and new normals before it is limited to 1", 1, 2},
     &R::reprojection_normal_slack},
    {{"reprojection_normal_power", "Exponent of the cosine between the old and the new normal", 1, 1024,
      SettingRule::kPowerOfTwo},
     &R::reprojection_normal_power},
    {{"reprojection_min_weight", "Sum of weights below which history is rejected", 0, 1}, &R::reprojection_min_weight},
    {{"window", "Side in pixels of the box for local mean and variance", 3, 9, SettingRule::kOdd}, &R::window},
    {{"max_tspp", "Maximum length of the history in frames", 1, 100}, &R::max_tspp},
    {{"min_blend", "Least weight of a new sample", 0, 1}, &R::min_blend},
    {{"clamp_gamma", "Distance from the local mean to which history is clamped, in standard deviations", 0.1, 10},
     &R::clamp_gamma},
    {{"clamp_min", "Least such distance, in AO", 0, 1}, &R::clamp_min},
    {{"clamp_response", "Fraction of the history lost per unit of AO that the clamp changed", 0, 100},
     &R::clamp_response},
    {{"variance_frames", "Frames of history from which the history's own variance is used", 1, 100},
     &R::variance_frames},
    {{"kernel_scale", "Tap distance of the blur per hit distance, for hits at the end of the ray", 0, 1},
     &R::kernel_scale},
    {{"kernel_exponent", "Exponent of hit distance over ray length in the tap distance", 0, 4}, &R::kernel_exponent},
    {{"kernel_max_width", "Maximum width of the blur as a fraction of the image's", 0, 0.1}, &R::kernel_max_width},
    {{"kernel_cycle", "Frames in which the tap distance grows to its maximum, again and again", 1, 16},
     &R::kernel_cycle},
    {{"blur_value_sigma", "Tolerance of values in the blur, in standard deviations of the samples", 0, 30},
     &R::blur_value_sigma},
    {{"blur_value_floor", "Least tolerance of values, in AO", 1e-6, 1}, &R::blur_value_floor},
    {{"blur_normal_power", "Exponent of the cosine between the normals of two pixels that are blurred", 1, 1024,
      SettingRule::kPowerOfTwo},
     &R::blur_normal_power},
    {{"blur_depth_sigma", "Tolerance of depths in the blur, in units of the pixel's slope", 0, 10},
     &R::blur_depth_sigma},
    {{"blur_depth_cutoff", "Weight for depth below which a tap is ignored", 0, 1}, &R::blur_depth_cutoff},
    {{"disocclusion_frames", "Frames of history in which the blur of uncovered surfaces fades", 1, 100},
     &R::disocclusion_frames},
    {{"disocclusion_passes", "Number of passes of that blur", 0, 4}, &R::disocclusion_passes},
    {{"disocclusion_depth", "Relative difference of depth that it tolerates", 0, 1}, &R::disocclusion_depth},
    {{"disocclusion_slope", "Relative difference of depth that it tolerates per pixel of tap distance", 0, 1},
     &R::disocclusion_slope},
};

} // namespace

std::span<const Setting<ReferenceConfig>> reference_settings() { return kReferenceSettings; }

void ReferenceConfig::validate() const { check_settings(reference_settings(), *this, "denoiser"); }

} // namespace packtrace
