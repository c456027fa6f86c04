#include "runtime/view/view_session.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"
#include "runtime/view/layer_previews.h"
#include "runtime/view/layers.h"
#include "runtime/view/view_settings.h"

namespace packtrace {
namespace {

constexpr double kMaxGain = 1000.0;

void require_view(bool condition, const std::string& message) {
  if (!condition) throw Error(ErrorKind::kUsage, message);
}

/// Adds what a pane's frame cost. The history is that of the first pane.
void add_report(const PictureReport& of_pane, PictureReport& sum) {
  if (sum.frames == 0) sum.mean_history = of_pane.mean_history;
  sum.times += of_pane.times;
  sum.frames += of_pane.frames;
  sum.primary_rays += of_pane.primary_rays, sum.ao_rays += of_pane.ao_rays;
  sum.seen = sum.seen || of_pane.seen;
}

} // namespace

std::vector<std::string> view_layer_names() {
  std::vector<std::string> names = aov_names();
  names.insert(std::ranges::find(names, "pbr") + 1, PaneState::kPbrAo);
  names.insert(names.begin() + 1, PaneState::kGroundTruth);
  return names;
}

ViewSession::ViewSession(std::vector<ViewFile> files, ViewCamera camera, const Config& config)
    : files_(std::move(files)), camera_(std::move(camera)), size_(config.size), memory_(config.memory),
      quality_(config.target_ms), hand_moves_(files_.size()) {
  for (PaneState& pane : panes_) pane.config = config.frame;
  if (files_.size() < 2) return;
  panes_[1].file = 1;
  if (!camera_.key()) camera_.set(camera_.current_key()); // the other files may have other cameras
}

void ViewSession::add_file(ViewFile file) {
  files_.push_back(std::move(file));
  hand_moves_.emplace_back();
  if (!camera_.key()) camera_.set(camera_.current_key());
}

void ViewSession::replace_file(size_t index, ViewFile file, const ViewCamera& start) {
  for (size_t pane = 0; pane < renderers_.size(); ++pane)
    if (panes_[pane].file == index) renderers_[pane].reset(); // they refer to the old file
  files_.at(index) = std::move(file);
  hand_moves_[index] = {};
  if (selection_ && selection_->file == index) selection_.reset();
  if (time_ && !files_[index].moves()) time_.reset();
  if (index == 0) camera_.change_scene(start);
  restart_ = changed_ = true;
}

void ViewSession::resize(ImageSize size) {
  FrameConfig sized = panes_[0].config;
  sized.size = size;
  sized.validate();
  changed_ = changed_ || size_ != size;
  size_ = size;
}

void ViewSession::require_layer(const PaneState& pane) const {
  const std::vector<std::string> names = view_layer_names();
  if (std::ranges::find(names, pane.layer) == names.end()) {
    const std::vector<std::string_view> known(names.begin(), names.end());
    throw Error(ErrorKind::kUsage, "no such view: " + pane.layer + did_you_mean_text(closest_name(pane.layer, known)));
  }
  require_view(pane.view() == FrameView::kAo || files_[pane.file].at_rest.source->has_shading(),
               pane.layer + ": " + files_[pane.file].name +
                   " holds no materials and lights; bake it with --for shading");
  require_view(!has_denoiser_layer({pane.layer}) || pane.config.denoise, pane.layer + " requires a denoiser");
  require_view(!has_cost_layer({pane.layer}) || files_[pane.file].at_rest.backend.backend == Backend::kPacked,
               pane.layer + " requires --backend packed");
  require_view(!has_lod_layer({pane.layer}) || pane.config.detail.camera_uses_levels(),
               pane.layer + " requires --lod-error, and --lod-rays all");
}

void ViewSession::change_pane(size_t index, const PaneState& changed) {
  require_layer(changed);
  panes_.at(index) = changed;
  changed_ = true;
}

void ViewSession::set_layer(size_t pane, const std::string& layer) {
  PaneState changed = panes_.at(pane);
  changed.layer = layer;
  change_pane(pane, changed);
}

void ViewSession::set_file(size_t pane, size_t file) {
  require_view(file < files_.size(), fmt::format("there is no file {}, only {}", file, files_.size()));
  PaneState changed = panes_.at(pane);
  changed.file = file;
  change_pane(pane, changed);
}

void ViewSession::set_setting(size_t pane, std::string_view name, std::string_view value) {
  PaneState changed = panes_.at(pane);
  set_view_setting(changed.config, name, value);
  change_pane(pane, changed);
}

void ViewSession::set_split(SplitMode mode) {
  split_ = mode;
  changed_ = true;
}

void ViewSession::set_target_ms(double target_ms) {
  require_view(target_ms >= 0.0 && target_ms <= 1e6, "the target must be in [0, 1000000] ms");
  quality_ = QualityControl(target_ms);
}

void ViewSession::set_divider(double fraction) { divider_ = std::clamp(fraction, 0.0, 1.0); }

void ViewSession::set_gain(double gain) {
  require_view(gain > 0.0 && gain <= kMaxGain, "the gain must be above 0 and at most 1000");
  gain_ = gain;
}

void ViewSession::fix_quality(std::optional<uint32_t> step) {
  require_view(!step || *step <= kCheapestStep, fmt::format("quality steps are 0 to {}", kCheapestStep));
  fixed_quality_ = step;
}

void ViewSession::set_time(std::optional<double> time_s) {
  require_view(!time_s || files_[panes_[0].file].moves(), "nothing moves in " + files_[panes_[0].file].name);
  require_view(!time_s || std::isfinite(*time_s), "the time must be finite");
  // Instances that were moved by hand are shown at a time.
  const ViewFile& file = files_[panes_[0].file];
  if (!time_s && file.moves() && !hand_moves_[panes_[0].file].empty()) time_s = file.begin_s;
  // At a time, `render` shows the scene's camera where it has moved to; the view's camera stays where it is.
  if (time_s && !camera_.key()) camera_.set(camera_.current_key());
  if (time_ == time_s) return;
  time_ = time_s;
  moved_ = true;
}

void ViewSession::turn_lights(double degrees) {
  double turn = std::fmod(degrees, 360.0);
  if (turn < 0.0) turn += 360.0;
  for (PaneState& pane : panes_) pane.config.shade.light_turn = static_cast<float>(turn);
  moved_ = moved_ || std::any_of(panes_.begin(), panes_.begin() + static_cast<ptrdiff_t>(shown_panes()),
                                 [](const PaneState& pane) { return pane.view() != FrameView::kAo; });
}

bool ViewSession::set_pivot(uint32_t x, uint32_t y) {
  const std::optional<Pick::Surface> shown = surface(pane_at(x), x, y);
  if (!shown) return false;
  camera_.set_pivot(shown->position - files_[0].at_rest.source->origin());
  return true;
}

/// The camera in a file's scene, which `render --camera lookat:...` gives for it.
Camera ViewSession::camera_in(size_t file) const {
  if (file == 0) return camera_.camera();
  const ViewFile& shown = files_[file];
  const std::span<const Camera> cameras = shown.at_rest.source->cameras();
  const size_t number = std::strtoul(shown.base_camera.c_str(), nullptr, 10);
  return camera_.in_scene(shown.at_rest.source->origin(), number < cameras.size() ? cameras[number] : camera_.camera());
}

void ViewSession::frame_scene() {
  move_camera([&](ViewCamera& camera) { camera.frame(files_[panes_[0].file].at_rest.source->world_bounds()); });
}

FrameConfig ViewSession::frame_config(const PaneState& pane, uint32_t quality) const {
  FrameConfig config = pane.rendered_config();
  config.size = size_;
  config.lod_layers = config.detail.camera_uses_levels();
  config.ao.radius = ao_radius(config.ao, files_[pane.file].at_rest.source->world_bounds());
  config.all_channels = false; // picks trace their pixels again
  config.plain_layers = keep_views_ ? uint32_t{kAllPlainLayers} : 0;
  for (size_t i = 0; i < shown_panes(); ++i) {
    const std::vector<std::string> layer{panes_[i].layer};
    config.plain_layers |= plain_layers_of(panes_[i].image_layer());
    config.view_layers = config.view_layers || keep_views_ || has_view_layer(layer);
    config.surface_layers = config.surface_layers || has_surface_layer(layer);
    config.cost_layers = config.cost_layers || has_cost_layer(layer);
  }
  return at_quality_step(config, quality);
}

/// Makes the panes' renderers fit what is shown.
void ViewSession::prepare(uint32_t quality) {
  const bool played = time_.has_value();
  for (size_t i = 0; i < panes_.size(); ++i) {
    std::shared_ptr<PaneRenderer>& renderer = renderers_[i];
    if (i >= shown_panes()) {
      renderer.reset();
      continue;
    }
    const ViewFile& file = files_[panes_[i].file];
    const FrameConfig config = frame_config(panes_[i], quality);
    const bool alike = i > 0 && panes_[i].file == panes_[0].file &&
                       same_frames(renderers_[0]->loop().config(), config) &&
                       renderers_[0]->loop().config().view == config.view;
    if (alike) {
      renderer = renderers_[0];
      continue;
    }
    if (i > 0 && renderer == renderers_[0]) renderer.reset();
    const PaneRenderer::Scene scene{file, played, hand_moves_[panes_[i].file].motion(), last_.moving};
    if (renderer && renderer->follow(scene)) {
      restart_ = renderer->configure(config) || restart_;
      continue;
    }
    renderer.reset(); // before the new one, for its memory
    renderer = std::make_shared<PaneRenderer>(scene, config, memory_);
    restart_ = true;
  }
}

bool ViewSession::step(Progress& progress) {
  const bool moving = moved_;
  last_ = {};
  last_.moving = moving;
  last_.quality_step = moving ? fixed_quality_.value_or(quality_.step()) : 0;
  last_.time_s = time_.value_or(0.0);
  prepare(last_.quality_step);
  moved_ = resolved_ = changed_ = false;
  if (moving || restart_) still_frames_ = 0;
  const std::shared_ptr<PaneRenderer>& first = renderers_[0];
  last_.traced = first->loop().config().traced_size();
  try {
    for (size_t i = 0; i < shown_panes(); ++i) {
      PaneRenderer& renderer = *renderers_[i];
      if (i > 0 && renderers_[i] == first) continue;
      if (!moving && restart_) renderer.restart();
      renderer.next_frame(camera_in(panes_[i].file), last_.time_s, moving || once_, progress);
      add_report(renderer.report(), last_.report);
    }
  } catch (const Error& error) {
    restart_ = true;
    still_frames_ = 0;
    if (error.kind() != ErrorKind::kCancelled || Progress::cancelled()) throw;
    return false;
  }
  restart_ = moving;
  if (!moving) ++still_frames_;
  last_.still_frames = still_frames_;
  return true;
}

bool ViewSession::step_once(Progress& progress) {
  once_ = true;
  const bool finished = step(progress);
  once_ = false;
  restart();
  return finished;
}

void ViewSession::resolve() {
  require_view(renderers_[0] != nullptr && last_.report.frames > 0, "no frame has been rendered yet");
  if (resolved_) return;
  resolved_ = true;
  last_.report = {};
  for (size_t i = 0; i < shown_panes(); ++i) {
    if (!renderers_[i] || (i > 0 && renderers_[i] == renderers_[0])) continue;
    renderers_[i]->resolve();
    add_report(renderers_[i]->report(), last_.report);
  }
}

const RenderedImage& ViewSession::shown_image(size_t pane) {
  resolve();
  return renderers_[renderers_.at(pane) ? pane : 0]->image();
}

const RenderedImage& ViewSession::image(size_t pane) {
  const RenderedImage& shown = shown_image(pane);
  renderers_[renderers_.at(pane) ? pane : 0]->complete();
  return shown;
}

const FrameConfig& ViewSession::rendered_config(size_t pane) const {
  require_view(renderers_[0] != nullptr, "no frame has been rendered yet");
  return renderers_[renderers_.at(pane) ? pane : 0]->loop().config();
}

Image ViewSession::picture() {
  const auto plain = [&](size_t pane) { return PreviewStyle{std::nullopt, false, panes_[pane].config.display()}; };
  if (split_ == SplitMode::kDifference)
    return difference_picture(shown_image(0), panes_[0].image_layer(), shown_image(1), panes_[1].image_layer(),
                              static_cast<float>(gain_));
  Image left = layer_preview(shown_image(0), panes_[0].image_layer(), plain(0));
  if (split_ == SplitMode::kOff) return left;
  const Image right = layer_preview(shown_image(1), panes_[1].image_layer(), plain(1));
  const auto begin = static_cast<uint32_t>(std::lround(divider_ * left.size.width));
  for (uint32_t y = 0; y < left.size.height; ++y)
    for (uint32_t x = begin; x < left.size.width; ++x) std::ranges::copy(right.pixel(x, y), left.pixel(x, y).begin());
  return left;
}

DifferenceMetrics ViewSession::metrics() {
  require_view(split_ != SplitMode::kOff, "two views are needed to compare them");
  return difference_metrics(shown_image(0), panes_[0].image_layer(), shown_image(1), panes_[1].image_layer());
}

FileContents ViewSession::contents(size_t pane) const {
  require_view(renderers_[0] != nullptr, "no frame has been rendered yet");
  const size_t shown = renderers_.at(pane) ? pane : 0;
  return file_contents(files_[panes_[shown].file], *renderers_[shown]);
}

/// The pixel of a pane's image, which is smaller than the picture while something moves.
std::array<uint32_t, 2> ViewSession::traced_pixel(size_t pane, uint32_t x, uint32_t y) const {
  require_view(x < size_.width && y < size_.height,
               fmt::format("pixel {}, {} is outside the picture of {} x {} pixels", x, y, size_.width, size_.height));
  const ImageSize traced = rendered_config(pane).size;
  return {x * traced.width / size_.width, y * traced.height / size_.height};
}

Pick ViewSession::pick(size_t pane, uint32_t x, uint32_t y) {
  image(pane);
  const size_t shown = renderers_.at(pane) ? pane : 0;
  const auto [column, row] = traced_pixel(shown, x, y);
  return pick_pixel(files_[panes_[shown].file], *renderers_[shown], column, row);
}

/// What a pixel of a pane shows, or of the first pane for one that is not shown.
std::optional<Pick::Surface> ViewSession::surface(size_t pane, uint32_t x, uint32_t y) const {
  require_view(renderers_[0] != nullptr && last_.report.frames > 0, "no frame has been rendered yet");
  const size_t shown = renderers_.at(pane) ? pane : 0;
  const auto [column, row] = traced_pixel(shown, x, y);
  return pick_surface(files_[panes_[shown].file], renderers_[shown]->loop(), column, row);
}

size_t ViewSession::pane_at(uint32_t x) const {
  return split_ == SplitMode::kDivider && x >= std::lround(divider_ * size_.width) ? 1 : 0;
}

std::vector<std::string> ViewSession::command(size_t pane) const {
  const PaneState& state = panes_.at(pane);
  if (last_.still_frames == 0) return {};
  const ViewFile& file = files_[state.file];
  std::vector<std::string> words{"packtrace", "render", file.name};
  words.insert(words.end(), file.words.begin(), file.words.end());
  words.emplace_back("--camera");
  words.push_back(camera_.key() ? (file.base_camera == "0" ? "" : file.base_camera + ":") +
                                      "lookat:" + camera_key_text(*camera_.key())
                                : file.base_camera);
  const auto option = [&](const char* name, const std::string& value) {
    words.emplace_back(name);
    words.push_back(value);
  };
  const HandMoves& by_hand = hand_moves_[state.file];
  if (!by_hand.empty()) option("--keys", by_hand.keys_file());
  if (time_ || !by_hand.empty()) option("--start-time", fmt::format("{}", last_.time_s));
  option("--size", fmt::format("{}x{}", size_.width, size_.height));
  if (state.ground_truth()) words.emplace_back("--ground-truth");
  option("--frames", std::to_string(last_.still_frames));
  FrameConfig stated = state.config;
  if (state.ground_truth()) stated.ao_resolution = AoResolution::kFull, stated.ao_rate = AoRate::kFull;
  if (state.view() == FrameView::kAo)
    stated.shade = {}, stated.tone_map = FrameConfig().tone_map, stated.exposure = FrameConfig().exposure;
  else
    option("--view", state.view() == FrameView::kPbr ? "pbr" : "pbr+ao");
  const std::vector<std::string> settings = setting_words(stated);
  words.insert(words.end(), settings.begin(), settings.end());
  option("--aov", state.image_layer());
  return words;
}

} // namespace packtrace
