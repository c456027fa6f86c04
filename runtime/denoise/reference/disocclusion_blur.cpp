#include "runtime/denoise/reference/disocclusion_blur.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/denoise/reference/row_math.h"

namespace packtrace::reference {
namespace {

struct DisocclusionRow {
  const float *above, *here, *below;       ///< values one step apart
  const float *z_above, *z_here, *z_below; ///< depths one step apart
  const float* tspp;
};

PACKTRACE_AVX2_CLONES
void blur_disoccluded_row(int width, ptrdiff_t step, const DisocclusionRow& rows, float straight, float diagonal,
                          float inverse_frames, float* __restrict out) {
  const DisocclusionRow r = rows;
  for (ptrdiff_t x = 0; x < width; ++x) {
    const float z = r.z_here[x], value = r.here[x];
    const bool known = value >= 0.0f;
    float sum = known ? kCentre * kCentre * value : 0.0f, weights = known ? kCentre * kCentre : 0.0f;
    const auto tap = [&](float other, float other_z, float gaussian, float tolerance) {
      const bool usable = (other >= 0.0f) & (other_z > 0.0f) & (std::abs(other_z - z) <= tolerance * z);
      const float w = usable ? gaussian : 0.0f;
      sum += w * larger(0.0f, other);
      weights += w;
    };
    tap(r.here[x - step], r.z_here[x - step], kAside * kCentre, straight);
    tap(r.here[x + step], r.z_here[x + step], kAside * kCentre, straight);
    tap(r.above[x], r.z_above[x], kAside * kCentre, straight);
    tap(r.below[x], r.z_below[x], kAside * kCentre, straight);
    tap(r.above[x - step], r.z_above[x - step], kAside * kAside, diagonal);
    tap(r.above[x + step], r.z_above[x + step], kAside * kAside, diagonal);
    tap(r.below[x - step], r.z_below[x - step], kAside * kAside, diagonal);
    tap(r.below[x + step], r.z_below[x + step], kAside * kAside, diagonal);
    const bool filled = (weights > 0.0f) & (z > 0.0f);
    const float filtered = filled ? sum / weights : kInvalidAo;
    const float strength = 1.0f - smaller(1.0f, r.tspp[x] * inverse_frames);
    const float mixed = value + (filtered - value) * strength;
    out[x] = known ? (filled ? mixed : value) : filtered;
  }
}

PACKTRACE_AVX2_CLONES
int count_short_histories(int width, const float* __restrict z, const float* __restrict tspp, float frames) {
  int count = 0;
  for (int x = 0; x < width; ++x) count += (z[x] > 0.0f) & (tspp[x] < frames) ? 1 : 0;
  return count;
}

/// Per row, whether it has a surface with a history shorter than `frames`.
std::vector<uint8_t> rows_with_short_histories(const Surfaces& surfaces, const Plane<float>& tspp, float frames) {
  std::vector<uint8_t> rows(surfaces.size.height);
  const int width = static_cast<int>(surfaces.size.width);
  for_row_blocks(surfaces.size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y)
      rows[static_cast<size_t>(y)] = count_short_histories(width, surfaces.z.row(y), tspp.row(y), frames) > 0 ? 1 : 0;
  });
  return rows;
}

} // namespace

const Plane<float>& disocclusion_blur(const Surfaces& surfaces, const Plane<float>& tspp, const Plane<float>& value,
                                      const ReferenceConfig& config, std::array<Plane<float>, 2>& passes) {
  const int width = static_cast<int>(surfaces.size.width);
  const float frames = static_cast<float>(config.disocclusion_frames);
  const std::vector<uint8_t> blurs = rows_with_short_histories(surfaces, tspp, frames);
  if (std::ranges::find(blurs, 1) == blurs.end()) return value;
  const Plane<float>* in = &value;
  for (uint32_t pass = 0; pass < config.disocclusion_passes; ++pass) {
    Plane<float>& out = passes[pass % 2];
    const int step = 1 << pass;
    const float straight = config.disocclusion_depth + config.disocclusion_slope * static_cast<float>(step);
    const float diagonal =
        config.disocclusion_depth + config.disocclusion_slope * static_cast<float>(step) * std::numbers::sqrt2_v<float>;
    for_row_blocks(surfaces.size.height, [&](int first, int last) {
      for (int y = first; y < last; ++y) {
        if (blurs[static_cast<size_t>(y)] == 0) {
          std::copy_n(in->row(y), width, out.row(y));
          continue;
        }
        const DisocclusionRow row{
            in->row(y - step),        in->row(y), in->row(y + step), surfaces.z.row(y - step), surfaces.z.row(y),
            surfaces.z.row(y + step), tspp.row(y)};
        blur_disoccluded_row(width, step, row, straight, diagonal, 1.0f / frames, out.row(y));
      }
    });
    in = &out;
  }
  return *in;
}

} // namespace packtrace::reference
