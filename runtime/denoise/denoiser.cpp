#include "runtime/denoise/denoiser.h"

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

void require_sizes(const GBuffer& gbuffer, const AoFrame& ao) {
  const size_t pixels = gbuffer.size.pixels();
  if (ao.size != gbuffer.size) throw Error(ErrorKind::kUsage, "denoiser: the AO frame and the G-buffer differ in size");
  if (gbuffer.view_z.size() != pixels || gbuffer.normal.size() != pixels || gbuffer.instance.size() != pixels ||
      gbuffer.motion_px.size() != pixels || ao.ao.size() != pixels ||
      (!gbuffer.previous_z.empty() && gbuffer.previous_z.size() != pixels))
    throw Error(ErrorKind::kUsage, "denoiser: an array does not have one entry per pixel");
  constexpr uint32_t kLargestSide = 1u << 20;
  if (gbuffer.size.width > kLargestSide || gbuffer.size.height > kLargestSide)
    throw Error(ErrorKind::kUsage,
                "denoiser: the image is more than " + std::to_string(kLargestSide) + " pixels wide or high");
}

} // namespace

struct AoDenoiser::State {
  explicit State(const DenoiserConfig& checked) : config(checked) {}

  void resize(ImageSize size);
  void update_history(const GBuffer& gbuffer);
  void blur();
  void write(DenoisedAo& out) const;

  DenoiserConfig config;
  bool has_frame = false;
  FrameHistory now, before; // `before` is only used while a frame is denoised
  DepthDerivatives derivatives;
  std::vector<EdgeWeights> edges = {EdgeWeights(1), EdgeWeights(2), EdgeWeights(4)};
  FrameSamples samples;
  NoisyImage image;
  BlurScratch scratch;
  DenoisedAo result;
};

void AoDenoiser::State::resize(ImageSize size) {
  for (FrameHistory* frame : {&now, &before}) frame->guides.resize(size), frame->history.resize(size);
  derivatives.resize(size);
  for (EdgeWeights& weights : edges) weights.resize(size);
  samples.resize(size), image.resize(size), scratch.resize(size);
  result.size = size;
  result.ao.assign(size.pixels(), kInvalidAo);
  result.variance.assign(size.pixels(), 0.0f);
  result.tspp.assign(size.pixels(), 0.0f);
  has_frame = false;
}

/// Loads this frame's guides and reprojects the history. Does nothing if no pixel moves and no guide changes.
void AoDenoiser::State::update_history(const GBuffer& gbuffer) {
  if (has_frame && now.guides.still_matches(gbuffer)) return;
  std::swap(now, before);
  now.guides.load(gbuffer);
  derivatives.compute(now.guides);
  for (EdgeWeights& weights : edges) weights.compute(now.guides, derivatives, config);
  if (!has_frame) before.history.resize(gbuffer.size);
  reproject(before, now.guides, derivatives, gbuffer.motion_px, gbuffer.previous_z, config, now.history);
  has_frame = true;
}

void AoDenoiser::State::blur() {
  const ImageSize size = now.guides.size;
  const Plane<float>& tspp = now.history.samples;
  fill_unsampled(now.guides, tspp, edges, image);
  const Fade fade{static_cast<float>(config.blur_fade_begin), static_cast<float>(config.blur_fade_end)};
  const float limit = config.blur_limit;
  for (size_t i = 0; i < kBlurPasses; ++i) edge_blur(edges[i], tspp, fade, limit, size, image, scratch);
  disocclusion_blur(tspp, std::span(edges).subspan(kBlurPasses), static_cast<float>(config.disocclusion_frames), limit,
                    size, image, scratch);
}

void AoDenoiser::State::write(DenoisedAo& out) const {
  const ImageSize size = now.guides.size;
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const size_t begin = static_cast<size_t>(y) * size.width;
      write_row(static_cast<int>(size.width), image.value.row(y), now.guides.disparity.row(y), &out.ao[begin]);
      std::copy_n(now.history.samples.row(y), size.width, &out.tspp[begin]);
    }
  });
}

AoDenoiser::AoDenoiser(const DenoiserConfig& config) {
  config.validate();
  state_ = std::make_unique<State>(config);
}
AoDenoiser::~AoDenoiser() = default;
AoDenoiser::AoDenoiser(AoDenoiser&&) noexcept = default;
AoDenoiser& AoDenoiser::operator=(AoDenoiser&&) noexcept = default;

const DenoisedAo& AoDenoiser::next_frame(const GBuffer& gbuffer, const AoFrame& ao) {
  require_sizes(gbuffer, ao);
  State& state = *state_;
  if (gbuffer.size != state.result.size) state.resize(gbuffer.size);
  if (gbuffer.size.pixels() == 0) return state.result;
  state.update_history(gbuffer);
  accumulate(ao.ao, state.now.guides, state.config, state.now.history, state.samples);
  correct_history(state.samples, state.now.guides, state.config, state.now.history, state.result.variance, state.image);
  state.blur();
  state.write(state.result);
  return state.result;
}

void AoDenoiser::reset() { state_->has_frame = false; }

} // namespace packtrace
