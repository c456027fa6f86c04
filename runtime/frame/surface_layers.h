#pragma once

#include <array>

#include "runtime/camera/gbuffer.h"
#include "runtime/camera/ray_costs.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Layers that FrameConfig::surface_layers fills.
inline constexpr std::array kSurfaceLayers{"material_flags", "cluster"};
/// Layers that FrameConfig::cost_layers fills. Batches decoded are not among them: they depend on what a thread has
/// decoded before.
inline constexpr std::array kCostLayers{"visited_nodes", "visited_leaves", "tested_triangles"};

/// Writes the surface of the first sub-pixel of each pixel that hits something.
/// @param gbuffer camera rays of config.traced_size()
/// @param source, traced the scene's source, and that of the camera rays' tracer
void write_surface_layers(const FrameConfig& config, const GBuffer& gbuffer, const SceneSource& source,
                          const SceneSource& traced, RenderedImage& image);

/// Writes the means over the sub-pixels of each pixel.
/// @param costs of config.traced_size()
void write_cost_layers(const FrameConfig& config, const RayCosts& costs, RenderedImage& image);

} // namespace packtrace
