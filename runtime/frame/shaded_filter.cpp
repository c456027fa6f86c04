#include "runtime/frame/shaded_filter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/shade/bsdf.h"

namespace packtrace {
namespace {

constexpr int kPasses = 4;
constexpr float kLuminances = 3.0f;  ///< standard deviations by which neighbours may differ
constexpr float kLongHistory = 4.0f; ///< frames from which on a pixel's own samples determine its noise
constexpr float kFading = 8.0f;      ///< still frames from which the filter fades faster than the noise

/// One of the two signals of a pixel, with the variance of the luminance of its mean.
struct Signal {
  Vec3 colour{0.0f};
  float variance = 0.0f;
};

struct Grid {
  ImageSize size;
  size_t at(uint32_t x, uint32_t y) const { return size_t{y} * size.width + x; }
  /// Calls work(x, y) for all pixels.
  template <class Work>
  void for_each(const Work& work) const {
    tbb::parallel_for(tbb::blocked_range<uint32_t>(0, size.height, 8), [&](const tbb::blocked_range<uint32_t>& rows) {
      for (uint32_t y = rows.begin(); y < rows.end(); ++y)
        for (uint32_t x = 0; x < size.width; ++x) work(x, y);
    });
  }
  /// Calls work(index, i, j) for the 3 x 3 pixels around one, `step` apart, that lie in the image; i and j are in
  /// [-1, 1].
  template <class Work>
  void around(uint32_t x, uint32_t y, uint32_t step, const Work& work) const {
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const int64_t u = int64_t{x} + i * int64_t{step}, v = int64_t{y} + j * int64_t{step};
        if (u < 0 || v < 0 || u >= size.width || v >= size.height) continue;
        work(at(static_cast<uint32_t>(u), static_cast<uint32_t>(v)), i, j);
      }
  }
};

/// The surfaces of the pixels.
class Guides {
public:
  Guides(const ShadedGuides& g, const Grid& grid) : g_(g), slopes_(g.size.pixels()) {
    grid.for_each([&](uint32_t x, uint32_t y) {
      const size_t i = grid.at(x, y);
      // The smaller of the changes to both sides: the larger may cross an edge.
      const auto change = [&](bool before, size_t previous, bool after, size_t next) {
        const float a = before ? std::abs(g.view_z[previous] - g.view_z[i]) : INFINITY;
        const float b = after ? std::abs(g.view_z[next] - g.view_z[i]) : INFINITY;
        const float least = std::min(a, b);
        return std::isfinite(least) ? least : 0.0f;
      };
      slopes_[i] = std::max(change(x > 0, i - 1, x + 1 < g.size.width, i + 1),
                            change(y > 0, i - g.size.width, y + 1 < g.size.height, i + g.size.width));
    });
  }

  bool hits(size_t pixel) const { return g_.instance[pixel] != kNoInstance; }

