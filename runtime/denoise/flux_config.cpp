#include "runtime/denoise/flux_config.h"

#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

using F = FluxConfig;

constexpr Setting<FluxConfig> kFluxSettings[] = {
    {{"max_tspp", "Maximum length of the history of still pixels, in frames", 1, 65535}, &F::max_tspp},
    {{"max_tspp_moving", "Maximum length of the history of moving pixels, in frames", 1, 65535}, &F::max_tspp_moving},
    {{"fast_frames", "Length in frames of the fast history, which detects changes of the scene", 1, 64},
     &F::fast_frames},
    {{"window", "Side in pixels of the window for local mean, variance and change", 3, 9, SettingRule::kOdd},
     &F::window},
    {{"change_gamma", "Difference of the window means of both histories that is a change, in standard errors", 0.1, 10},
     &F::change_gamma},
    {{"change_tolerance", "Difference of the window means that is tolerated besides, in AO", 0, 1},
     &F::change_tolerance},
    {{"change_response", "Fraction of the history lost per unit of corrected AO", 0, 100}, &F::change_response},
    {{"reprojection_depth", "Relative difference of disparity at which history is rejected, halved", 0, 1},
     &F::reprojection_depth},
    {{"reprojection_slope", "The same in units of the disparity's change per pixel", 0, 10}, &F::reprojection_slope},
    {{"reprojection_normal_power", "Exponent of the cosine between the old and the new normal", 1, 1024,
      SettingRule::kPowerOfTwo},
     &F::reprojection_normal_power},
    {{"reprojection_instance_test", "Reject history of another instance", 0, 1}, &F::reprojection_instance_test},
    {{"blur_normal_power", "Exponent of the cosine between the normals of two pixels that are blurred", 1, 1024,
      SettingRule::kPowerOfTwo},
     &F::blur_normal_power},
    {{"blur_depth", "Relative distance from the other's tangent plane at which two pixels are not blurred", 0, 1},
     &F::blur_depth},
    {{"blur_slope", "The same in units of the disparity's change along the tap offset", 0, 10}, &F::blur_slope},
    {{"blur_limit", "Squared difference of two patches in units of the noise at which they are not blurred", 1.25, 100},
     &F::blur_limit},
    {{"blur_trust_frames", "Histories not much longer than this many frames hardly count as edges", 0, 1000},
     &F::blur_trust_frames},
    {{"blur_fade_begin", "Frames of history at which the blur begins to fade", 0, 65535}, &F::blur_fade_begin},
    {{"blur_fade_end", "Frames of history at which the blur ends; above blur_fade_begin", 0, 65535}, &F::blur_fade_end},
    {{"disocclusion_frames", "Frames of history at which the wide blur ends", 1, 65535}, &F::disocclusion_frames},
};

} // namespace

std::span<const Setting<FluxConfig>> flux_settings() { return kFluxSettings; }

void FluxConfig::validate() const {
  check_settings(flux_settings(), *this, "denoiser");
  if (blur_fade_begin >= blur_fade_end)
    throw Error(ErrorKind::kUsage, "denoiser: blur_fade_begin is " + std::to_string(blur_fade_begin) +
                                       ", not below blur_fade_end, " + std::to_string(blur_fade_end));
}

} // namespace packtrace
