#pragma once

#include <string>
#include <vector>

#include "runtime/frame/rendered_image.h"
#include "runtime/image/exr.h"

namespace packtrace {

/// Properties of an image that decide which layers it has.
struct AvailableLayers {
  bool levels = false;   ///< camera rays use LOD levels
  bool denoiser = false; ///< it is denoised, by a frame loop
  bool views = true;     ///< it is rendered, not read from a file
  bool shaded = false;   ///< it is rendered with FrameConfig::shades()
};

/// Names of the layers that a render can write.
const std::vector<std::string>& aov_names();

/// Returns the layers to write, without repetitions; "all" are those that cost little. Throws Error(kUsage) for unknown
/// layers.
/// @param aovs layers from aov_names(), or "all"; empty: "pbr" of shaded images, else "ao"
std::vector<std::string> chosen_layers(const std::vector<std::string>& aovs, AvailableLayers available);

/// Same for an .exr file: without `aovs` the layers of the result, without views of intermediate ones.
std::vector<std::string> chosen_exr_layers(const std::vector<std::string>& aovs, AvailableLayers available);

/// Whether one of the layers is a view of intermediate results (runtime/frame/view_layers.h), and whether one needs the
/// denoiser.
bool has_view_layer(const std::vector<std::string>& layers);
bool has_denoiser_layer(const std::vector<std::string>& layers);

/// The FrameConfig::plain_layers that showing a layer needs.
uint32_t plain_layers_of(const std::string& layer);

/// Whether one of the layers needs a shaded image.
bool has_shaded_layer(const std::vector<std::string>& layers);

/// Whether one of the layers is one of kSurfaceLayers, and of kCostLayers (runtime/frame/surface_layers.h).
bool has_surface_layer(const std::vector<std::string>& layers);
bool has_cost_layer(const std::vector<std::string>& layers);

/// A layer of an .exr file, which refers to the image.
/// @param aov one of aov_names()
Layer exr_layer(const RenderedImage& image, const std::string& aov);

/// Whether one of the layers needs LOD levels.
bool has_lod_layer(const std::vector<std::string>& layers);

} // namespace packtrace
