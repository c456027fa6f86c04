#include "runtime/denoise/reference/reference_pipeline.h"

#include <array>
#include <cstring>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/denoise/limit_frames.h"
#include "runtime/denoise/reference/depth_derivatives.h"
#include "runtime/denoise/reference/disocclusion_blur.h"
#include "runtime/denoise/reference/edge_stopping_blur.h"
#include "runtime/denoise/reference/reprojection.h"
#include "runtime/denoise/reference/temporal_blend.h"
#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

constexpr float kTangentOfHalf45Degrees = 0.41421356f;
constexpr float kDefaultRayLength = 22.0f;

PACKTRACE_AVX2_CLONES
void write_reference_row(int width, const float* __restrict value, const float* __restrict z, float* __restrict ao) {
  for (int x = 0; x < width; ++x) {
    const float open_if_unknown = value[x] >= 0.0f ? smaller(1.0f, value[x]) : 1.0f;
    ao[x] = z[x] > 0.0f ? open_if_unknown : kInvalidAo;
  }
}

class ReferencePipeline final : public DenoisePipeline {
public:
  explicit ReferencePipeline(const ReferenceConfig& checked) : config_(checked) {}

  void resize(ImageSize size) override;
  void add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) override;
  const DenoisedAo& denoise(bool with_variance) override;
  std::vector<std::byte> save() const override;
  void restore(ImageSize size, std::span<const std::byte> bytes) override;
  void reset() override { frames_ = 0; }
  size_t state_bytes() const override;

private:
  /// Calls work(plane) for everything that the next frame needs of this one, besides frames_.
  template <typename Self, typename Work>
  static void for_each_saved_plane(Self& self, const Work& work) {
    auto& s = self.now_.surfaces;
    auto& h = self.now_.history;
    work(s.z), work(s.normal_x), work(s.normal_y), work(s.normal_z);
    work(h.value), work(h.mean), work(h.square), work(h.distance), work(h.tspp);
  }
  reference::BlurScale blur_scale(const GBuffer& gbuffer, const AoFrame& ao) const;

  ReferenceConfig config_;
  uint32_t frames_ = 0; ///< since the last reset
  reference::Frame now_, before_;
  reference::Derivatives derivatives_;
  Plane<float> blended_, deviation_;
  std::array<Plane<float>, 2> passes_;
  std::vector<float> no_distances_; ///< zeros, for frames without hit distances
  DenoisedAo result_;
};

void ReferencePipeline::resize(ImageSize size) {
  if (size.pixels() > size_t{1} << 30) throw Error(ErrorKind::kUsage, "denoiser: reference supports up to 2^30 pixels");
  now_.resize(size), before_.resize(size), derivatives_.resize(size);
  for (Plane<float>* plane : {&blended_, &deviation_, &passes_[0], &passes_[1]}) plane->resize(size);
  result_.size = size;
  result_.ao.assign(size.pixels(), kInvalidAo);
  result_.variance.assign(size.pixels(), 0.0f);
  result_.tspp.assign(size.pixels(), 0.0f);
  frames_ = 0;
}

reference::BlurScale ReferencePipeline::blur_scale(const GBuffer& gbuffer, const AoFrame& ao) const {
  reference::BlurScale scale{config_.pixel_spread, config_.ray_length, frames_};
  if (scale.pixel_spread == 0.0f) scale.pixel_spread = gbuffer.pixel_spread;
  if (scale.pixel_spread == 0.0f)
    scale.pixel_spread = 2.0f * kTangentOfHalf45Degrees / static_cast<float>(gbuffer.size.height);
  if (scale.ray_length == 0.0f) scale.ray_length = ao.ray_length;
  if (scale.ray_length == 0.0f) scale.ray_length = kDefaultRayLength;
  return scale;
}

