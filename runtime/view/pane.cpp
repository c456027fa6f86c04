#include "runtime/view/pane.h"

#include "runtime/view/view_settings.h"

namespace packtrace {
namespace {

constexpr uint32_t kGroundTruthSpp = 4; ///< as `render --ground-truth`

MemoryReservation reserve_pane(const FrameConfig& config, const MemoryBudget& budget) {
  return {budget, picture_bytes(config), "the picture of a view"};
}

} // namespace

FrameConfig PaneState::rendered_config() const {
  FrameConfig rendered = config;
  if (!ground_truth()) return rendered;
  rendered.denoise = false;
  rendered.ao_resolution = AoResolution::kFull, rendered.ao_rate = AoRate::kFull;
  if (rendered.ao.spp == AoConfig().spp) rendered.ao.spp = kGroundTruthSpp;
  return rendered;
}

PaneRenderer::PaneRenderer(const ViewFile& file, bool played, const FrameConfig& config, const MemoryBudget& budget)
    : owner_(file.owner.get()), played_(played), memory_(reserve_pane(config, budget)),
      loop_(std::make_unique<FrameLoop>(played ? file.moving : file.at_rest, config)) {}

bool PaneRenderer::fits(const ViewFile& file, bool played) const {
  return owner_ == file.owner.get() && played_ == played;
}

bool PaneRenderer::configure(const FrameConfig& config) {
  if (same_frames(loop_->config(), config)) {
    loop_->show_layers(config);
    return false;
  }
  config.validate();
  memory_.resize(picture_bytes(config), "the picture of a view");
  loop_->configure(config);
  return true;
}

void PaneRenderer::restart() { loop_->reset(); }

void PaneRenderer::next_frame(const Camera& camera, double time_s, Progress& progress) {
  report_ = {};
  report_.add(loop_->next_frame(camera, time_s, progress));
}

void PaneRenderer::resolve() { loop_->resolve(image_, report_); }

} // namespace packtrace
