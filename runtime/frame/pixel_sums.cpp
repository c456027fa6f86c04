#include "runtime/frame/pixel_sums.h"

#include <cstddef>
#include <functional>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

namespace packtrace {
namespace {

using Pixels = tbb::blocked_range<size_t>;
constexpr size_t kPixelsAtOnce = 1u << 16; ///< pixels of a task; fixed, so that sums do not depend on the threads

} // namespace

uint64_t count_hits(const GBuffer& gbuffer) {
  const auto count = [&](const Pixels& pixels, uint64_t before) {
    for (size_t i = pixels.begin(); i < pixels.end(); ++i) before += gbuffer.instance[i] != kNoInstance ? 1 : 0;
    return before;
  };
  return tbb::parallel_deterministic_reduce(Pixels(0, gbuffer.instance.size(), kPixelsAtOnce), uint64_t{0}, count,
                                            std::plus<>());
}

double mean_history(const DenoisedAo& denoised) {
  struct Sum {
    double frames = 0.0;
    uint64_t pixels = 0;
  };
  const auto add = [&](const Pixels& pixels, Sum sum) {
    for (size_t i = pixels.begin(); i < pixels.end(); ++i)
      if (denoised.ao[i] >= 0.0f) sum.frames += static_cast<double>(denoised.tspp[i]), ++sum.pixels;
    return sum;
  };
  const auto join = [](const Sum& a, const Sum& b) { return Sum{a.frames + b.frames, a.pixels + b.pixels}; };
  const Sum sum = tbb::parallel_deterministic_reduce(Pixels(0, denoised.ao.size(), kPixelsAtOnce), Sum{}, add, join);
  return sum.pixels > 0 ? sum.frames / static_cast<double>(sum.pixels) : 0.0;
}

} // namespace packtrace
