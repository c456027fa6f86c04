#include "runtime/denoise/flux_pipeline.h"

#include <limits>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/filter.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/reprojection.h"
#include "runtime/denoise/simd.h"
#include "runtime/denoise/temporal_blend.h"

namespace packtrace {
namespace {

class FluxPipeline final : public DenoisePipeline {
public:
  explicit FluxPipeline(const FluxConfig& checked) : config_(checked), filter_(checked, chosen_isa()) {}

  void resize(ImageSize size) override;
  void add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) override;
  const DenoisedAo& denoise() override;
  std::vector<std::byte> save() const override;
  void restore(ImageSize size, std::span<const std::byte> bytes) override;
  void reset() override { has_frame_ = false; }
  size_t state_bytes() const override;

private:
  /// Calls work(plane) for everything that the next frame needs of this one; all elements have 4 bytes.
  template <typename Self, typename Work>
  static void for_each_saved_plane(Self& self, const Work& work) {
    auto& g = self.now_.guides;
    auto& h = self.now_.history;
    work(g.disparity), work(g.normal_x), work(g.normal_y), work(g.normal_z), work(g.instance);
    work(h.mean), work(h.square), work(h.fast), work(h.samples);
  }
  void update_history(const GBuffer& gbuffer);
  void differentiate();

  FluxConfig config_;
  bool has_frame_ = false;
  bool derivatives_outdated_ = false; ///< they do not belong to the guides
  FrameHistory now_, before_;         // `before_` is only used while a frame is denoised
  DepthDerivatives derivatives_;
  AoFilter filter_;
  bool moving_ = false; ///< something moved in the last frame
  FrameSamples samples_;
  DenoisedAo result_;
};

void FluxPipeline::resize(ImageSize size) {
  for (FrameHistory* frame : {&now_, &before_}) frame->guides.resize(size), frame->history.resize(size);
  derivatives_.resize(size);
  samples_.resize(size);
  result_.size = size;
  result_.ao.assign(size.pixels(), kInvalidAo);
  result_.variance.assign(size.pixels(), 0.0f);
  result_.tspp.assign(size.pixels(), 0.0f);
  has_frame_ = false;
}

/// Loads this frame's guides and reprojects the history. Does nothing if no pixel moves and no guide changes.
void FluxPipeline::update_history(const GBuffer& gbuffer) {
  moving_ = has_frame_ && !now_.guides.still_matches(gbuffer);
  if (has_frame_ && !moving_) return;
  std::swap(now_, before_);
  now_.guides.load(gbuffer);
  differentiate();
  if (!has_frame_) before_.history.resize(gbuffer.size);
  reproject(before_, now_.guides, derivatives_, gbuffer.motion_px, gbuffer.previous_z, config_, now_.history);
  has_frame_ = true;
}

void FluxPipeline::differentiate() {
  derivatives_.compute(now_.guides);
  derivatives_outdated_ = false;
}

void FluxPipeline::add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) {
  const bool same_pixels = source == HistorySource::kPixel && has_frame_;
  if (same_pixels) {
    now_.guides.load(gbuffer);
    derivatives_outdated_ = true;
    moving_ = false;
  } else {
    update_history(gbuffer);
  }
  FluxConfig config = config_;
  if (same_pixels) config.max_tspp = std::numeric_limits<uint32_t>::max(); // the plain mean of all samples_
  accumulate(ao.ao, now_.guides, config, now_.history, samples_);
  if (!same_pixels) correct_history(samples_, now_.guides, config_, now_.history);
}

const DenoisedAo& FluxPipeline::denoise() {
  if (!has_frame_) return result_;
  if (derivatives_outdated_) differentiate();
  filter_.run({now_.guides, derivatives_, now_.history, moving_}, {result_.ao, result_.variance, result_.tspp});
  return result_;
}

size_t FluxPipeline::state_bytes() const {
  size_t bytes = 0;
  for (const FrameHistory* frame : {&now_, &before_}) bytes += frame->guides.bytes() + frame->history.bytes();
  for (const Plane<float>* plane : {&derivatives_.x, &derivatives_.y, &samples_.ao, &samples_.valid, &samples_.change})
    bytes += plane->bytes();
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
  size_t planes = 0;
  for_each_saved_plane(*this, [&](auto&) { ++planes; });
  if (bytes.size() != planes * sizeof(float) * size.pixels())
    throw Error(ErrorKind::kInput, "denoiser: the saved history has another size");
  now_.guides.size = size;
  for_each_saved_plane(*this, [&](auto& plane) {
    for (int y = 0; y < static_cast<int>(size.height); ++y) {
      const auto row = std::as_writable_bytes(std::span(plane.row(y), size.width));
      std::copy_n(bytes.begin(), row.size(), row.begin());
      bytes = bytes.subspan(row.size());
    }
  });
  has_frame_ = true;
  derivatives_outdated_ = true;
}

} // namespace

std::unique_ptr<DenoisePipeline> make_flux_pipeline(const FluxConfig& config) {
  config.validate();
  return std::make_unique<FluxPipeline>(config);
}

} // namespace packtrace
