#include "runtime/denoise/reference/edge_stopping_blur.h"

#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>

#include "runtime/denoise/reference/depth_derivatives.h"
#include "runtime/denoise/reference/row_math.h"

namespace packtrace::reference {
namespace {

/// Where the taps of a row's pixels are, and the tolerances.
struct TapRow {
  explicit TapRow(size_t width)
      : left(width), column(width), right(width), above(width), row(width), below(width), reach(width), ratio(width),
        cosine(width), exponent(width), value(width), sum(width), weights(width) {
    std::iota(column.begin(), column.end(), 0);
    for (auto& kind : value_rate) kind.resize(width);
    for (auto& kind : depth_rate) kind.resize(width);
  }

  std::vector<int32_t> left, column, right; ///< columns of the taps and of the pixels
  std::vector<int32_t> above, row, below;   ///< first pixel of their rows, as an index relative to pixel (0, 0)
  std::vector<float> reach, ratio;
  std::array<std::vector<float>, 2>
      value_rate; ///< 1 / tolerance of values, straight and diagonal taps; 0 without a value
  std::array<std::vector<float>, 3> depth_rate; ///< 1 / tolerance of depths, taps along x, y and both
  std::vector<float> cosine, exponent, value;   ///< of the current tap
  std::vector<float> sum, weights;
};

PACKTRACE_AVX2_CLONES
void start_reach(int width, const float* __restrict distance, float ray_length, float kernel_scale,
                 float* __restrict reach, float* __restrict ratio) {
  for (int x = 0; x < width; ++x) {
    reach[x] = kernel_scale * distance[x];
    ratio[x] = smaller(1.0f, distance[x] / ray_length);
  }
}

PACKTRACE_AVX2_CLONES
void multiply_rows(int width, const float* __restrict factor, float* __restrict values) {
  for (int x = 0; x < width; ++x) values[x] *= factor[x];
}

struct StepInput {
  const float *z, *dx, *dy, *deviation, *value, *reach;
  float pixel_spread, fraction, max_step, value_sigma, value_floor, depth_sigma, epsilon;
  int32_t y, height, stride;
};

struct StepOutput {
  int32_t *left, *right, *above, *below;
  float *value_straight, *value_diagonal, *depth_x, *depth_y, *depth_xy;
};

/// Tap distance along an axis with a footprint, in pixels.
inline float tap_distance(float reach, float footprint, const StepInput& in) {
  const float wanted = reach / larger(1e-30f, footprint) + 0.5f;
  const float target = static_cast<float>(static_cast<int32_t>(larger(1.0f, smaller(in.max_step, wanted))));
  return static_cast<float>(static_cast<int32_t>(larger(1.0f, target * in.fraction + 0.5f)));
}

PACKTRACE_AVX2_CLONES
void choose_taps(int width, const StepInput& input, const StepOutput& output) {
  const StepInput in = input;
  const StepOutput out = output;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float z = in.z[x], flat = in.pixel_spread * z;
    const bool known = in.value[x] >= 0.0f;
    const float reach = known ? in.reach[x] : 0.0f;
    const float step_x = tap_distance(reach, std::sqrt(flat * flat + in.dx[x] * in.dx[x]), in);
    const float step_y = tap_distance(reach, std::sqrt(flat * flat + in.dy[x] * in.dy[x]), in);
    const int32_t sx = static_cast<int32_t>(step_x), sy = static_cast<int32_t>(step_y);
    // Taps outside the image read a pixel of the border, which is a miss.
    out.left[x] = x - sx >= 0 ? x - sx : -1;
    out.right[x] = x + sx < width ? x + sx : -1;
    out.above[x] = (in.y - sy >= 0 ? in.y - sy : -1) * in.stride;
    out.below[x] = (in.y + sy < in.height ? in.y + sy : -1) * in.stride;
    const float spread = known ? in.value_sigma * in.deviation[x] : 0.0f, enabled = known ? 1.0f : 0.0f;
    out.value_straight[x] = enabled / (spread + in.value_floor);
    out.value_diagonal[x] = enabled / (spread / std::numbers::sqrt2_v<float> + in.value_floor);
    const float eps = in.epsilon * floor_to_power_of_two(z) + 1e-37f;
    const float change_x = in.depth_sigma * depth_change(z, in.dx[x], step_x);
    const float change_y = in.depth_sigma * depth_change(z, in.dy[x], step_y);
    out.depth_x[x] = 1.0f / (change_x + eps);
    out.depth_y[x] = 1.0f / (change_y + eps);
    out.depth_xy[x] = 1.0f / (change_x + change_y + eps);
  }
}

/// Pointers of the current row, and of whole planes at pixel (0, 0), of which taps are read.
struct CompareInput {
  const float *z, *normal_x, *normal_y, *normal_z, *value;
  const float *all_z, *all_x, *all_y, *all_zn, *all_value;
  const int32_t *row, *column;
  const float *value_rate, *depth_rate;
  float epsilon, depth_cutoff;
};

/// Writes a tap's value, max(0, n.n_i), and the exponent of the other weights; a huge exponent for a tap to ignore.
PACKTRACE_AVX2_CLONES
void compare_tap(int width, const CompareInput& input, float* __restrict cosine, float* __restrict exponent,
                 float* __restrict tap_value) {
  const CompareInput in = input;
  for (int x = 0; x < width; ++x) {
    const int32_t i = in.row[x] + in.column[x];
    const float z = in.z[x], other_z = in.all_z[i], value = in.all_value[i];
    const float dot = in.all_x[i] * in.normal_x[x] + in.all_y[i] * in.normal_y[x] + in.all_zn[i] * in.normal_z[x];
    const float eps = in.epsilon * floor_to_power_of_two(z);
    const float depth = larger(0.0f, std::abs(other_z - z) - eps) * in.depth_rate[x];
    const bool usable = (other_z > 0.0f) & (z > 0.0f) & (value >= 0.0f) & (depth <= in.depth_cutoff);
    cosine[x] = smaller(1.0f, larger(0.0f, dot));
    exponent[x] = usable ? depth + std::abs(value - in.value[x]) * in.value_rate[x] : 1e30f;
    tap_value[x] = value;
  }
}

PACKTRACE_AVX2_CLONES
void square_weights(int width, float* __restrict values) {
  for (int x = 0; x < width; ++x) values[x] *= values[x];
}

PACKTRACE_AVX2_CLONES
void add_weighted_tap(int width, float gaussian, const float* __restrict cosine, const float* __restrict exponent,
                      const float* __restrict tap_value, float* __restrict sum, float* __restrict weights) {
  for (int x = 0; x < width; ++x) {
    const float w = gaussian * cosine[x] * exp_of_negative(-exponent[x]);
    sum[x] += w * tap_value[x];
    weights[x] += w;
  }
}

PACKTRACE_AVX2_CLONES
void finish_blur(int width, const float* __restrict blended, const float* __restrict sum,
                 const float* __restrict weights, float* __restrict value, float* __restrict mean,
                 float* __restrict square) {
  for (int x = 0; x < width; ++x) {
    const float own = blended[x] >= 0.0f ? kCentre * kCentre : 0.0f;
    const float total = own + weights[x];
    const bool filled = total > 1e-6f;
    const float blurred = smaller(1.0f, (own * larger(0.0f, blended[x]) + sum[x]) / (filled ? total : 1.0f));
    value[x] = filled ? blurred : blended[x];
    const bool is_new = filled & (own == 0.0f);
    mean[x] = is_new ? blurred : mean[x];
    square[x] = is_new ? blurred * blurred : square[x];
  }
}

/// The blur of one frame.
class EdgeStoppingBlur {
public:
  EdgeStoppingBlur(const Surfaces& surfaces, const Derivatives& derivatives, const Plane<float>& blended,
                   const Plane<float>& deviation, BlurScale scale, const ReferenceConfig& config)
      : surfaces_(surfaces), derivatives_(derivatives), blended_(blended), deviation_(deviation), scale_(scale),
        config_(config), width_(static_cast<int>(surfaces.size.width)) {}

