#include "runtime/denoise/reference/reprojection.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "runtime/denoise/reference/row_math.h"

namespace packtrace::reference {
namespace {

/// What a row of pixels looks for in the previous frame, and what it finds.
struct ReprojectedRow {
  explicit ReprojectedRow(size_t width)
      : at(width), fx(width), fy(width), z(width), tolerance(width), epsilon(width), cosine(width), weight(width),
        sums(kSums * width) {}

  enum Sum : size_t { kWeight, kValue, kMean, kSquare, kDistance, kTspp, kSums };
  float* sum(Sum which) { return sums.data() + which * at.size(); }

  std::vector<int32_t> at;   ///< index of the footprint's top left pixel, relative to pixel (0, 0)
  std::vector<float> fx, fy; ///< position within the footprint, [0, 1)
  std::vector<float> z, tolerance, epsilon;
  std::vector<float> cosine, weight; ///< of the current tap
  std::vector<float> sums;
};

struct LocateInput {
  const float *motion, *previous_z, *z, *dx, *dy;
  float width, height, sigma, epsilon;
  int32_t stride;
  int y;
};

/// Fills the upper half of a ReprojectedRow. Returns whether a footprint is not just its top left pixel.
PACKTRACE_AVX2_CLONES
bool locate_row(int width, const LocateInput& input, int32_t* __restrict at, float* __restrict fx, float* __restrict fy,
                float* __restrict out_z, float* __restrict tolerance, float* __restrict epsilon) {
  const LocateInput in = input;
  const float y = static_cast<float>(in.y);
  int fractions = 0;
  for (int x = 0; x < width; ++x) {
    const float from_x = static_cast<float>(x) - in.motion[2 * x], from_y = y - in.motion[2 * x + 1];
    const float now = in.z[x], before = in.previous_z[x];
    // Rejects NaN, too, and keeps the conversion to int from overflowing.
    const bool inside = (from_x > -1.0f) & (from_x < in.width) & (from_y > -1.0f) & (from_y < in.height) &
                        (now > 0.0f) & (before > 0.0f) & (before <= kLargestDepth);
    const float px = inside ? from_x : 0.0f, py = inside ? from_y : 0.0f;
    const int32_t cut_x = static_cast<int32_t>(px), cut_y = static_cast<int32_t>(py);
    const int32_t ix = cut_x - (static_cast<float>(cut_x) > px ? 1 : 0);
    const int32_t iy = cut_y - (static_cast<float>(cut_y) > py ? 1 : 0);
    const float rest_x = px - static_cast<float>(ix), rest_y = py - static_cast<float>(iy);
    const float eps = in.epsilon * floor_to_power_of_two(before);
    at[x] = iy * in.stride + ix;
    fx[x] = rest_x;
    fy[x] = rest_y;
    out_z[x] = inside ? before : 0.0f;
    tolerance[x] = in.sigma * (std::abs(in.dx[x]) + std::abs(in.dy[x])) + eps;
    epsilon[x] = eps;
    fractions += (rest_x != 0.0f) | (rest_y != 0.0f) ? 1 : 0;
  }
  return fractions != 0;
}

struct TestInput {
  const float *normal_x, *normal_y, *normal_z;          ///< of the row
  const float *old_z, *old_x, *old_y, *old_zn, *old_ao; ///< of the previous frame, at the tap of pixel (0, 0)
  float normal_slack, depth_cutoff;
  bool right, below; ///< which pixel of the footprint
};

/// Writes saturate(slack n.n_i) and the product of the tap's other weights.
PACKTRACE_AVX2_CLONES
void test_tap(int width, const TestInput& input, const int32_t* __restrict at, const float* __restrict fx,
              const float* __restrict fy, const float* __restrict z, const float* __restrict tolerance,
              const float* __restrict epsilon, float* __restrict cosine, float* __restrict weight) {
  const TestInput in = input;
  for (int x = 0; x < width; ++x) {
    const int32_t i = at[x];
    const float old_z = in.old_z[i], ao = in.old_ao[i];
    const float dot = in.old_x[i] * in.normal_x[x] + in.old_y[i] * in.normal_y[x] + in.old_zn[i] * in.normal_z[x];
    const float distance = std::abs(old_z - z[x]);
    const float depth = smaller(1.0f, tolerance[x] / (distance + epsilon[x]));
    const float bilinear = (in.right ? fx[x] : 1.0f - fx[x]) * (in.below ? fy[x] : 1.0f - fy[x]);
    const bool usable = (z[x] > 0.0f) & (old_z > 0.0f) & (ao >= 0.0f) & (ao <= 1.0f) & (depth >= in.depth_cutoff);
    cosine[x] = saturate(in.normal_slack * dot);
    weight[x] = usable ? bilinear * depth : 0.0f;
  }
}

PACKTRACE_AVX2_CLONES
void square_in_place(int width, float* __restrict values) {
  for (int x = 0; x < width; ++x) values[x] *= values[x];
}

struct HistoryTap {
  const float *value, *mean, *square, *distance, *tspp; ///< at the tap of pixel (0, 0)
};

/// Adds a tap to the sums. Damaged history counts as 0.
PACKTRACE_AVX2_CLONES
void add_tap(int width, const HistoryTap& input, const int32_t* __restrict at, const float* __restrict cosine,
             const float* __restrict weight, float* __restrict sums, size_t sum_stride) {
  const HistoryTap tap = input;
  float* __restrict weights = sums;
  float* __restrict value = sums + sum_stride;
  float* __restrict mean = sums + 2 * sum_stride;
  float* __restrict square = sums + 3 * sum_stride;
  float* __restrict distance = sums + 4 * sum_stride;
  float* __restrict tspp = sums + 5 * sum_stride;
  for (int x = 0; x < width; ++x) {
    const int32_t i = at[x];
    const float w = weight[x] * cosine[x];
    weights[x] += w;
    value[x] += w * saturate(tap.value[i]); // without history: weight 0
    mean[x] += w * saturate(tap.mean[i]);
    square[x] += w * saturate(tap.square[i]);
    distance[x] += w * smaller(kLargestDepth, larger(0.0f, tap.distance[i]));
    tspp[x] += w * smaller(1e3f, larger(1.0f, tap.tspp[i]));
  }
}

struct HistoryRow {
  float *value, *mean, *square, *distance, *tspp;
};

PACKTRACE_AVX2_CLONES
void store_row(int width, const float* __restrict sums, size_t sum_stride, float min_weight, float max_tspp,
               const HistoryRow& output) {
  const HistoryRow out = output;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float weight = sums[x];
    const bool found = weight > min_weight;
    const float scale = found ? 1.0f / weight : 0.0f;
    const float tspp = found ? larger(1.0f, smaller(sums[5 * sum_stride + static_cast<size_t>(x)], max_tspp)) : 0.0f;
    out.value[x] = found ? smaller(1.0f, sums[sum_stride + static_cast<size_t>(x)] * scale) : kInvalidAo;
    out.mean[x] = sums[2 * sum_stride + static_cast<size_t>(x)] * scale;
    out.square[x] = sums[3 * sum_stride + static_cast<size_t>(x)] * scale;
    out.distance[x] = sums[4 * sum_stride + static_cast<size_t>(x)] * scale;
    out.tspp[x] = tspp;
  }
}

class Reprojector {
public:
  Reprojector(const Frame& previous, const ReferenceConfig& config)
      : previous_(previous), config_(config), stride_(previous.surfaces.z.stride()) {}

