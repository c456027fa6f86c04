#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "runtime/layered/layered_denoiser.h"
#include "runtime/view/layer_previews.h"

namespace packtrace {

/// The options of `denoise`.
struct DenoiseOptions {
  std::vector<std::string> inputs, outputs, aovs;
  NamedLayers layers;
  std::string depth_kind = "z";
  std::optional<double> fov;
  std::optional<float> far_depth;
  bool inverted_ao = false, unsigned_normals = false, still = false, stratified = false, no_legend = false;
  uint32_t samples = 1; ///< per pixel and picture
  std::optional<std::string> motion_scale, background;
  std::optional<uint64_t> frames, start;
  std::vector<uint64_t> cuts; ///< numbers of pictures that begin a shot
  std::string denoiser = "ours";
  std::vector<std::string> denoiser_settings; ///< NAME=VALUE
};

/// Adds all options of `denoise` to the verb. `options` must outlive it.
void add_denoise_options(CLI::App& verb, DenoiseOptions& options);

/// What to do with the pictures. Throws Error(kUsage) for values out of range.
LayeredConfig layered_config(const DenoiseOptions& options);

} // namespace packtrace
