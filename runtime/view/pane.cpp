#include "runtime/view/pane.h"

#include "runtime/view/layers.h"
#include "runtime/view/view_settings.h"

namespace packtrace {
namespace {

constexpr uint32_t kGroundTruthSpp = 4; ///< as `render --ground-truth`

MemoryReservation reserve_pane(const FrameConfig& config, const MemoryBudget& budget) {
  return {budget, picture_bytes(config), "the picture of a view"};
}

/// The bounds of what moves, with room to move about.
Bounds wide_bounds(const SceneMotion& motion, const SceneSource& source) {
  Bounds bounds = motion.moving_bounds();
  bounds.extend(source.world_bounds());
  const DVec3 room(0.5 * bounds.diagonal());
  bounds.lo -= room, bounds.hi += room;
  return bounds;
}

FrameScene frame_scene(const PaneRenderer::Scene& scene) {
  if (!scene.by_hand) return scene.played ? scene.file.moving : scene.file.at_rest;
  FrameScene moved = scene.file.moving;
  moved.motion = scene.by_hand.get();
  if (scene.moving) moved.motion_bounds = wide_bounds(*scene.by_hand, *moved.source);
  return moved;
}

} // namespace

FrameView PaneState::view() const {
  if (layer == kPbrAo) return FrameView::kPbrAo;
  return has_shaded_layer({layer}) ? FrameView::kPbr : FrameView::kAo;
}

FrameConfig PaneState::rendered_config() const {
  FrameConfig rendered = config;
  rendered.view = view();
  if (!rendered.shades()) rendered.shade = {};
  if (!ground_truth()) return rendered;
  rendered.denoise = false;
  rendered.ao_resolution = AoResolution::kFull, rendered.ao_rate = AoRate::kFull;
  if (rendered.ao.spp == AoConfig().spp) rendered.ao.spp = kGroundTruthSpp;
  return rendered;
}

PaneRenderer::PaneRenderer(const Scene& scene, const FrameConfig& config, const MemoryBudget& budget)
    : owner_(scene.file.owner.get()), played_(scene.played), by_hand_(scene.by_hand),
      wide_(scene.by_hand && scene.moving), memory_(reserve_pane(config, budget)),
      loop_(std::make_unique<FrameLoop>(frame_scene(scene), config)) {}

bool PaneRenderer::follow(const Scene& scene) {
  if (owner_ != scene.file.owner.get() || played_ != scene.played) return false;
  if (by_hand_ == scene.by_hand) return scene.moving || !wide_;
  if (!by_hand_ || !scene.by_hand || !scene.moving || !loop_->follow_motion(*scene.by_hand)) return false;
  by_hand_ = scene.by_hand;
  wide_ = true;
  return true;
}

bool PaneRenderer::configure(const FrameConfig& config) {
  FrameConfig lit = loop_->config();
  const bool turned = lit.shade.light_turn != config.shade.light_turn;
  lit.shade.light_turn = config.shade.light_turn;
  if (same_frames(lit, config)) {
    loop_->turn_lights(config.shade.light_turn);
    loop_->show_layers(config);
    return turned;
  }
  config.validate();
  memory_.resize(picture_bytes(config), "the picture of a view");
  loop_->configure(config);
  return true;
}

void PaneRenderer::restart() { loop_->reset(); }

void PaneRenderer::next_frame(const Camera& camera, double time_s, bool passing, Progress& progress) {
  report_ = {};
  loop_->expect_movement(passing);
  if (passing) image_ = {}; // frees memory before camera rays are traced
  report_.add(loop_->next_frame(camera, time_s, progress));
}

void PaneRenderer::resolve() {
  loop_->resolve(image_, report_);
  complete_ = loop_->config().plain_layers == kAllPlainLayers;
}

void PaneRenderer::complete() {
  if (complete_) return;
  const FrameConfig shown = loop_->config();
  FrameConfig all = shown;
  all.plain_layers = kAllPlainLayers;
  all.view_layers = all.surface_layers = all.cost_layers = false; // they stay as they are
  loop_->show_layers(all);
  PictureReport seen_before;
  loop_->resolve(image_, seen_before);
  loop_->show_layers(shown);
  complete_ = true;
}

} // namespace packtrace