  void blur_row(int y, TapRow& taps, History& history) const {
    choose_row_taps(y, history, taps);
    std::fill(taps.sum.begin(), taps.sum.end(), 0.0f);
    std::fill(taps.weights.begin(), taps.weights.end(), 0.0f);
    std::fill(taps.row.begin(), taps.row.end(), static_cast<int32_t>(y * surfaces_.z.stride()));
    for (const auto* column : {&taps.left, &taps.column, &taps.right})
      for (const auto* row : {&taps.above, &taps.row, &taps.below}) {
        const bool aside = column != &taps.column, up = row != &taps.row;
        if (aside || up) add_tap(y, *row, *column, aside && up ? 2 : up ? 1 : 0, taps);
      }
    finish_blur(width_, blended_.row(y), taps.sum.data(), taps.weights.data(), history.value.row(y),
                history.mean.row(y), history.square.row(y));
  }

private:
  void choose_row_taps(int y, const History& history, TapRow& taps) const {
    start_reach(width_, history.distance.row(y), scale_.ray_length, config_.kernel_scale, taps.reach.data(),
                taps.ratio.data());
    for (uint32_t i = 0; i < config_.kernel_exponent; ++i) multiply_rows(width_, taps.ratio.data(), taps.reach.data());
    const uint32_t cycle = config_.kernel_cycle;
    const float widest = config_.kernel_max_width * static_cast<float>(width_) * 0.5f;
    const StepInput input{surfaces_.z.row(y),
                          derivatives_.x.row(y),
                          derivatives_.y.row(y),
                          deviation_.row(y),
                          blended_.row(y),
                          taps.reach.data(),
                          scale_.pixel_spread,
                          static_cast<float>(scale_.frame % cycle + 1) / static_cast<float>(cycle),
                          std::max(1.0f, std::floor(widest)),
                          config_.blur_value_sigma,
                          config_.blur_value_floor,
                          config_.blur_depth_sigma,
                          config_.depth_epsilon,
                          y,
                          static_cast<int32_t>(surfaces_.size.height),
                          static_cast<int32_t>(surfaces_.z.stride())};
    choose_taps(width_, input,
                {taps.left.data(), taps.right.data(), taps.above.data(), taps.below.data(), taps.value_rate[0].data(),
                 taps.value_rate[1].data(), taps.depth_rate[0].data(), taps.depth_rate[1].data(),
                 taps.depth_rate[2].data()});
  }

