#include "runtime/denoise/fill.h"

namespace packtrace {
namespace {

struct WeightedMean {
  float weight = 0, sum = 0;
  void add(float w, float value) { weight += w, sum += w * value; }
};

/// Pixels of the same surface that are PairGuides::kSteps[step] pixels away.
WeightedMean mean_of_neighbours(const FilterInput& input, size_t step, int x, int y) {
  const History& h = input.history;
  const int apart = PairGuides::kSteps[step];
  WeightedMean mean;
  for (size_t d = 0; d < kPairOffsets.size(); ++d)
    for (const int side : {apart, -apart}) {
      const int dx = side * kPairOffsets[d][0], dy = side * kPairOffsets[d][1];
      if (!(h.samples.row(y + dy)[x + dx] > 0.0f)) continue;
      const uint8_t weight =
          side > 0 ? *input.pair_guides.row(step, x, y)[d] : *input.pair_guides.row(step, x + dx, y + dy)[d];
      if (weight > kLoneGuide) mean.add(static_cast<float>(weight), h.mean.row(y + dy)[x + dx]);
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

float filled_value(const FilterInput& input, int x, int y) {
  WeightedMean mean;
  for (size_t step = 0; step < PairGuides::kSteps.size() && mean.weight == 0.0f; ++step)
    mean = mean_of_neighbours(input, step, x, y);
  if (mean.weight == 0.0f) mean = mean_of_window(input.history, x, y);
  return mean.weight > 0.0f ? mean.sum / mean.weight : 1.0f;
}

} // namespace packtrace
