#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "pbrt_import/base/setting.h"
#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/reference/reference_config.h"

namespace packtrace {

/// The denoisers to choose from.
enum class DenoiserKind : uint8_t {
  kOurs,      ///< FluxConfig; the default
  kReference, ///< ReferenceConfig: the pipeline of real-time engines, for comparison
};

/// Settings of AoDenoiser. Values outside their range, including NaN, are rejected and never clamped.
struct DenoiserConfig {
  DenoiserKind kind = DenoiserKind::kOurs;
  FluxConfig ours;           ///< used by kOurs
  ReferenceConfig reference; ///< used by kReference

  /// Throws Error(kUsage) naming the first field of the chosen denoiser that is out of range.
  void validate() const;

  /// Assigns "NAME=VALUE" to a setting of the chosen denoiser. Throws Error(kUsage) for unknown names, naming the
  /// closest one, and for values that are not allowed.
  void set(std::string_view assignment);
};

/// A setting, as users see it.
struct SettingView {
  SettingInfo info;
  bool is_switch = false, is_integer = false;
  double value = 0, default_value = 0;
};

/// The settings of the chosen denoiser, in the order of its passes.
std::vector<SettingView> denoiser_settings(const DenoiserConfig& config);

} // namespace packtrace
