#include "runtime/denoise/fill.h"

namespace packtrace {
namespace {

struct WeightedMean {
  float weight = 0, sum = 0;
  void add(float w, float value) { weight += w, sum += w * value; }
};

/// Pixels of the same surface that are `step` pixels away.
WeightedMean mean_of_neighbours(const FilterInput& input, const FilterKernels& kernels, const FluxConfig& config, int x,
                                int y, int step) {
  const History& h = input.history;
  WeightedMean mean;
  for (const auto& offset : kPairOffsets)
    for (const int side : {step, -step}) {
      const int dx = side * offset[0], dy = side * offset[1];
      if (!(h.samples.row(y + dy)[x + dx] > 0.0f)) continue;
      uint8_t weight = 0;
      kernels.guide(1, surface_at(input, x, y), surface_at(input, x + dx, y + dy), guide_terms(config, dx, dy),
                    &weight);
      if (weight > kMinGuide) mean.add(static_cast<float>(weight), h.mean.row(y + dy)[x + dx]);
    }
  return mean;
}

WeightedMean mean_of_window(const History& h, int x, int y) {
  WeightedMean mean;
  for (int dy = -kPlaneBorder; dy <= kPlaneBorder; ++dy)
    for (int dx = -kPlaneBorder; dx <= kPlaneBorder; ++dx)
      if (h.samples.row(y + dy)[x + dx] > 0.0f) mean.add(1.0f, h.mean.row(y + dy)[x + dx]);
  return mean;
}

} // namespace

float filled_value(const FilterInput& input, const FilterKernels& kernels, const FluxConfig& config, int x, int y) {
  WeightedMean mean;
  for (int step = 1; step <= 4 && mean.weight == 0.0f; step *= 2)
    mean = mean_of_neighbours(input, kernels, config, x, y, step);
  if (mean.weight == 0.0f) mean = mean_of_window(input.history, x, y);
  return mean.weight > 0.0f ? mean.sum / mean.weight : 1.0f;
}

} // namespace packtrace