  /// How far two pixels show the same surface, [0, 1].
  float weight(size_t a, size_t b, float distance_px) const {
    if (g_.instance[a] != g_.instance[b] || g_.material[a] != g_.material[b]) return 0.0f;
    const float cosine = std::max(glm::dot(g_.normal[a], g_.normal[b]), 0.0f);
    const float c2 = cosine * cosine, c4 = c2 * c2, c8 = c4 * c4, c32 = c8 * c8 * c8 * c8;
    const float tolerance = 2.0f * slopes_[a] * distance_px + 1e-3f * g_.view_z[a];
    const float depth = std::abs(g_.view_z[a] - g_.view_z[b]) / tolerance;
    return depth < 4.0f ? c32 * std::exp(-depth) : 0.0f;
  }

private:
  const ShadedGuides& g_;
  std::vector<float> slopes_; ///< change of depth per pixel
};

/// Variances of the means of short histories: that of their neighbours' colours.
/// @param frames length of the history of a pixel
/// @param other memory, as long as `signals`
template <class Frames>
void estimate_short_histories(const Grid& grid, const Guides& guides, const Frames& frames, std::span<Signal> signals,
                              std::span<Signal> other) {
  grid.for_each([&](uint32_t x, uint32_t y) {
    const size_t p = grid.at(x, y);
    other[p].variance = signals[p].variance;
    if (frames(p) >= kLongHistory) return;
    float sum = 0.0f, squares = 0.0f, weights = 0.0f;
    for (const uint32_t step : {1u, 2u})
      grid.around(x, y, step, [&](size_t q, int i, int j) {
        const float distance = static_cast<float>(step) * std::hypot(static_cast<float>(i), static_cast<float>(j));
        const float weight = guides.weight(p, q, distance);
        const float light = luminance(signals[q].colour);
        sum += weight * light, squares += weight * light * light, weights += weight;
      });
    if (!(weights > 0.0f)) return;
    const float mean = sum / weights;
    other[p].variance = std::max(other[p].variance, std::max(0.0f, squares / weights - mean * mean));
  });
  for (size_t i = 0; i < signals.size(); ++i) signals[i].variance = other[i].variance;
}

/// The variance of a pixel, smoothed: it is noisy itself.
float smooth_variance(const Grid& grid, std::span<const Signal> in, uint32_t x, uint32_t y) {
  float sum = 0.0f, weights = 0.0f;
  grid.around(x, y, 1, [&](size_t q, int i, int j) {
    const float weight = (i == 0 ? 2.0f : 1.0f) * (j == 0 ? 2.0f : 1.0f);
    sum += weight * in[q].variance, weights += weight;
  });
  return sum / weights;
}

void filter_pass(const Grid& grid, const Guides& guides, uint32_t step, std::span<const Signal> in,
                 std::span<Signal> out) {
  grid.for_each([&](uint32_t x, uint32_t y) {
    const size_t p = grid.at(x, y);
    out[p] = in[p];
    if (!guides.hits(p)) return;
    const float variance = smooth_variance(grid, in, x, y), light = luminance(in[p].colour);
    if (!(variance > 1e-8f * light * light)) return; // there is no noise to remove
    const float scale = 1.0f / (kLuminances * std::sqrt(variance));
    Vec3 sum(0.0f);
    float variances = 0.0f, weights = 0.0f;
    grid.around(x, y, step, [&](size_t q, int i, int j) {
      float weight = (i == 0 ? 2.0f : 1.0f) * (j == 0 ? 2.0f : 1.0f);
      if (q != p) {
        const float distance = static_cast<float>(step) * (i != 0 && j != 0 ? 1.4142f : 1.0f);
        weight *= guides.weight(p, q, distance);
        if (weight < 1e-4f) return;
        weight *= std::exp(-std::abs(luminance(in[q].colour) - light) * scale);
      }
      sum += weight * in[q].colour, variances += weight * weight * in[q].variance, weights += weight;
    });
    out[p] = {sum / weights, variances / (weights * weights)};
  });
}

/// Filters a signal; the second vector is memory of the same length.
template <class Frames>
void filter_signal(const Grid& grid, const Guides& guides, const Frames& frames, std::vector<Signal>& signals,
                   std::vector<Signal>& other) {
  estimate_short_histories(grid, guides, frames, signals, other);
  for (int pass = 0; pass < kPasses; ++pass) {
    filter_pass(grid, guides, 1u << pass, signals, other);
    std::swap(signals, other);
  }
}

/// Variance of the mean of a history; less for long ones of a still view, whose noise is smaller than what the filter
/// would blur.
float variance_of_mean(Vec3 mean, float square, float frames, float still_frames) {
  const float light = luminance(mean), fade = std::min(1.0f, kFading / std::min(frames, still_frames));
  return fade * fade * std::max(0.0f, square - light * light) / std::max(frames - 1.0f, 1.0f);
}

} // namespace

void filter_shading(std::span<const ShadedPixel> pixels, const ShadedGuides& g, std::vector<ShadedPixel>& result) {
  const Grid grid{g.size};
  const Guides guides(g, grid);
  result.assign(pixels.begin(), pixels.end());
  std::vector<Signal> signals(pixels.size()), other(pixels.size());
  const auto base = [&](size_t i) { return light_base(g.albedo[i]); };
  for (size_t i = 0; i < pixels.size(); ++i) {
    const ShadedPixel& p = pixels[i];
    const float scale = 1.0f / luminance(base(i));
    signals[i] = {p.direct / base(i),
                  variance_of_mean(p.direct, p.direct_square, p.direct_frames, g.still_frames) * scale * scale};
  }
  filter_signal(grid, guides, [&](size_t i) { return pixels[i].direct_frames; }, signals, other);
  for (size_t i = 0; i < pixels.size(); ++i)
    if (guides.hits(i)) result[i].direct = signals[i].colour * base(i);
  for (size_t i = 0; i < pixels.size(); ++i) {
    const ShadedPixel& p = pixels[i];
    signals[i] = {p.specular, variance_of_mean(p.specular, p.specular_square, p.specular_frames, g.still_frames)};
  }
  filter_signal(grid, guides, [&](size_t i) { return pixels[i].specular_frames; }, signals, other);
  for (size_t i = 0; i < pixels.size(); ++i)
    if (guides.hits(i)) result[i].specular = signals[i].colour;
}

} // namespace packtrace
