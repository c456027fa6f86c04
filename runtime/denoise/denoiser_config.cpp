#include "runtime/denoise/denoiser_config.h"

#include <bit>
#include <string>
#include <string_view>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

template <typename T>
void require_range(std::string_view name, T value, T low, T high) {
  if (value >= low && value <= high) return; // false for NaN
  throw Error(ErrorKind::kUsage, "denoiser: " + std::string(name) + " is " + std::to_string(value) + ", not in [" +
                                     std::to_string(low) + ".." + std::to_string(high) + "]");
}

void require_power_of_two(std::string_view name, uint32_t value) {
  require_range<uint32_t>(name, value, 1, 1024);
  if (!std::has_single_bit(value))
    throw Error(ErrorKind::kUsage,
                "denoiser: " + std::string(name) + " is " + std::to_string(value) + ", not a power of two");
}

} // namespace

void DenoiserConfig::validate() const {
  require_range<uint32_t>("max_tspp", max_tspp, 1, 65535);
  require_range<uint32_t>("max_tspp_moving", max_tspp_moving, 1, 65535);
  require_range<uint32_t>("fast_frames", fast_frames, 1, 64);
  require_range<uint32_t>("window", window, 3, 9);
  if (window % 2 == 0) throw Error(ErrorKind::kUsage, "denoiser: window is " + std::to_string(window) + ", not odd");
  require_range("change_gamma", change_gamma, 0.1f, 10.0f);
  require_range("change_tolerance", change_tolerance, 0.0f, 1.0f);
  require_range("change_response", change_response, 0.0f, 100.0f);
  require_range("reprojection_depth", reprojection_depth, 0.0f, 1.0f);
  require_range("reprojection_slope", reprojection_slope, 0.0f, 10.0f);
  require_power_of_two("reprojection_normal_power", reprojection_normal_power);
  require_power_of_two("blur_normal_power", blur_normal_power);
  require_range("blur_depth", blur_depth, 0.0f, 1.0f);
  require_range("blur_slope", blur_slope, 0.0f, 10.0f);
  require_range("blur_limit", blur_limit, 1.25f, 100.0f);
  require_range("blur_trust_frames", blur_trust_frames, 0.0f, 1000.0f);
  require_range<uint32_t>("blur_fade_begin", blur_fade_begin, 0, 65535);
  require_range<uint32_t>("blur_fade_end", blur_fade_end, 0, 65535);
  if (blur_fade_begin >= blur_fade_end)
    throw Error(ErrorKind::kUsage, "denoiser: blur_fade_begin is " + std::to_string(blur_fade_begin) +
                                       ", not below blur_fade_end, " + std::to_string(blur_fade_end));
  require_range<uint32_t>("disocclusion_frames", disocclusion_frames, 1, 65535);
}

} // namespace packtrace
