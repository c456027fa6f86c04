#include "runtime/frame/frame_shading.h"

namespace packtrace {

const ShadeScene& FrameShading::prepare(const SceneSource& source, const std::optional<MemoryBudget>& memory) {
  if (!scene_) scene_ = std::make_unique<ShadeScene>(source, memory);
  return *scene_;
}

uint64_t FrameShading::add(const Frame& frame, const FrameConfig& config, Progress& progress) {
  scene_->turn_lights(config.shade.light_turn);
  const uint64_t rays = trace_shading(frame.source, frame.tracer, *scene_, frame.view, frame.gbuffer, config.shade,
                                      frame.samples, shaded_, progress);
  const bool changed = frame.changed || lights_turned_;
  lights_turned_ = false;
  ShadedHistory history = ShadedHistory::kSamePixels;
  if (frame.moved || changed) {
    history = changed ? ShadedHistory::kChanged : ShadedHistory::kMotion;
    if (!config.denoise) history = ShadedHistory::kNone;
  }
  mean_.add(shaded_, frame.gbuffer, history);
  if (config.denoise) mean_.keep_surfaces(frame.gbuffer);
  return rays;
}

void FrameShading::resolve(const FrameConfig& config, const ShadedGuides* guides, std::span<const float> ao,
                           RenderedImage& image) {
  resolve_shading(config, guides != nullptr ? mean_.denoised(*guides) : mean_.pixels(), ao, image);
}

} // namespace packtrace
