#pragma once

#include <span>
#include <string_view>

#include "pbrt_import/base/setting.h"
#include "runtime/frame/frame_config.h"

namespace packtrace {

/// A setting of FrameConfig whose values are words. Its name with two dashes is the option of `render`.
struct WordSetting {
  std::string_view name;
  std::string_view help; ///< without the default
  std::span<const std::string_view> words;
  std::string_view (*get)(const FrameConfig& config);
  void (*set)(FrameConfig& config, std::string_view word); ///< the word must be one of `words`
};

/// ao-resolution, ao-rate, ao-sampler, denoiser and tone-map. The only description of them: options, help and the
/// viewer use it.
std::span<const WordSetting> word_settings();

/// Returns the setting with this name, which must exist.
const WordSetting& word_setting(std::string_view name);

/// Numbers and switches of FrameConfig itself, but its size: supersample, jitter and exposure.
std::span<const Setting<FrameConfig>> frame_settings();

} // namespace packtrace
