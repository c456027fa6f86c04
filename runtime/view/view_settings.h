#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/base/setting.h"
#include "runtime/frame/frame_config.h"

namespace packtrace {

/// A setting as the window, scripts and files of settings show it. Everything comes from the descriptions that the
/// command line uses.
struct ViewSetting {
  std::string group; ///< "frames", "ao", "denoiser", "shading"
  std::string name;  ///< within all groups: "supersample", "ao-rate", "ao.lambda", "denoiser.window", "shade.depth"
  std::string help;
  std::vector<std::string> words; ///< the values, if they are words; else the value is a number in [low, high]
  bool is_switch = false, is_integer = false;
  double low = 0, high = 1;
  SettingRule rule = SettingRule::kAny;
  std::string value, default_value; ///< switches: "on" or "off"
};

/// All settings of a picture, in the order of their groups. The denoiser's are those of the chosen denoiser.
std::vector<ViewSetting> view_settings(const FrameConfig& config);

/// Assigns a setting. Throws Error(kUsage) for unknown names, with the closest one, and for values that are not
/// allowed.
void set_view_setting(FrameConfig& config, std::string_view name, std::string_view value);

/// Whether frames of one can continue those of the other: they differ at most in what FrameLoop::show_layers() sets.
/// Levels of detail are not compared.
bool same_frames(const FrameConfig& a, const FrameConfig& b);

/// The options of `render` that give the default settings these values, one word each.
std::vector<std::string> setting_words(const FrameConfig& config);

} // namespace packtrace
