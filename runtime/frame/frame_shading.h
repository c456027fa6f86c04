#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/frame/shaded_filter.h"
#include "runtime/frame/shaded_mean.h"
#include "runtime/shade/path_tracer.h"

namespace packtrace {

/// The shaded half of a frame loop: lights and materials of the scene, the last shaded frame, and the means of frames.
class FrameShading {
public:
  /// A frame whose camera rays are traced.
  struct Frame {
    const SceneSource& source; ///< of the camera rays
    const RayTracer& tracer;   ///< of the camera rays
    const PrimaryCamera& view;
    const GBuffer& gbuffer;
    ShadeSamples samples;
    bool moved = false;   ///< something has moved, the camera or things
    bool changed = false; ///< something other than the camera has moved
  };

  /// Lights, materials and mip levels of textures, made at the first call.
  /// @param memory reserves the memory of the levels; unset: no limit
  /// Throws MemoryError.
  const ShadeScene& prepare(const SceneSource& source, const std::optional<MemoryBudget>& memory);
  /// Result of prepare(); null before.
  const ShadeScene* scene() const { return scene_.get(); }

  /// Shades what the camera rays hit, and adds it to the means. Returns the number of rays.
  /// @param progress can cancel it; its tiles are advanced
  uint64_t add(const Frame& frame, const FrameConfig& config, Progress& progress);
  /// Writes the shaded layers.
  /// @param guides of the mean surfaces for the filter; null: without filter
  /// @param ao denoised, one value per traced pixel
  void resolve(const FrameConfig& config, const ShadedGuides* guides, std::span<const float> ao, RenderedImage& image);

  /// Must be called if the lights of the next frame are turned differently.
  void turn_lights() { lights_turned_ = true; }
  /// Forgets all frames.
  void clear() { mean_.clear(); }
  std::vector<std::byte> save() const { return mean_.save(); }
  /// ShadedMean::restore().
  bool restore(size_t pixels, std::span<const std::byte> bytes) { return mean_.restore(pixels, bytes); }
  /// ShadedMean::keep_surfaces(); add() does so for its frame.
  void keep_surfaces(const GBuffer& gbuffer) { mean_.keep_surfaces(gbuffer); }

private:
  std::unique_ptr<ShadeScene> scene_;
  ShadedFrame shaded_;
  ShadedMean mean_;
  bool lights_turned_ = false; ///< since the last shaded frame
};

} // namespace packtrace