void ReferencePipeline::add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) {
  if (frames_ == 0 || source != HistorySource::kPixel) {
    std::swap(now_, before_);
    if (frames_ == 0) before_.history.clear(gbuffer.size);
    now_.surfaces.load(gbuffer);
    derive_depth(now_.surfaces, derivatives_);
    reproject(before_, now_.surfaces, derivatives_, gbuffer.motion_px, gbuffer.previous_z, config_, now_.history);
  } else {
    now_.surfaces.load(gbuffer);
    derive_depth(now_.surfaces, derivatives_);
  }
  if (!ao.max_history.empty()) limit_frames(ao.max_history, gbuffer.size, now_.history.tspp);
  const reference::BlurScale scale = blur_scale(gbuffer, ao);
  if (ao.hit_distance.empty()) no_distances_.resize(gbuffer.size.pixels());
  blend(ao.ao, ao.hit_distance.empty() ? no_distances_ : ao.hit_distance, scale.ray_length, now_.surfaces, config_,
        now_.history, deviation_, result_.variance);
  std::swap(blended_, now_.history.value);
  edge_stopping_blur(now_.surfaces, derivatives_, blended_, deviation_, scale, config_, now_.history);
  ++frames_;
}

const DenoisedAo& ReferencePipeline::denoise(bool) {
  if (frames_ == 0) return result_;
  const Plane<float>& shown = disocclusion_blur(now_.surfaces, now_.history.tspp, now_.history.value, config_, passes_);
  const ImageSize size = result_.size;
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const size_t begin = static_cast<size_t>(y) * size.width;
      write_reference_row(static_cast<int>(size.width), shown.row(y), now_.surfaces.z.row(y), &result_.ao[begin]);
      std::copy_n(now_.history.tspp.row(y), size.width, &result_.tspp[begin]);
    }
  });
  return result_;
}

size_t ReferencePipeline::state_bytes() const {
  size_t bytes = no_distances_.size() * sizeof(float);
  const auto add = [&](const auto& plane) { bytes += plane.bytes(); };
  for (const reference::Frame* frame : {&now_, &before_}) {
    const reference::Surfaces& s = frame->surfaces;
    const reference::History& h = frame->history;
    add(s.z), add(s.normal_x), add(s.normal_y), add(s.normal_z);
    add(h.value), add(h.mean), add(h.square), add(h.distance), add(h.tspp);
  }
  add(derivatives_.x), add(derivatives_.y), add(blended_), add(deviation_), add(passes_[0]), add(passes_[1]);
  return bytes;
}

std::vector<std::byte> ReferencePipeline::save() const {
  if (frames_ == 0) return {};
  std::vector<std::byte> bytes(sizeof(frames_));
  std::memcpy(bytes.data(), &frames_, sizeof(frames_));
  for_each_saved_plane(*this, [&](auto& plane) {
    for (int y = 0; y < static_cast<int>(result_.size.height); ++y) {
      const auto row = std::as_bytes(std::span(plane.row(y), result_.size.width));
      bytes.insert(bytes.end(), row.begin(), row.end());
    }
  });
  return bytes;
}

void ReferencePipeline::restore(ImageSize size, std::span<const std::byte> bytes) {
  resize(size);
  if (bytes.empty()) return;
  size_t planes = 0;
  for_each_saved_plane(*this, [&](auto&) { ++planes; });
  uint32_t frames = 0;
  if (bytes.size() == sizeof(frames) + planes * sizeof(float) * size.pixels())
    std::memcpy(&frames, bytes.data(), sizeof(frames));
  if (frames == 0) throw Error(ErrorKind::kInput, "denoiser: the saved history has another size");
  bytes = bytes.subspan(sizeof(frames));
  for_each_saved_plane(*this, [&](auto& plane) {
    for (int y = 0; y < static_cast<int>(size.height); ++y) {
      const auto row = std::as_writable_bytes(std::span(plane.row(y), size.width));
      std::copy_n(bytes.begin(), row.size(), row.begin());
      bytes = bytes.subspan(row.size());
    }
  });
  now_.surfaces.size = size;
  frames_ = frames;
}

} // namespace

std::unique_ptr<DenoisePipeline> make_reference_pipeline(const ReferenceConfig& config) {
  config.validate();
  return std::make_unique<ReferencePipeline>(config);
}

} // namespace packtrace
