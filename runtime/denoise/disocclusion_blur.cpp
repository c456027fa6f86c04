#include "runtime/denoise/disocclusion_blur.h"

namespace packtrace {
namespace {

constexpr float kUnknownInverseVariance = 4.0f;

struct WeightedMean {
  float weight = 0, sum = 0;
  void add(float w, float value) { weight += w, sum += w * value; }
};

WeightedMean weighted_neighbour_mean(const EdgeWeights& edges, const Plane<float>& samples, const Plane<float>& value,
                                     int x, int y) {
  WeightedMean mean;
  for (size_t d = 0; d < EdgeWeights::kDirections.size(); ++d) {
    const int dx = edges.step() * EdgeWeights::kDirections[d][0], dy = edges.step() * EdgeWeights::kDirections[d][1];
    const Plane<uint8_t>& weights = edges.direction(d);
    if (samples.row(y + dy)[x + dx] > 0.0f) mean.add(static_cast<float>(weights.row(y)[x]), value.row(y + dy)[x + dx]);
    if (samples.row(y - dy)[x - dx] > 0.0f)
      mean.add(static_cast<float>(weights.row(y - dy)[x - dx]), value.row(y - dy)[x - dx]);
  }
  return mean;
}

WeightedMean mean_of_window(const Plane<float>& samples, const Plane<float>& value, int x, int y) {
  WeightedMean mean;
  for (int dy = -kPlaneBorder; dy <= kPlaneBorder; ++dy)
    for (int dx = -kPlaneBorder; dx <= kPlaneBorder; ++dx)
      if (samples.row(y + dy)[x + dx] > 0.0f) mean.add(1.0f, value.row(y + dy)[x + dx]);
  return mean;
}

} // namespace

void fill_unsampled(const Guides& guides, const Plane<float>& samples, std::span<const EdgeWeights> edges,
                    NoisyImage& image) {
  for_row_blocks(guides.size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      if (image.min_tspp[static_cast<size_t>(y)] > 0.0f) continue;
      for (int x = 0; x < static_cast<int>(guides.size.width); ++x) {
        if (!(guides.disparity.row(y)[x] > 0.0f) || samples.row(y)[x] > 0.0f) continue;
        WeightedMean mean; // only of sampled pixels, which this loop never writes
        for (size_t i = 0; i < edges.size() && mean.weight == 0.0f; ++i)
          mean = weighted_neighbour_mean(edges[i], samples, image.value, x, y);
        if (mean.weight == 0.0f) mean = mean_of_window(samples, image.value, x, y);
        image.value.row(y)[x] = mean.weight > 0.0f ? mean.sum / mean.weight : 1.0f;
        image.inverse_variance.row(y)[x] = kUnknownInverseVariance;
      }
    }
  });
}

void disocclusion_blur(const Plane<float>& samples, std::span<const EdgeWeights> edges, float frames, float limit,
                       ImageSize size, NoisyImage& image, BlurScratch& scratch) {
  for (const EdgeWeights& step : edges) edge_blur(step, samples, Fade{0.0f, frames}, limit, size, image, scratch);
}

} // namespace packtrace
