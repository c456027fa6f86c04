#include "runtime/denoise/denoiser.h"

#include <string>

#include "pbrt_import/base/error.h"
#include "runtime/denoise/flux_pipeline.h"
#include "runtime/denoise/reference/reference_pipeline.h"
#if defined(PACKTRACE_HAS_GPU)
#include "runtime/denoise/gpu/gpu_pipeline.h"
#endif

namespace packtrace {
namespace {

void require_sizes(const GBuffer& gbuffer, const AoFrame& ao) {
  const size_t pixels = gbuffer.size.pixels();
  if (ao.size != gbuffer.size) throw Error(ErrorKind::kUsage, "denoiser: the AO frame and the G-buffer differ in size");
  if (gbuffer.view_z.size() != pixels || gbuffer.normal.size() != pixels || gbuffer.instance.size() != pixels ||
      gbuffer.motion_px.size() != pixels || ao.ao.size() != pixels ||
      (!ao.hit_distance.empty() && ao.hit_distance.size() != pixels) ||
      (!ao.max_history.empty() && ao.max_history.size() != pixels) ||
      (!gbuffer.previous_z.empty() && gbuffer.previous_z.size() != pixels))
    throw Error(ErrorKind::kUsage, "denoiser: an array does not have one entry per pixel");
  constexpr uint32_t kMaxSamples = 65536;
  if (ao.samples < 1 || ao.samples > kMaxSamples)
    throw Error(ErrorKind::kUsage, "denoiser: " + std::to_string(ao.samples) +
                                       " samples per pixel: must be from 1 to " + std::to_string(kMaxSamples));
  constexpr uint32_t kLargestSide = 1u << 20;
  if (gbuffer.size.width > kLargestSide || gbuffer.size.height > kLargestSide)
    throw Error(ErrorKind::kUsage,
                "denoiser: the image is more than " + std::to_string(kLargestSide) + " pixels wide or high");
}

std::unique_ptr<DenoisePipeline> make_on_gpu([[maybe_unused]] const DenoiserConfig& config,
                                             [[maybe_unused]] const GpuConfig& device) {
  if (config.kind != DenoiserKind::kOurs)
    throw Error(ErrorKind::kUnsupported, "backend gpu has no denoiser \"reference\"; use --backend packed");
#if defined(PACKTRACE_HAS_GPU)
  return make_gpu_pipeline(config.ours, device);
#else
  throw Error(ErrorKind::kUnsupported, "packtrace was built without backend gpu; use --backend packed");
#endif
}

std::unique_ptr<DenoisePipeline> make_pipeline(const DenoiserConfig& config, const GpuConfig* device) {
  if (device != nullptr) return make_on_gpu(config, *device);
  return config.kind == DenoiserKind::kReference ? make_reference_pipeline(config.reference)
                                                 : make_flux_pipeline(config.ours);
}

} // namespace

AoDenoiser::AoDenoiser(const DenoiserConfig& config, const GpuConfig* device)
    : pipeline_(make_pipeline(config, device)) {}

void AoDenoiser::add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) {
  require_sizes(gbuffer, ao);
  if (gbuffer.size != size_) {
    size_ = {}; // for the case that there is no memory
    pipeline_->resize(gbuffer.size);
    size_ = gbuffer.size;
  }
  if (size_.pixels() > 0) pipeline_->add_frame(gbuffer, ao, source);
}

const DenoisedAo& AoDenoiser::denoise(bool with_variance) { return pipeline_->denoise(with_variance); }

std::vector<std::byte> AoDenoiser::save() const { return pipeline_->save(); }

void AoDenoiser::restore(ImageSize size, std::span<const std::byte> bytes) {
  size_ = {}; // until the buffers have this size
  pipeline_->restore(size, bytes);
  size_ = size;
}

void AoDenoiser::reset() { pipeline_->reset(); }

void AoDenoiser::free_spare_memory() { pipeline_->free_spare_memory(); }

size_t AoDenoiser::state_bytes() const { return pipeline_->state_bytes(); }

std::vector<DenoiserPassTime> AoDenoiser::pass_times() const { return pipeline_->pass_times(); }

} // namespace packtrace
