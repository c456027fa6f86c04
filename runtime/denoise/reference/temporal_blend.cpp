#include "runtime/denoise/reference/temporal_blend.h"

#include <cmath>
#include <limits>

#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/reference/local_statistics.h"
#include "runtime/denoise/reference/row_math.h"

namespace packtrace::reference {
namespace {

struct BlendRow {
  const float *ao, *hit, *z, *count, *local_mean, *local_variance;
  float *value, *mean, *square, *distance, *tspp, *deviation, *mean_variance;
};

struct BlendScales {
  float max_tspp, min_blend, gamma, clamp_min, response, variance_frames, ray_length;
};

PACKTRACE_AVX2_CLONES
void blend_row(int width, const BlendRow& rows, BlendScales s) {
  const BlendRow r = rows;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const bool surface = r.z[x] > 0.0f;
    const bool sampled = (r.ao[x] >= 0.0f) & (r.ao[x] <= std::numeric_limits<float>::max()) & surface;
    const float sample = sampled ? smaller(1.0f, r.ao[x]) : 0.0f;
    const float old = r.value[x];
    const bool known = (old >= 0.0f) & surface;

    const bool clamps = r.count[x] > 1.5f;
    const float reach = larger(s.clamp_min, s.gamma * std::sqrt(r.local_variance[x]));
    const float bounded = smaller(r.local_mean[x] + reach, larger(r.local_mean[x] - reach, old));
    const float kept = clamps & known ? smaller(1.0f, larger(0.0f, bounded)) : old;
    const float trust = 1.0f - smaller(1.0f, s.response * std::abs(kept - old));

    const float before = known ? r.tspp[x] : 0.0f;
    const float counted = smaller(s.max_tspp, before + (sampled ? 1.0f : 0.0f)) * trust;
    const float tspp = known ? larger(1.0f, counted) : counted;
    const float share = larger(s.min_blend, 1.0f / larger(1.0f, tspp));
    const float a = sampled ? (known ? share : 1.0f) : 0.0f;

    const float base = known ? kept : 0.0f;
    const float mean = known ? r.mean[x] : 0.0f;
    const float square = known ? r.square[x] : 0.0f;
    const float distance = known ? r.distance[x] : 0.0f;
    const float new_mean = mean + (sample - mean) * a;
    const float new_square = square + (sample * sample - square) * a;
    const bool has_hit = sampled & (r.hit[x] > 0.0f) & (r.hit[x] <= std::numeric_limits<float>::max());
    const float hit = has_hit ? smaller(s.ray_length, r.hit[x]) : distance;
    const float temporal = larger(0.0f, new_square - new_mean * new_mean);
    const float variance = tspp >= s.variance_frames ? temporal : r.local_variance[x];

    const float value = base + (sample - base) * a;
    r.value[x] = known | sampled ? value : kInvalidAo;
    r.mean[x] = new_mean;
    r.square[x] = new_square;
    r.distance[x] = distance + (hit - distance) * (distance > 0.0f ? a : 1.0f);
    r.tspp[x] = tspp;
    r.deviation[x] = std::sqrt(variance);
    r.mean_variance[x] = tspp > 0.0f ? variance / tspp : 0.0f;
  }
}

} // namespace

void blend(std::span<const float> ao, std::span<const float> hit_distance, float ray_length, const Surfaces& surfaces,
           const ReferenceConfig& config, History& history, Plane<float>& deviation, std::span<float> mean_variance) {
  const BlendScales scales{static_cast<float>(config.max_tspp),
                           config.min_blend,
                           config.clamp_gamma,
                           config.clamp_min,
                           config.clamp_response,
                           static_cast<float>(config.variance_frames),
                           ray_length};
  const ImageSize size = surfaces.size;
  tbb::enumerable_thread_specific<LocalStatisticsRows> statistics(size, config.window);
  for_row_blocks(size.height, [&](int first, int last) {
    LocalStatisticsRows& rows = statistics.local();
    rows.begin(ao, first);
    for (int y = first; y < last; ++y) {
      const LocalStatistics& local = rows.at(ao, y);
      const size_t begin = static_cast<size_t>(y) * size.width;
      const BlendRow row{&ao[begin],
                         &hit_distance[begin],
                         surfaces.z.row(y),
                         local.count.data(),
                         local.mean.data(),
                         local.variance.data(),
                         history.value.row(y),
                         history.mean.row(y),
                         history.square.row(y),
                         history.distance.row(y),
                         history.tspp.row(y),
                         deviation.row(y),
                         &mean_variance[begin]};
      blend_row(static_cast<int>(size.width), row, scales);
    }
  });
}

} // namespace packtrace::reference
