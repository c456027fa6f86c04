#include "runtime/frame/shaded_mean.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <optional>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/frame/shaded_filter.h"
#include "runtime/shade/bsdf.h"

namespace packtrace {
namespace {

/// Longest histories that follow motion, in frames.
struct Longest {
  float direct, specular;
};
Longest longest_of(ShadedHistory history) {
  if (history == ShadedHistory::kMotion) return {32.0f, 12.0f};
  if (history == ShadedHistory::kChanged) return {6.0f, 4.0f};
  return {65536.0f, 65536.0f};
}

template <class Work>
void for_each_row(uint32_t height, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, height, 8), [&](const tbb::blocked_range<uint32_t>& rows) {
    for (uint32_t y = rows.begin(); y < rows.end(); ++y) work(y);
  });
}

/// Mean and variance per colour of the 7 x 7 pixels around one.
struct LocalRange {
  Vec3 mean{0.0f}, variance{0.0f};
};
LocalRange local_range(std::span<const Vec3> values, ImageSize size, uint32_t x, uint32_t y) {
  constexpr uint32_t kReach = 3;
  Vec3 sum(0.0f), squares(0.0f);
  float count = 0.0f;
  for (uint32_t j = std::max(y, kReach) - kReach; j <= std::min(y + kReach, size.height - 1); ++j)
    for (uint32_t i = std::max(x, kReach) - kReach; i <= std::min(x + kReach, size.width - 1); ++i) {
      const Vec3 v = values[size_t{j} * size.width + i];
      if (!is_finite(v)) continue;
      sum += v, squares += v * v, count += 1.0f;
    }
  sum /= count;
  return {sum, glm::max(squares / count - sum * sum, Vec3(0.0f))};
}

/// Moves the history of reflections into the range of the new frame around the pixel, where it lies farther away than
/// noise explains. The noise is the larger of what the history and the new frame show: rare bright samples stay.
void limit_specular(ShadedPixel& p, const ShadedFrame& frame, uint32_t x, uint32_t y) {
  constexpr float kDeviations = 3.0f, kKnownNoise = 4.0f; // frames from which on the history determines its noise
  if (p.specular_frames < kKnownNoise) return;
  if (p.specular == Vec3(0.0f) && frame.specular[size_t{y} * frame.size.width + x] == Vec3(0.0f)) return;
  const LocalRange range = local_range(frame.specular, frame.size, x, y);
  const float light = luminance(p.specular), noise = std::max(p.specular_square - light * light, 0.0f);
  const Vec3 tolerance = kDeviations * glm::sqrt(glm::max(range.variance, Vec3(noise)));
  p.specular = glm::clamp(p.specular, range.mean - tolerance, range.mean + tolerance);
  const float limited = luminance(p.specular);
  p.specular_square = noise + limited * limited;
}

void add_to(Vec3& mean, float& square, float& frames, float longest, Vec3 value) {
  frames = std::min(frames + 1.0f, longest);
  const float light = luminance(value);
  mean += (value - mean) / frames;
  square += (light * light - square) / frames;
}

/// By what direct light that was seen on one albedo is multiplied to continue on another one; nothing if it tells too
/// little: dark albedos hide the light, and large ratios enlarge the noise.
std::optional<Vec3> albedo_ratio(Vec3 now, Vec3 then) {
  constexpr float kLargest = 4.0f;
  const Vec3 ratio = light_base(now) / light_base(then);
  for (int c = 0; c < 3; ++c) {
    if (!(ratio[c] <= kLargest && ratio[c] * kLargest >= 1.0f)) return std::nullopt;
    if (then[c] < kDarkAlbedo && now[c] >= kDarkAlbedo) return std::nullopt;
  }
  return ratio;
}

} // namespace

/// The means that a pixel continues, without ambient light; without frames if there are none.
ShadedPixel ShadedMean::reprojected(const GBuffer& g, size_t pixel, int x, int y) const {
  constexpr float kMinNormalCosine = 0.9f, kDepthTolerance = 0.02f;
  ShadedPixel sum;
  const Vec2 from = Vec2(static_cast<float>(x), static_cast<float>(y)) - g.motion_px[pixel];
  const float z = g.previous_z.empty() ? g.view_z[pixel] : g.previous_z[pixel];
  const auto width = static_cast<float>(g.size.width), height = static_cast<float>(g.size.height);
  if (g.instance[pixel] == kNoInstance || !(z > 0.0f)) return sum;
  if (!(from.x > -1.0f && from.y > -1.0f && from.x < width && from.y < height)) return sum;
  const Vec2 floor = glm::floor(from), part = from - floor;
  float weights = 0.0f;
  for (int corner = 0; corner < 4; ++corner) {
    const int right = corner & 1, down = corner >> 1;
    const int i = static_cast<int>(floor.x) + right, j = static_cast<int>(floor.y) + down;
    if (i < 0 || j < 0 || i >= static_cast<int>(g.size.width) || j >= static_cast<int>(g.size.height)) continue;
    const size_t at = static_cast<size_t>(j) * g.size.width + static_cast<size_t>(i);
    const Surface& then = surfaces_[at];
    const float weight = (right != 0 ? part.x : 1.0f - part.x) * (down != 0 ? part.y : 1.0f - part.y);
    if (weight <= 0.0f || then.instance != g.instance[pixel] || then.material != g.material[pixel]) continue;
    if (glm::dot(then.normal, g.normal[pixel]) < kMinNormalCosine) continue;
    if (std::abs(then.view_z - z) > kDepthTolerance * z) continue;
    const ShadedPixel& mean = before_[at];
    const std::optional<Vec3> ratio = albedo_ratio(g.albedo[pixel], then.albedo);
    if (!ratio || !(mean.direct_frames > 0.0f)) continue;
    const float scale = luminance(*ratio);
    weights += weight;
    sum.direct += weight * *ratio * mean.direct, sum.specular += weight * mean.specular;
    sum.direct_square += weight * scale * scale * mean.direct_square;
    sum.specular_square += weight * mean.specular_square;
    sum.direct_frames += weight * mean.direct_frames, sum.specular_frames += weight * mean.specular_frames;
  }
  if (weights < 0.01f) return {};
  const float scale = 1.0f / weights; // the frames stay scaled by the weights: partial agreement shortens the history
  sum.direct *= scale, sum.specular *= scale, sum.direct_square *= scale, sum.specular_square *= scale;
  return sum;
}

