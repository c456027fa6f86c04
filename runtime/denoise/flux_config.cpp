#include "runtime/denoise/flux_config.h"

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
    {{"reprojection_nearby",
      "Length of the history that a pixel without one takes over from nearby pixels, as a fraction of theirs", 0, 1},
     &F::reprojection_nearby},
    {{"passes", "Number of filter passes: the first ones of the steps 1, 2, 4 and 1 pixels", 0, 4}, &F::passes},
    {{"guide_depth", "Relative distance from the other's tangent plane at which two pixels hardly mix", 0, 1},
     &F::guide_depth},
    {{"guide_slope", "The same in units of the disparity's change along the offset", 0, 10}, &F::guide_slope},
    {{"guide_bend", "The same in units of the difference of both pixels' changes", 0, 10}, &F::guide_bend},
    {{"noise_tolerance", "Differences of patches count as noise up to this many times its variance", 0.1, 100},
     &F::noise_tolerance},
    {{"patch_limit", "Mean distance of patches at which pixels do not mix", 0.1, 25}, &F::patch_limit},
    {{"variance_prior", "Weight of the variance around a pixel against its own, in frames", 0.1, 1000},
     &F::variance_prior},
    {{"variance_distrust", "The variance of n frames is multiplied by 1 + this / n^2", 0, 1000}, &F::variance_distrust},
    {{"ratio_prior", "Weight of the average error of stratified samples against that of the image, in pixels", 0.01,
      1e6},
     &F::ratio_prior},
};

} // namespace

std::span<const Setting<FluxConfig>> flux_settings() { return kFluxSettings; }

void FluxConfig::validate() const { check_settings(flux_settings(), *this, "denoiser"); }

} // namespace packtrace
