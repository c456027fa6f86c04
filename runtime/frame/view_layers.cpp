#include "runtime/frame/view_layers.h"

#include <algorithm>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

constexpr uint32_t kRowsPerTask = 8;

template <typename Work>
void for_each_view_row(uint32_t height, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, height, kRowsPerTask),
                    [&](const tbb::blocked_range<uint32_t>& rows) {
                      for (uint32_t y = rows.begin(); y < rows.end(); ++y) work(y);
                    });
}

/// Sums of a pixel's sub-pixels.
struct ViewSums {
  float hits = 0, moved = 0, samples = 0; ///< moved: hits with a motion, in the frame before which something moved
  float hit_distance = 0, local_variance = 0, variance = 0, history = 0, disocclusion = 0, previous_depth = 0;
  Vec2 motion{0};
};

/// Makes the vectors of the layers as long as the image has pixels, with zeros.
void clear_views(size_t pixels, bool denoised, RenderedImage& image) {
  for (std::vector<float>* layer : {&image.hit_distance, &image.local_variance, &image.previous_depth})
    layer->assign(pixels, 0.0f);
  for (std::vector<float>* layer : {&image.variance, &image.history, &image.disocclusion})
    layer->assign(denoised ? pixels : 0, 0.0f);
  image.motion.assign(pixels, Vec2(0));
}

} // namespace

void ViewLayers::keep_motion(const GBuffer& gbuffer) {
  motion_px_ = gbuffer.motion_px;
  previous_z_ = gbuffer.previous_z;
  moved_hits_.resize(gbuffer.instance.size());
  std::ranges::transform(gbuffer.instance, moved_hits_.begin(),
                         [](uint32_t instance) { return static_cast<uint8_t>(instance != kNoInstance); });
}

void ViewLayers::resolve(const FrameConfig& config, const GBuffer& gbuffer, const AoFrame& raw,
                         const DenoisedAo* denoised, uint32_t frames, RenderedImage& image) const {
  const uint32_t factor = config.supersample;
  const uint32_t step = raw.size == gbuffer.size ? 1 : 2; // traced pixels per pixel of occlusion
  const std::vector<float> noise = local_variance(raw);
  const std::vector<float>& previous_z = previous_z_.empty() ? gbuffer.view_z : previous_z_;
  clear_views(image.size.pixels(), denoised != nullptr, image);
  const auto add = [&](uint32_t x, uint32_t y, ViewSums& sums) {
    const size_t at = size_t{y} * gbuffer.size.width + x;
    if (gbuffer.instance[at] == kNoInstance) return;
    sums.hits += 1.0f;
    if (motion_px_.empty() || moved_hits_[at] != 0) {
      sums.moved += 1.0f, sums.previous_depth += previous_z[at];
      if (!motion_px_.empty()) sums.motion += motion_px_[at];
    }
    const size_t from = size_t{y / step} * raw.size.width + x / step;
    if (raw.ao[from] >= 0.0f) {
      sums.samples += 1.0f, sums.local_variance += noise[from];
      if (raw.with_distances) sums.hit_distance += raw.hit_distance[from];
    }
    if (denoised == nullptr) return;
    sums.variance += denoised->variance[from], sums.history += denoised->tspp[from];
    sums.disocclusion += denoised->tspp[from] <= static_cast<float>(frames) ? 1.0f : 0.0f;
  };
  for_each_view_row(image.size.height, [&](uint32_t y) {
    for (uint32_t x = 0; x < image.size.width; ++x) {
      ViewSums sums;
      for (uint32_t sub = 0; sub < factor * factor; ++sub)
        add(x * factor + sub % factor, y * factor + sub / factor, sums);
      if (sums.hits == 0.0f) continue;
      const size_t out = size_t{y} * image.size.width + x;
      const float scale = 1.0f / sums.hits, moved_scale = 1.0f / std::max(sums.moved, 1.0f),
                  sample_scale = 1.0f / std::max(sums.samples, 1.0f);
      image.motion[out] = sums.motion * (moved_scale / static_cast<float>(factor));
      image.previous_depth[out] = sums.previous_depth * moved_scale;
      image.hit_distance[out] = sums.hit_distance * sample_scale;
      image.local_variance[out] = sums.local_variance * sample_scale;
      if (denoised == nullptr) continue;
      image.variance[out] = sums.variance * scale, image.history[out] = sums.history * scale;
      image.disocclusion[out] = sums.disocclusion * scale;
    }
  });
}

std::vector<float> local_variance(const AoFrame& frame) {
  constexpr int kRadius = 3;
  const int width = static_cast<int>(frame.size.width), height = static_cast<int>(frame.size.height);
  std::vector<float> result(frame.size.pixels(), 0.0f);
  const auto at = [&](int x, int y) { return static_cast<size_t>(y) * frame.size.width + static_cast<size_t>(x); };
  for_each_view_row(frame.size.height, [&](uint32_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < width; ++x) {
      if (!(frame.ao[at(x, y)] >= 0.0f)) continue;
      float count = 0, sum = 0, square = 0;
      for (int v = std::max(y - kRadius, 0); v <= std::min(y + kRadius, height - 1); ++v)
        for (int u = std::max(x - kRadius, 0); u <= std::min(x + kRadius, width - 1); ++u)
          if (const float ao = frame.ao[at(u, v)]; ao >= 0.0f) count += 1.0f, sum += ao, square += ao * ao;
      if (count > 1.0f) result[at(x, y)] = std::max(0.0f, (square - sum * sum / count) / (count - 1.0f));
    }
  });
  return result;
}

} // namespace packtrace
