#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "runtime/frame/frame_config.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/image/tone_map.h"

namespace packtrace {

/// The options of shading.
struct ShadeOptions {
  std::string view = "ao";
  float exposure = 0.0f;
  std::string tone_map = "srgb";
  std::vector<std::string> settings; ///< NAME=VALUE

  bool shades() const { return view != "ao"; }
};

/// Adds --view, --exposure, --tone-map and --shade-set. `options` must outlive the verb.
void add_shade_options(CLI::App& verb, ShadeOptions& options);

/// Applies the options. Throws Error(kUsage) for unknown names and values that are not allowed, and for
/// options that have no effect.
void apply(const ShadeOptions& options, FrameConfig& config);

Exposure exposure(const ShadeOptions& options);

/// Adds to the JSON of a picture what was shaded; nothing for ambient occlusion alone.
void add_shade_json(const ShadeOptions& options, const PictureReport& report, const FrameLoop& loop,
                    nlohmann::json& result);

/// A line for people about add_shade_json()'s keys; empty without them.
std::string shade_text(const nlohmann::json& result);

} // namespace packtrace