  /// @param kind 0: along x, 1: along y, 2: diagonal
  void add_tap(int y, const std::vector<int32_t>& row, const std::vector<int32_t>& column, size_t kind,
               TapRow& taps) const {
    const CompareInput input{surfaces_.z.row(y),
                             surfaces_.normal_x.row(y),
                             surfaces_.normal_y.row(y),
                             surfaces_.normal_z.row(y),
                             blended_.row(y),
                             surfaces_.z.row(0),
                             surfaces_.normal_x.row(0),
                             surfaces_.normal_y.row(0),
                             surfaces_.normal_z.row(0),
                             blended_.row(0),
                             row.data(),
                             column.data(),
                             taps.value_rate[kind == 2 ? 1 : 0].data(),
                             taps.depth_rate[kind].data(),
                             config_.depth_epsilon,
                             -std::log(std::max(1e-30f, config_.blur_depth_cutoff))};
    compare_tap(width_, input, taps.cosine.data(), taps.exponent.data(), taps.value.data());
    for (int i = std::countr_zero(config_.blur_normal_power); i > 0; --i) square_weights(width_, taps.cosine.data());
    const float gaussian = kind == 2 ? kAside * kAside : kAside * kCentre;
    add_weighted_tap(width_, gaussian, taps.cosine.data(), taps.exponent.data(), taps.value.data(), taps.sum.data(),
                     taps.weights.data());
  }

  const Surfaces& surfaces_;
  const Derivatives& derivatives_;
  const Plane<float>& blended_;
  const Plane<float>& deviation_;
  BlurScale scale_;
  const ReferenceConfig& config_;
  int width_;
};

} // namespace

void edge_stopping_blur(const Surfaces& surfaces, const Derivatives& derivatives, const Plane<float>& blended,
                        const Plane<float>& deviation, BlurScale scale, const ReferenceConfig& config,
                        History& history) {
  const EdgeStoppingBlur blur(surfaces, derivatives, blended, deviation, scale, config);
  for_row_blocks(surfaces.size.height, [&](int first, int last) {
    TapRow taps(surfaces.size.width);
    for (int y = first; y < last; ++y) blur.blur_row(y, taps, history);
  });
}

} // namespace packtrace::reference
