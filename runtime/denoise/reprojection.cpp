#include "runtime/denoise/reprojection.h"

#include <bit>
#include <cmath>
#include <limits>

#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

/// History with a smaller total weight is rejected: the tests' soft weights let hardly any of the surface through.
constexpr float kMinHistoryWeight = 1e-3f;

/// Footprints with a smaller total weight cross an edge, where sharpening would overshoot.
constexpr float kMinSharpenWeight = 0.9f;

struct Tests {
  float depth, slope;
  int normal_squarings;
  bool instance;
};

/// The surface at the current pixel, as history must match it.
struct Surface {
  float disparity, tolerance; ///< where the surface was in the previous frame
  Vec3 normal;
  uint32_t instance;
};

/// Pointers to pixel (0, 0) of the previous frame's planes. The offset y * stride + x is valid for all of them.
struct Previous {
  explicit Previous(const FrameHistory& frame)
      : disparity(frame.guides.disparity.row(0)), normal_x(frame.guides.normal_x.row(0)),
        normal_y(frame.guides.normal_y.row(0)), normal_z(frame.guides.normal_z.row(0)),
        instance(frame.guides.instance.row(0)), mean(frame.history.mean.row(0)), square(frame.history.square.row(0)),
        fast(frame.history.fast.row(0)), samples(frame.history.samples.row(0)), stride(frame.history.mean.stride()) {}

  const float *disparity, *normal_x, *normal_y, *normal_z;
  const uint32_t* instance;
  const float *mean, *square, *fast, *samples;
  ptrdiff_t stride;
};

/// Similarity of a previous pixel to the current surface: 0 for another surface, up to 1 for a perfect match.
inline float agreement(const Previous& previous, ptrdiff_t at, const Surface& surface, const Tests& tests) {
  const float disparity = previous.disparity[at];
  if (!(disparity > 0.0f) || (tests.instance && previous.instance[at] != surface.instance)) return 0.0f;
  const float distance = std::abs(disparity - surface.disparity);
  if (!(distance <= 2.0f * surface.tolerance)) return 0.0f;
  const float depth_weight = distance > surface.tolerance ? surface.tolerance / distance : 1.0f;
  const float dot = previous.normal_x[at] * surface.normal.x + previous.normal_y[at] * surface.normal.y +
                    previous.normal_z[at] * surface.normal.z;
  float cosine = smaller(larger(1.1f * dot, 0.0f), 1.0f);
  for (int i = 0; i < tests.normal_squarings; ++i) cosine *= cosine;
  return depth_weight * cosine;
}

/// Whether a previous pixel may be used for sharpening: a hard test of instance and disparity, without normals.
inline bool same_surface(const Previous& previous, ptrdiff_t at, const Surface& surface) {
  return previous.instance[at] == surface.instance && previous.samples[at] > 0.0f &&
         std::abs(previous.disparity[at] - surface.disparity) <= surface.tolerance;
}

/// The difference between Catmull-Rom and linear interpolation between a and b, where before and after are the outer
/// neighbours: -t (1 - t) / 2 times the linearly interpolated second differences at a and b.
/// Source: R. Keys, "Cubic convolution interpolation for digital image processing", 1981, a = -1/2.
inline float sharpening(float before, float a, float b, float after, float t) {
  return -0.5f * t * (1.0f - t) * ((1.0f - t) * (before - 2.0f * a + b) + t * (a - 2.0f * b + after));
}

/// Correction for the blur of bilinear interpolation, which would accumulate over frames. It is exact to second order
/// along both axes. Returns 0 unless the 2 x 2 footprint starting at `at` and its eight edge-adjacent neighbours all
/// lie on the same surface.
float sharpen(const Previous& previous, ptrdiff_t at, float tx, float ty, const Surface& surface) {
  const ptrdiff_t down = previous.stride;
  const ptrdiff_t taps[12] = {0, 1, down, down + 1, -1, down - 1, 2, down + 2, -down, 1 - down, 2 * down, 2 * down + 1};
  for (const ptrdiff_t tap : taps)
    if (!same_surface(previous, at + tap, surface)) return 0.0f;
  const float* m = previous.mean + at;
  const float along_x = (1.0f - ty) * sharpening(m[-1], m[0], m[1], m[2], tx) +
                        ty * sharpening(m[down - 1], m[down], m[down + 1], m[down + 2], tx);
  const float along_y = (1.0f - tx) * sharpening(m[-down], m[0], m[down], m[2 * down], ty) +
                        tx * sharpening(m[1 - down], m[1], m[down + 1], m[2 * down + 1], ty);
  return along_x + along_y;
}

/// Weighted sum of history over a 2 x 2 footprint.
struct Gathered {
  float weight = 0, mean = 0, square = 0, fast = 0, samples = 0;
  float sharpening = 0; // added to the mean after normalisation