  /// Gathers the 2 x 2 pixels of every footprint of a row into row.sums.
  void gather(const Surfaces& surfaces, int y, bool fractions, ReprojectedRow& row) const {
    const int width = static_cast<int>(surfaces.size.width);
    std::fill(row.sums.begin(), row.sums.end(), 0.0f);
    for (int tap = 0; tap < (fractions ? 4 : 1); ++tap) {
      const bool right = tap % 2 != 0, below = tap / 2 != 0;
      const ptrdiff_t offset = (below ? stride_ : 0) + (right ? 1 : 0);
      const Surfaces& old = previous_.surfaces;
      const TestInput test{surfaces.normal_x.row(y),
                           surfaces.normal_y.row(y),
                           surfaces.normal_z.row(y),
                           old.z.row(0) + offset,
                           old.normal_x.row(0) + offset,
                           old.normal_y.row(0) + offset,
                           old.normal_z.row(0) + offset,
                           previous_.history.value.row(0) + offset,
                           config_.reprojection_normal_slack,
                           config_.reprojection_depth_cutoff,
                           right,
                           below};
      test_tap(width, test, row.at.data(), row.fx.data(), row.fy.data(), row.z.data(), row.tolerance.data(),
               row.epsilon.data(), row.cosine.data(), row.weight.data());
      for (int i = std::countr_zero(config_.reprojection_normal_power); i > 0; --i)
        square_in_place(width, row.cosine.data());
      const History& h = previous_.history;
      const HistoryTap history{h.value.row(0) + offset, h.mean.row(0) + offset, h.square.row(0) + offset,
                               h.distance.row(0) + offset, h.tspp.row(0) + offset};
      add_tap(width, history, row.at.data(), row.cosine.data(), row.weight.data(), row.sums.data(), row.at.size());
    }
  }

private:
  const Frame& previous_;
  const ReferenceConfig& config_;
  ptrdiff_t stride_;
};

} // namespace

void reproject(const Frame& previous, const Surfaces& surfaces, const Derivatives& derivatives,
               std::span<const Vec2> motion_px, std::span<const float> previous_z, const ReferenceConfig& config,
               History& reprojected) {
  const Reprojector reprojector(previous, config);
  const ImageSize size = surfaces.size;
  for_row_blocks(size.height, [&](int first, int last) {
    ReprojectedRow row(size.width);
    for (int y = first; y < last; ++y) {
      const size_t begin = static_cast<size_t>(y) * size.width;
      const LocateInput input{&motion_px[begin].x,
                              previous_z.empty() ? surfaces.z.row(y) : &previous_z[begin],
                              surfaces.z.row(y),
                              derivatives.x.row(y),
                              derivatives.y.row(y),
                              static_cast<float>(size.width),
                              static_cast<float>(size.height),
                              config.reprojection_depth_sigma,
                              config.depth_epsilon,
                              static_cast<int32_t>(surfaces.z.stride()),
                              y};
      const int width = static_cast<int>(size.width);
      const bool fractions = locate_row(width, input, row.at.data(), row.fx.data(), row.fy.data(), row.z.data(),
                                        row.tolerance.data(), row.epsilon.data());
      reprojector.gather(surfaces, y, fractions, row);
      store_row(width, row.sums.data(), row.at.size(), config.reprojection_min_weight,
                static_cast<float>(config.max_tspp),
                {reprojected.value.row(y), reprojected.mean.row(y), reprojected.square.row(y),
                 reprojected.distance.row(y), reprojected.tspp.row(y)});
    }
  });
}

} // namespace packtrace::reference
