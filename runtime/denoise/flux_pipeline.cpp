#include "runtime/denoise/flux_pipeline.h"

#include <limits>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/denoise/filter.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history_update.h"
#include "runtime/denoise/reprojection.h"
#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

class FluxPipeline final : public DenoisePipeline {
public:
  explicit FluxPipeline(const FluxConfig& checked)
      : config_(checked), update_(checked, chosen_isa()), filter_(checked, chosen_isa()) {}

  void resize(ImageSize size) override;
  void add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) override;
  const DenoisedAo& denoise(bool with_variance) override;
  std::vector<std::byte> save() const override;
  void restore(ImageSize size, std::span<const std::byte> bytes) override;
  void reset() override { has_frame_ = false; }
  size_t state_bytes() const override;
  void free_spare_memory() override;

private:
  /// Calls work(plane) for everything that the next frame needs of this one.
  template <typename Self, typename Work>
  static void for_each_saved_plane(Self& self, const Work& work) {
    auto& g = self.now_.guides;
    auto& h = self.now_.history;
    work(g.disparity), work(g.normal_x), work(g.normal_y), work(g.normal_z), work(g.instance);
    work(h.mean), work(h.samples), work(h.square), work(h.fast), work(self.trends_);
  }
  bool load_guides(const GBuffer& gbuffer);
  void make_room_for_pairs();

  FluxConfig config_;
  bool has_frame_ = false;
  bool pair_guides_outdated_ = false; ///< they do not belong to the guides
  /// Holds the frame before while a frame is added. Afterwards three of its planes store pair_guides_, and the others
  /// may be freed until the next frame that moves.
  FrameHistory now_, before_;
  Plane<uint32_t> trends_; ///< trend.h
  PairGuides pair_guides_;
  HistoryUpdate update_;
  AoFilter filter_;
  bool moving_ = false;     ///< something moved in the last frame
  bool stratified_ = false; ///< AoFrame::stratified of the last frame
  uint32_t samples_ = 1;    ///< AoFrame::samples of the last frame
  DenoisedAo result_;
};

void FluxPipeline::resize(ImageSize size) {
  now_.guides.resize(size), now_.history.resize(size);
  free_spare_memory();
  trends_.resize(size);
  result_.size = size;
  result_.ao.assign(size.pixels(), kInvalidAo);
  result_.variance.clear();
  result_.tspp.assign(size.pixels(), 0.0f);
  has_frame_ = false;
}

/// Loads this frame's guides. Returns false, and does nothing, if no pixel moves and no guide changes.
bool FluxPipeline::load_guides(const GBuffer& gbuffer) {
  if (has_frame_ && now_.guides.still_matches(gbuffer)) return false;
  std::swap(now_, before_);
  now_.guides.make_room(gbuffer.size), now_.history.make_room(gbuffer.size);
  now_.guides.load(gbuffer);
  if (!has_frame_) before_.history.resize(gbuffer.size);
  pair_guides_outdated_ = true;
  return true;
}

void FluxPipeline::add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) {
  stratified_ = ao.stratified, samples_ = ao.samples;
  const bool same_pixels = source == HistorySource::kPixel && has_frame_;
  bool resample = false;
  if (same_pixels) {
    now_.guides.load(gbuffer);
    pair_guides_outdated_ = true;
  } else if (source != HistorySource::kUnchanged || !has_frame_) {
    resample = load_guides(gbuffer);
  }
  moving_ = resample && has_frame_;
  has_frame_ = true;
  const MotionFrame motion{before_, now_.guides, gbuffer.motion_px, gbuffer.previous_z};
  // Histories of jittered pixels are the plain means of all samples.
  const uint32_t longest = same_pixels ? std::numeric_limits<uint32_t>::max() : config_.max_tspp;
  update_.run(
      {now_.guides, ao.ao, ao.max_history, resample ? &motion : nullptr, !same_pixels, static_cast<float>(longest)},
      now_.history, trends_);
}

/// Allocates the pair guides. While nothing moves, frees the planes that only moving frames need.
void FluxPipeline::make_room_for_pairs() {
  Guides& g = before_.guides;
  History& h = before_.history;
  if (!moving_)
    g.normal_x.free(), g.normal_y.free(), g.normal_z.free(), h.samples.free(), h.square.free(), h.fast.free();
  g.disparity.make_room(result_.size), g.instance.make_room(result_.size), h.mean.make_room(result_.size);
}

const DenoisedAo& FluxPipeline::denoise(bool with_variance) {
  if (with_variance)
    result_.variance.resize(result_.size.pixels());
  else
    result_.variance = std::vector<float>(); // frees the memory
  if (!has_frame_) return result_;
  if (pair_guides_outdated_) make_room_for_pairs();
  if (pair_guides_outdated_)
    pair_guides_.compute(now_.guides, config_, filter_kernels(chosen_isa()),
                         {before_.guides.disparity, before_.guides.instance, before_.history.mean});
  pair_guides_outdated_ = false;
  filter_.run({now_.guides, pair_guides_, now_.history, trends_, moving_, stratified_, samples_},
              {result_.ao, result_.variance, result_.tspp});
  return result_;
}

void FluxPipeline::free_spare_memory() {
  before_ = {};
  pair_guides_outdated_ = true;
}

size_t FluxPipeline::state_bytes() const {
  size_t bytes = trends_.bytes();
  for (const FrameHistory* frame : {&now_, &before_}) bytes += frame->guides.bytes() + frame->history.bytes();
  return bytes;
}

std::vector<std::byte> FluxPipeline::save() const {
  std::vector<std::byte> bytes;
  if (!has_frame_) return bytes;
  const ImageSize size = now_.guides.size;
  for_each_saved_plane(*this, [&](auto& plane) {
    for (int y = 0; y < static_cast<int>(size.height); ++y) {
      const auto row = std::as_bytes(std::span(plane.row(y), size.width));
      bytes.insert(bytes.end(), row.begin(), row.end());
    }
  });
  return bytes;
}

void FluxPipeline::restore(ImageSize size, std::span<const std::byte> bytes) {
  resize(size);
  if (bytes.empty()) return;
  size_t expected = 0;
  for_each_saved_plane(*this, [&](auto& plane) { expected += sizeof(*plane.row(0)) * size.pixels(); });
  if (bytes.size() != expected) throw Error(ErrorKind::kInput, "denoiser: the saved history has another size");
  now_.guides.size = size;
  for_each_saved_plane(*this, [&](auto& plane) {
    for (int y = 0; y < static_cast<int>(size.height); ++y) {
      const auto row = std::as_writable_bytes(std::span(plane.row(y), size.width));
      std::copy_n(bytes.begin(), row.size(), row.begin());
      bytes = bytes.subspan(row.size());
    }
  });
  has_frame_ = true;
  pair_guides_outdated_ = true;
}

} // namespace

std::unique_ptr<DenoisePipeline> make_flux_pipeline(const FluxConfig& config) {
  config.validate();
  return std::make_unique<FluxPipeline>(config);
}

} // namespace packtrace