  void add(const Previous& previous, ptrdiff_t at, float w) {
    const float count = previous.samples[at];
    if (!(count > 0.0f)) return; // the pixel was visible but never got a sample
    weight += w;
    mean += w * previous.mean[at];
    square += w * previous.square[at];
    fast += w * previous.fast[at];
    samples += w * count;
  }
};

/// The reprojection of one frame.
class Reprojection {
public:
  Reprojection(const FrameHistory& previous, const Guides& guides, const DepthDerivatives& derivatives,
               const FluxConfig& config)
      : previous_(previous), guides_(guides), derivatives_(derivatives),
        tests_{config.reprojection_depth, config.reprojection_slope, std::countr_zero(config.reprojection_normal_power),
               config.reprojection_instance_test},
        width_(static_cast<float>(guides.size.width)), height_(static_cast<float>(guides.size.height)) {}

  /// @param disparity of the pixel's surface in the previous frame, positive
  Gathered gather(int x, int y, Vec2 motion, float disparity) const {
    Gathered sum;
    const float from_x = static_cast<float>(x) - motion.x, from_y = static_cast<float>(y) - motion.y;
    // Rejects NaN, too, and ensures that the conversion to int below cannot overflow.
    if (!(from_x > -1.0f && from_x < width_ && from_y > -1.0f && from_y < height_)) return sum;
    const Surface surface = surface_at(x, y, disparity);
    const float floor_x = std::floor(from_x), floor_y = std::floor(from_y);
    const float fx = from_x - floor_x, fy = from_y - floor_y;
    const ptrdiff_t at = static_cast<int>(floor_y) * previous_.stride + static_cast<int>(floor_x);
    const auto corner = [&](ptrdiff_t tap, float bilinear) { // border pixels have disparity 0, so they are rejected
      if (!(bilinear > 0.0f)) return;
      const float w = bilinear * agreement(previous_, tap, surface, tests_);
      if (w > 0.0f) sum.add(previous_, tap, w);
    };
    corner(at, (1.0f - fx) * (1.0f - fy));
    corner(at + 1, fx * (1.0f - fy));
    corner(at + previous_.stride, (1.0f - fx) * fy);
    corner(at + previous_.stride + 1, fx * fy);
    if (sum.weight > kMinSharpenWeight && (fx > 0.0f || fy > 0.0f))
      sum.sharpening = sharpen(previous_, at, fx, fy, surface);
    return sum;
  }

private:
  Surface surface_at(int x, int y, float disparity) const {
    const float now = guides_.disparity.row(y)[x];
    float slope = std::abs(derivatives_.x.row(y)[x]) + std::abs(derivatives_.y.row(y)[x]);
    if (disparity != now) slope *= disparity / now;
    return {disparity, tests_.depth * disparity + tests_.slope * slope + std::numeric_limits<float>::min(),
            Vec3(guides_.normal_x.row(y)[x], guides_.normal_y.row(y)[x], guides_.normal_z.row(y)[x]),
            guides_.instance.row(y)[x]};
  }

  Previous previous_;
  const Guides& guides_;
  const DepthDerivatives& derivatives_;
  Tests tests_;
  float width_, height_;
};

void store(const Gathered& sum, float longest, History& history, int x, int y) {
  const bool found = sum.weight > kMinHistoryWeight;
  const float scale = found ? 1.0f / sum.weight : 0.0f;
  const float linear = sum.mean * scale;
  const float sharp = found ? smaller(larger(linear + sum.sharpening, 0.0f), 1.0f) : 0.0f;
  history.mean.row(y)[x] = sharp;
  history.square.row(y)[x] = sum.square * scale + (sharp - linear) * (sharp + linear); // keeps the variance
  history.fast.row(y)[x] = sum.fast * scale;
  history.samples.row(y)[x] = found ? smaller(sum.samples, longest) : 0.0f;
}

} // namespace

void reproject(const FrameHistory& previous, const Guides& guides, const DepthDerivatives& derivatives,
               std::span<const Vec2> motion_px, std::span<const float> previous_z, const FluxConfig& config,
               History& reprojected) {
  const Reprojection reprojection(previous, guides, derivatives, config);
  const float longest_still = static_cast<float>(config.max_tspp);
  const float longest_moving = static_cast<float>(std::min(config.max_tspp, config.max_tspp_moving));
  for_row_blocks(guides.size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const size_t begin = static_cast<size_t>(y) * guides.size.width;
      const Vec2* motion = &motion_px[begin];
      const float* z = previous_z.empty() ? nullptr : &previous_z[begin];
      for (int x = 0; x < static_cast<int>(guides.size.width); ++x) {
        const bool still = std::abs(motion[x].x) <= kStillMotion && std::abs(motion[x].y) <= kStillMotion;
        Gathered sum;
        const float now = guides.disparity.row(y)[x];
        const float before = z != nullptr && now > 0.0f ? disparity_of(z[x]) : now;
        if (before > 0.0f) sum = reprojection.gather(x, y, still ? Vec2(0) : motion[x], before);
        store(sum, still ? longest_still : longest_moving, reprojected, x, y);
      }
    }
  });
}

} // namespace packtrace
