#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "runtime/frame/frame_config.h"

namespace packtrace {

/// The options of ambient occlusion.
struct AoOptions {
  std::string resolution = "full", rate = "full", sampler = "net";
  std::optional<float> radius;
  bool no_falloff = false;
  std::optional<float> interreflection;
  std::vector<std::string> settings; ///< NAME=VALUE
};

/// Adds the option of a word_setting() with its help, words and default. `value` must outlive the verb.
/// @param value in: the default
CLI::Option* add_word_option(CLI::App& verb, std::string_view name, std::string& value);

/// Adds the options whose names begin with --ao. `options` must outlive the verb.
void add_ao_options(CLI::App& verb, AoOptions& options);

/// Applies the options. Throws Error(kUsage) for unknown names and values that are not allowed.
void apply(const AoOptions& options, FrameConfig& config);

} // namespace packtrace
