#include <cstring>

#include "pbrt_import/base/error.h"
#include "runtime/frame/frame_loop.h"

namespace packtrace {
namespace {

/// The bytes of FrameLoop::save() before the denoiser's.
struct SavedLoop {
  uint64_t next_number;
  uint32_t still_frames;
  uint32_t state_bytes; ///< of SceneState
  uint64_t mean_bytes;  ///< of RawMean
  uint64_t rate_bytes;  ///< of AdaptiveRate
  uint64_t shade_bytes; ///< of ShadedMean
};

} // namespace

std::vector<std::byte> FrameLoop::save() const {
  const std::vector<std::byte> mean = raw_mean_.save(), rate = adaptive_.save(), shade = shading_.save(),
                               history = denoiser_.save();
  const std::vector<uint8_t> state = state_.save();
  const SavedLoop saved{next_number_, still_frames_, static_cast<uint32_t>(state.size()),
                        mean.size(),  rate.size(),   shade.size()};
  std::vector<std::byte> bytes(sizeof(saved));
  std::memcpy(bytes.data(), &saved, sizeof(saved));
  for (const std::span<const std::byte> part :
       {std::as_bytes(std::span(state)), std::span<const std::byte>(mean), std::span<const std::byte>(rate),
        std::span<const std::byte>(shade), std::span<const std::byte>(history)})
    bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

void FrameLoop::restore(const Camera& camera, double time_s, std::span<const std::byte> bytes) {
  SavedLoop saved{};
  const auto fail = [] { throw Error(ErrorKind::kInput, "the saved state does not belong to these settings"); };
  if (bytes.size() < sizeof(saved)) fail();
  std::memcpy(&saved, bytes.data(), sizeof(saved));
  bytes = bytes.subspan(sizeof(saved));
  if (saved.state_bytes > bytes.size()) fail();
  const std::span<const std::byte> state = bytes.first(saved.state_bytes);
  bytes = bytes.subspan(state.size());
  if (saved.mean_bytes > bytes.size() || saved.rate_bytes > bytes.size() - saved.mean_bytes ||
      saved.shade_bytes > bytes.size() - saved.mean_bytes - saved.rate_bytes)
    fail();
  if (saved.next_number <= saved.still_frames) fail();
  const ImageSize shaded =
      config_.ao_resolution == AoResolution::kFull
          ? config_.traced_size()
          : ImageSize{(config_.traced_size().width + 1) / 2, (config_.traced_size().height + 1) / 2};
  reset();
  const auto mean = bytes.first(saved.mean_bytes), rate = bytes.subspan(mean.size(), saved.rate_bytes);
  const auto shade = bytes.subspan(mean.size() + rate.size(), saved.shade_bytes);
  const auto history = bytes.subspan(mean.size() + rate.size() + shade.size());
  if ((config_.denoise ? history : mean).empty() || (config_.ao_rate == AoRate::kAdaptive) == rate.empty()) fail();
  if (!raw_mean_.restore(shaded.pixels(), mean) || !adaptive_.restore(shaded, rate)) fail();
  if (config_.shades() == shade.empty() || !shading_.restore(config_.traced_size().pixels(), shade)) fail();
  denoiser_.restore(shaded, history);
  // Camera rays depend on the camera alone.
  if (!state_.restore(time_s, {reinterpret_cast<const uint8_t*>(state.data()), state.size()}, report_)) fail();
  report_ = {};
  channels_ = gbuffer_channels(config_);
  trace_still(camera, saved.still_frames, true);
  if (config_.shades() && config_.denoise) shading_.keep_surfaces(gbuffer_);
  camera_ = camera;
  view_.emplace(camera, config_.traced_size());
  next_number_ = saved.next_number;
}

} // namespace packtrace