uint64_t ShadedMean::add(const ShadedFrame& frame, const GBuffer& gbuffer, ShadedHistory history) {
  const bool follows = history == ShadedHistory::kMotion || history == ShadedHistory::kChanged;
  const size_t n = frame.size.pixels();
  if (pixels_.size() != n || history == ShadedHistory::kNone) pixels_.assign(n, {});
  const bool resamples = follows && surfaces_.size() == n;
  if (resamples) std::swap(pixels_, before_), pixels_.resize(n);
  const Longest longest = longest_of(history);
  std::atomic<uint64_t> dropped = 0;
  for_each_row(frame.size.height, [&](uint32_t y) {
    for (uint32_t x = 0; x < frame.size.width; ++x) {
      const size_t i = size_t{y} * frame.size.width + x;
      ShadedPixel& p = pixels_[i];
      if (follows) p = resamples ? reprojected(gbuffer, i, static_cast<int>(x), static_cast<int>(y)) : ShadedPixel{};
      if (is_finite(frame.ambient[i])) {
        p.ambient_frames += 1.0f;
        p.ambient += (frame.ambient[i] - p.ambient) / p.ambient_frames;
      }
      if (!is_finite(frame.direct[i]) || !is_finite(frame.specular[i])) {
        dropped.fetch_add(1, std::memory_order_relaxed);
        continue;
      }
      if (follows) limit_specular(p, frame, x, y);
      add_to(p.direct, p.direct_square, p.direct_frames, longest.direct, frame.direct[i]);
      add_to(p.specular, p.specular_square, p.specular_frames, longest.specular, frame.specular[i]);
    }
  });
  return dropped;
}

std::span<const ShadedPixel> ShadedMean::denoised(const ShadedGuides& guides) {
  filter_shading(pixels_, guides, before_);
  return before_;
}

void ShadedMean::keep_surfaces(const GBuffer& g) {
  surfaces_.resize(g.size.pixels());
  for_each_row(g.size.height, [&](uint32_t y) {
    for (size_t i = size_t{y} * g.size.width, end = i + g.size.width; i < end; ++i)
      surfaces_[i] = {g.view_z[i], g.instance[i], g.material[i], g.normal[i], g.albedo[i]};
  });
}

void resolve_shading(const FrameConfig& config, std::span<const ShadedPixel> pixels, std::span<const float> ao,
                     RenderedImage& image) {
  const uint32_t factor = config.supersample;
  const uint32_t width = config.traced_size().width;
  const size_t count = config.size.pixels();
  image.pbr.assign(count, Vec3(0)), image.direct.assign(count, Vec3(0)), image.specular.assign(count, Vec3(0));
  const float scale = 1.0f / static_cast<float>(factor * factor);
  for_each_row(config.size.height, [&](uint32_t y) {
    for (uint32_t x = 0; x < config.size.width; ++x) {
      Vec3 direct(0.0f), specular(0.0f), ambient(0.0f);
      for (uint32_t sub = 0; sub < factor * factor; ++sub) {
        const size_t in = (size_t{y} * factor + sub / factor) * width + size_t{x} * factor + sub % factor;
        const float open = config.view == FrameView::kPbrAo && ao[in] >= 0.0f ? ao[in] : 1.0f;
        direct += pixels[in].direct, specular += pixels[in].specular;
        ambient += pixels[in].ambient * open;
      }
      const size_t out = size_t{y} * config.size.width + x;
      image.direct[out] = direct * scale, image.specular[out] = specular * scale;
      image.pbr[out] = (direct + specular + ambient) * scale;
    }
  });
}

std::vector<std::byte> ShadedMean::save() const {
  const auto bytes = std::as_bytes(std::span(pixels_));
  return {bytes.begin(), bytes.end()};
}

bool ShadedMean::restore(size_t pixels, std::span<const std::byte> bytes) {
  clear();
  if (bytes.empty()) return true;
  if (bytes.size() != pixels * sizeof(ShadedPixel)) return false;
  pixels_.resize(pixels);
  std::memcpy(static_cast<void*>(pixels_.data()), bytes.data(), bytes.size());
  return std::ranges::all_of(pixels_, [](const ShadedPixel& p) { return p.direct_frames >= 0.0f; });
}

} // namespace packtrace
