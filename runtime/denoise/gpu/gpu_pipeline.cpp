#include "runtime/denoise/gpu/gpu_pipeline.h"

#include <bit>
#include <limits>

#include "runtime/denoise/flux_terms.h"
#include "runtime/gpu/device_denoiser.h"

namespace packtrace {
namespace {

static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Vec2) == 2 * sizeof(float));

gpu::DeviceDenoiser::Passes passes_of(const FluxConfig& config) {
  return {config.window / 2, static_cast<uint32_t>(std::countr_zero(config.reprojection_normal_power)), config.passes};
}

/// The terms that are the same in all frames.
gpu::DenoiseRecord terms_of(const FluxConfig& config) {
  gpu::DenoiseRecord out{};
  out.slope = config.reprojection_slope;
  out.longest_still = static_cast<float>(config.max_tspp), out.longest_moving = longest_moving(config);
  out.nearby = config.reprojection_nearby;
  out.fast_frames = static_cast<float>(config.fast_frames);
  const CorrectTerms correct = correct_terms(config);
  out.fast_share = correct.fast_share, out.gamma = correct.gamma;
  out.change_tolerance = correct.tolerance, out.response = correct.response;
  out.guide_depth = config.guide_depth, out.guide_slope = config.guide_slope, out.guide_bend = config.guide_bend;
  const PatchTerms patch = patch_terms(config);
  out.no_distance = patch.no_distance, out.shift = static_cast<uint32_t>(patch.shift);
  out.limit = patch.limit, out.stretch = patch.stretch;
  return out;
}

class GpuPipeline final : public DenoisePipeline {
public:
  GpuPipeline(const FluxConfig& checked, const GpuConfig& device)
      : config_(checked), denoiser_(device, passes_of(checked)), terms_(terms_of(checked)) {
    set_terms({}, {}, HistorySource::kMotion);
  }

  void resize(ImageSize size) override;
  void add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) override;
  const DenoisedAo& denoise(bool with_variance) override;
  std::vector<std::byte> save() const override { return has_frame_ ? denoiser_.save() : std::vector<std::byte>(); }
  void restore(ImageSize size, std::span<const std::byte> bytes) override;
  void reset() override { has_frame_ = false; }
  size_t state_bytes() const override { return denoiser_.state_bytes(); }
  std::vector<DenoiserPassTime> pass_times() const override;

private:
  void set_terms(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source);

  const FluxConfig config_;
  gpu::DeviceDenoiser denoiser_;
  gpu::DenoiseRecord terms_; ///< of the last frame
  bool has_frame_ = false;
  std::vector<gpu::DenoiserDispatch> added_, filtered_; ///< dispatches of the last add_frame() and denoise()
  DenoisedAo result_;
};

void GpuPipeline::resize(ImageSize size) {
  terms_.width = size.width, terms_.height = size.height, terms_.flags = 0;
  has_frame_ = false;
  result_.size = size;
  result_.ao.assign(size.pixels(), kInvalidAo);
  result_.variance.assign(size.pixels(), 0.0f);
  result_.tspp.assign(size.pixels(), 0.0f);
  if (size.pixels() > 0) denoiser_.resize(size.width, size.height);
}

void GpuPipeline::set_terms(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) {
  gpu::DenoiseRecord& t = terms_;
  t.flags = 0;
  const auto set = [&](uint32_t flag, bool on) { t.flags |= on ? flag : 0; };
  const bool same_pixels = source == HistorySource::kPixel && has_frame_;
  const bool unchanged = source == HistorySource::kUnchanged && has_frame_;
  set(gpu::kHasHistory, has_frame_);
  set(gpu::kFollowMotion, !same_pixels && !unchanged);
  set(gpu::kKeepGuides, unchanged);
  set(gpu::kHasPreviousZ, !gbuffer.previous_z.empty());
  set(gpu::kHasLimits, !ao.max_history.empty());
  set(gpu::kTestInstances, config_.reprojection_instance_test);
  set(gpu::kStratified, ao.stratified);
  t.depth = located_depth(config_, !gbuffer.previous_z.empty());
  // Histories of jittered pixels are the plain means of all samples.
  t.longest = static_cast<float>(same_pixels ? std::numeric_limits<uint32_t>::max() : config_.max_tspp);
  const VarianceTerms v = variance_terms(config_, false, ao.stratified, ao.samples);
  t.noise_tolerance = v.tolerance, t.prior = v.prior, t.distrust = v.distrust, t.young = v.young;
  t.still_factor = v.still_factor, t.still_power = v.still_power;
  t.moving_base = v.moving_base, t.moving_gain = v.moving_gain;
  t.ratio_prior = v.ratio_prior, t.per_sample = v.per_sample, t.most_spread = v.most_spread;
}

void GpuPipeline::add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) {
  set_terms(gbuffer, ao, source);
  has_frame_ = false; // A run that fails leaves part of a history.
  const size_t n = gbuffer.size.pixels();
  added_ = denoiser_.add(terms_, {gbuffer.view_z,
                                  {&gbuffer.normal[0].x, 3 * n},
                                  gbuffer.instance,
                                  {&gbuffer.motion_px[0].x, 2 * n},
                                  gbuffer.previous_z,
                                  ao.max_history,
                                  ao.ao,
                                  ao.on_gpu.get(),
                                  gbuffer.on_gpu.get()});
  has_frame_ = true;
}

const DenoisedAo& GpuPipeline::denoise(bool with_variance) {
  if (has_frame_)
    filtered_ = denoiser_.filter(
        terms_, {result_.ao, with_variance ? std::span<float>(result_.variance) : std::span<float>(), result_.tspp});
  return result_;
}

std::vector<DenoiserPassTime> GpuPipeline::pass_times() const {
  std::vector<DenoiserPassTime> times;
  for (const auto* dispatches : {&added_, &filtered_})
    for (const gpu::DenoiserDispatch& d : *dispatches) times.push_back({d.name, d.ms, d.bytes_per_pixel});
  return times;
}

void GpuPipeline::restore(ImageSize size, std::span<const std::byte> bytes) {
  resize(size);
  if (bytes.empty()) return;
  denoiser_.restore(bytes);
  has_frame_ = true;
}

} // namespace

std::unique_ptr<DenoisePipeline> make_gpu_pipeline(const FluxConfig& config, const GpuConfig& device) {
  config.validate();
  return std::make_unique<GpuPipeline>(config, device);
}

} // namespace packtrace
