#include "runtime/denoise/flux_pipeline.h"

#include <limits>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/disocclusion_blur.h"
#include "runtime/denoise/edge_blur.h"
#include "runtime/denoise/edge_weights.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/reprojection.h"
#include "runtime/denoise/simd.h"
#include "runtime/denoise/temporal_blend.h"

namespace packtrace {
namespace {

/// Number of blur passes applied to all surfaces (tap distances 1 and 2). The remaining passes are for disoccluded
/// surfaces.
constexpr size_t kBlurPasses = 2;

PACKTRACE_AVX2_CLONES
void write_row(int width, const float* __restrict value, const float* __restrict disparity, float* __restrict ao) {
  for (int x = 0; x < width; ++x) {
    const float clamped = smaller(larger(value[x], 0.0f), 1.0f);
    ao[x] = disparity[x] > 0.0f ? clamped : kInvalidAo;
  }
}

class FluxPipeline final : public DenoisePipeline {
public:
  explicit FluxPipeline(const FluxConfig& checked) : config_(checked) {}

  void resize(ImageSize size) override;
  void add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) override;
  const DenoisedAo& denoise() override;
  std::vector<std::byte> save() const override;
  void restore(ImageSize size, std::span<const std::byte> bytes) override;
  void reset() override { has_frame_ = false; }

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
  void compare_neighbours();
  void blur();
  void write(DenoisedAo& out) const;

  FluxConfig config_;
  bool has_frame_ = false;
  bool edges_outdated_ = false;     ///< `edges_` do not belong to the guides
  bool statistics_pending_ = false; ///< correct_history() has not run for the last frame
  FrameHistory now_, before_;       // `before_` is only used while a frame is denoised
  DepthDerivatives derivatives_;
  std::vector<EdgeWeights> edges_ = {EdgeWeights(1), EdgeWeights(2), EdgeWeights(4)};
  FrameSamples samples_;
  NoisyImage image_;
  BlurScratch scratch_;
  DenoisedAo result_;
};

void FluxPipeline::resize(ImageSize size) {
  for (FrameHistory* frame : {&now_, &before_}) frame->guides.resize(size), frame->history.resize(size);
  derivatives_.resize(size);
  for (EdgeWeights& weights : edges_) weights.resize(size);
  samples_.resize(size), image_.resize(size), scratch_.resize(size);
  result_.size = size;
  result_.ao.assign(size.pixels(), kInvalidAo);
  result_.variance.assign(size.pixels(), 0.0f);
  result_.tspp.assign(size.pixels(), 0.0f);
  has_frame_ = false;
}

/// Loads this frame's guides and reprojects the history. Does nothing if no pixel moves and no guide changes.
void FluxPipeline::update_history(const GBuffer& gbuffer) {
  if (has_frame_ && now_.guides.still_matches(gbuffer)) return;
  std::swap(now_, before_);
  now_.guides.load(gbuffer);
  compare_neighbours();
  if (!has_frame_) before_.history.resize(gbuffer.size);
  reproject(before_, now_.guides, derivatives_, gbuffer.motion_px, gbuffer.previous_z, config_, now_.history);
  has_frame_ = true;
}

void FluxPipeline::compare_neighbours() {
  derivatives_.compute(now_.guides);
  for (EdgeWeights& weights : edges_) weights.compute(now_.guides, derivatives_, config_);
  edges_outdated_ = false;
}

void FluxPipeline::blur() {
  const ImageSize size = now_.guides.size;
  const Plane<float>& tspp = now_.history.samples;
  fill_unsampled(now_.guides, tspp, edges_, image_);
  const Fade fade{static_cast<float>(config_.blur_fade_begin), static_cast<float>(config_.blur_fade_end)};
  const float limit = config_.blur_limit;
  for (size_t i = 0; i < kBlurPasses; ++i) edge_blur(edges_[i], tspp, fade, limit, size, image_, scratch_);
  disocclusion_blur(tspp, std::span(edges_).subspan(kBlurPasses), static_cast<float>(config_.disocclusion_frames),
                    limit, size, image_, scratch_);
}

void FluxPipeline::write(DenoisedAo& out) const {
  const ImageSize size = now_.guides.size;
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const size_t begin = static_cast<size_t>(y) * size.width;
      write_row(static_cast<int>(size.width), image_.value.row(y), now_.guides.disparity.row(y), &out.ao[begin]);
      std::copy_n(now_.history.samples.row(y), size.width, &out.tspp[begin]);
    }
  });
}

void FluxPipeline::add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) {
  const bool same_pixels = source == HistorySource::kPixel && has_frame_;
  if (same_pixels) {
    now_.guides.load(gbuffer);
    edges_outdated_ = true;
  } else {
    update_history(gbuffer);
  }
  FluxConfig config = config_;
  if (same_pixels) config.max_tspp = std::numeric_limits<uint32_t>::max(); // the plain mean of all samples_
  accumulate(ao.ao, now_.guides, config, now_.history, samples_);
  statistics_pending_ = same_pixels;
  if (!same_pixels) correct_history(samples_, now_.guides, config_, now_.history, result_.variance, image_);
}

const DenoisedAo& FluxPipeline::denoise() {
  if (!has_frame_) return result_;
  if (edges_outdated_) compare_neighbours();
  if (statistics_pending_) {
    FluxConfig config = config_;
    // Nothing moves: where jitter makes the histories differ, nothing has changed.
    config.change_tolerance = std::numeric_limits<float>::infinity();
    correct_history(samples_, now_.guides, config, now_.history, result_.variance, image_);
    statistics_pending_ = false;
  }
  blur();
  write(result_);
  return result_;
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
  edges_outdated_ = true;
}

} // namespace

std::unique_ptr<DenoisePipeline> make_flux_pipeline(const FluxConfig& config) {
  config.validate();
  return std::make_unique<FluxPipeline>(config);
}

} // namespace packtrace
