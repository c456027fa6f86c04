#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/render/ao_options.h"
#include "runtime/commands/render/lod_render.h"
#include "runtime/commands/render/shade_options.h"
#include "runtime/commands/sequence/sequence_options.h"
#include "runtime/frame/still.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/view/layer_previews.h"
#include "runtime/view/layers.h"

namespace packtrace {

/// The options of `render`.
struct RenderOptions {
  std::string input;
  std::vector<std::string> outputs, aovs;
  std::optional<std::string> camera; ///< number or "auto"; if not set, camera 0, or "auto" if that sees nothing
  std::string size;
  std::optional<std::string> background; ///< background of .png files; if not set, it depends on the layer
  bool no_legend = false;
  bool private_copy = false;
  uint32_t supersample = 1;
  std::optional<uint32_t> spp;
  std::optional<uint64_t> frames; ///< of a still; with --path the number of pictures
  bool ground_truth = false, no_jitter = false, fast_edges = false;
  std::string denoiser = "ours";
  std::vector<std::string> denoiser_settings; ///< NAME=VALUE
  AoOptions ao;
  ShadeOptions shade;
  SceneOptions scene;
  uint64_t seed = 0;
  std::optional<std::string> backend; ///< if not set, the input decides
  std::optional<std::string> gpu_device;
  std::optional<std::string> bvh;
  LodOptions lod;
  std::optional<double> proxy_beyond_px; ///< FrameConfig::proxy_beyond_px
  std::optional<double> proxy_error;     ///< FrameConfig::proxy_error
  SequenceOptions sequence;
};

/// Adds all options of `render` to the verb. `options` must outlive it.
void add_render_options(CLI::App& verb, RenderOptions& options);

/// Parts of add_render_options() that other verbs have too: where the view is from and its size; rays, samples and the
/// denoiser; the tracer.
void add_view_options(CLI::App& verb, RenderOptions& options);
void add_quality_options(CLI::App& verb, RenderOptions& options);
void add_tracer_options(CLI::App& verb, RenderOptions& options);

/// The settings of frames, without a size, and with a radius of 0 unless one is given. Throws Error(kUsage) for values
/// out of range.
FrameConfig frame_config(const RenderOptions& options, const DetailConfig& detail);

/// What to render with the camera. Throws Error(kUsage) for values out of range.
/// @param detail detail_config()
StillConfig make_config(const SceneSource& source, const Camera& camera, const RenderOptions& options,
                        const DetailConfig& detail);

/// @param baked whether the input is a .ptk file
/// Throws Error(kUsage) for contradictory options.
TracerConfig tracer_config(const RenderOptions& options, const GlobalOptions& globals, bool baked);

/// Whether the result is denoised.
bool denoises(const RenderOptions& options);

/// Throws Error(kUsage) for layers of the denoiser without one.
void require_denoiser_for(const std::vector<std::string>& layers, bool denoise);

/// Throws Error(kUsage) for layers of shading without it.
void require_shading_for(const std::vector<std::string>& layers, const RenderOptions& options);

/// The layers that a render has.
AvailableLayers available_layers(const RenderOptions& options, const DetailConfig& detail);

PreviewStyle preview_style(const RenderOptions& options);

} // namespace packtrace
