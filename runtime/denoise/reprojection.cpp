#include "runtime/denoise/reprojection.h"

#include <bit>
#include <cmath>

namespace packtrace {
namespace {

/// History with less weight than this is noise of the tests, not a surface.
constexpr float kLeastWeight = 1e-3f;

/// Footprints with less weight cross an edge that sharpening would overshoot at.
constexpr float kSharpenWeight = 0.9f;

struct Tests {
  float depth, slope;
  int normal_squarings;
  bool instance;
};

/// What the history of one pixel must agree with.
struct Surface {
  float disparity, tolerance;
  Vec3 normal;
  uint32_t instance;
};

/// 0 if the previous pixel shows another surface, up to 1 if it agrees.
float agreement(const Guides& previous, int x, int y, const Surface& surface, const Tests& tests) {
  const float disparity = previous.disparity.row(y)[x];
  if (!(disparity > 0.0f) || (tests.instance && previous.instance.row(y)[x] != surface.instance)) return 0.0f;
  const float depth_weight = surface.tolerance / std::max(std::abs(disparity - surface.disparity), surface.tolerance);
  if (!(depth_weight >= 0.5f)) return 0.0f;
  const Vec3 normal(previous.normal_x.row(y)[x], previous.normal_y.row(y)[x], previous.normal_z.row(y)[x]);
  float cosine = std::clamp(1.1f * glm::dot(normal, surface.normal), 0.0f, 1.0f);
  for (int i = 0; i < tests.normal_squarings; ++i) cosine *= cosine;
  return depth_weight * cosine;
}

/// Whether a pixel may take part in sharpening: the tests without weights, and without the normals.
bool same_surface(const FrameHistory& previous, int x, int y, const Surface& surface) {
  return previous.guides.instance.row(y)[x] == surface.instance && previous.history.samples.row(y)[x] > 0.0f &&
         std::abs(previous.guides.disparity.row(y)[x] - surface.disparity) <= surface.tolerance;
}

/// What Catmull-Rom interpolation along x or y adds to linear interpolation between a and b, the first of two equally
/// spaced neighbours before and after: -t (1 - t) / 2 times the second differences at a and b, interpolated.
/// Source: R. Keys, "Cubic convolution interpolation for digital image processing", 1981, a = -1/2.
inline float sharpening(float before, float a, float b, float after, float t) {
  return -0.5f * t * (1.0f - t) * ((1.0f - t) * (before - 2.0f * a + b) + t * (a - 2.0f * b + after));
}

/// Linear interpolation of every frame's history is a blur that adds up. This undoes it to second order along both axes
/// where the 2 x 2 footprint at (x, y) and the eight pixels around it without the corners show one surface; else 0.
float sharpen(const FrameHistory& previous, int x, int y, float tx, float ty, const Surface& surface) {
  for (int i = 0; i < 2; ++i) {
    if (!same_surface(previous, x - 1, y + i, surface) || !same_surface(previous, x + 2, y + i, surface) ||
        !same_surface(previous, x + i, y - 1, surface) || !same_surface(previous, x + i, y + 2, surface) ||
        !same_surface(previous, x, y + i, surface) || !same_surface(previous, x + 1, y + i, surface))
      return 0.0f;
  }
  const auto m = [&](int dx, int dy) { return previous.history.mean.row(y + dy)[x + dx]; };
  const float along_x = (1.0f - ty) * sharpening(m(-1, 0), m(0, 0), m(1, 0), m(2, 0), tx) +
                        ty * sharpening(m(-1, 1), m(0, 1), m(1, 1), m(2, 1), tx);
  const float along_y = (1.0f - tx) * sharpening(m(0, -1), m(0, 0), m(0, 1), m(0, 2), ty) +
                        tx * sharpening(m(1, -1), m(1, 0), m(1, 1), m(1, 2), ty);
  return along_x + along_y;
}

/// Weighted sum of history over a 2 x 2 footprint.
struct Gathered {
  float weight = 0, mean = 0, square = 0, fast = 0, samples = 0;
  float sharpening = 0; // to be added to the mean

  void add(const History& history, int x, int y, float w) {
    const float count = history.samples.row(y)[x];
    if (!(count > 0.0f)) return; // seen before, but never sampled
    weight += w;
    mean += w * history.mean.row(y)[x];
    square += w * history.square.row(y)[x];
    fast += w * history.fast.row(y)[x];
    samples += w * count;
  }

  void store(History& history, int x, int y, float longest) const {
    const bool found = weight > kLeastWeight;
    const float scale = found ? 1.0f / weight : 0.0f;
    const float linear = mean * scale;
    const float sharp = found ? std::clamp(linear + sharpening, 0.0f, 1.0f) : 0.0f;
    history.mean.row(y)[x] = sharp;
    history.square.row(y)[x] = square * scale + (sharp - linear) * (sharp + linear); // the variance stays
    history.fast.row(y)[x] = fast * scale;
    history.samples.row(y)[x] = found ? std::min(samples, longest) : 0.0f;
  }
};

} // namespace

void reproject(const FrameHistory& previous, const Guides& guides, const DepthDerivatives& derivatives,
               std::span<const Vec2> motion_px, const DenoiserConfig& config, History& reprojected) {
  const int width = static_cast<int>(guides.size.width), height = static_cast<int>(guides.size.height);
  const Tests tests{config.reprojection_depth, config.reprojection_slope,
                    std::countr_zero(config.reprojection_normal_power), config.reprojection_instance_test};
  const float longest_still = static_cast<float>(config.max_tspp);
  const float longest_moving = static_cast<float>(std::min(config.max_tspp, config.max_tspp_moving));

  const auto gather = [&](int x, int y, Vec2 motion) {
    Gathered sum;
    const float from_x = static_cast<float>(x) - motion.x, from_y = static_cast<float>(y) - motion.y;
    // Also false for NaN, and what passes fits an int.
    if (!(from_x > -1.0f && from_x < static_cast<float>(width) && from_y > -1.0f &&
          from_y < static_cast<float>(height)))
      return sum;
    const Surface surface{guides.disparity.row(y)[x],
                          tests.depth * guides.disparity.row(y)[x] +
                              tests.slope * (std::abs(derivatives.x.row(y)[x]) + std::abs(derivatives.y.row(y)[x])) +
                              1e-37f,
                          Vec3(guides.normal_x.row(y)[x], guides.normal_y.row(y)[x], guides.normal_z.row(y)[x]),
                          guides.instance.row(y)[x]};
    const float floor_x = std::floor(from_x), floor_y = std::floor(from_y);
    const float fx = from_x - floor_x, fy = from_y - floor_y;
    for (int corner = 0; corner < 4; ++corner) {
      const int right = corner & 1, down = corner >> 1;
      const float bilinear = (right ? fx : 1.0f - fx) * (down ? fy : 1.0f - fy);
      if (!(bilinear > 0.0f)) continue;
      const int px = static_cast<int>(floor_x) + right, py = static_cast<int>(floor_y) + down;
      const float w = bilinear * agreement(previous.guides, px, py, surface, tests); // the border counts as missed
      if (w > 0.0f) sum.add(previous.history, px, py, w);
    }
    if (sum.weight > kSharpenWeight && (fx > 0.0f || fy > 0.0f))
      sum.sharpening = sharpen(previous, static_cast<int>(floor_x), static_cast<int>(floor_y), fx, fy, surface);
    return sum;
  };

  for_row_blocks(guides.size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const Vec2* motion = &motion_px[static_cast<size_t>(y) * guides.size.width];
      for (int x = 0; x < width; ++x) {
        const bool still = std::abs(motion[x].x) <= kStillMotion && std::abs(motion[x].y) <= kStillMotion;
        Gathered sum;
        if (guides.disparity.row(y)[x] > 0.0f) sum = gather(x, y, still ? Vec2(0) : motion[x]);
        sum.store(reprojected, x, y, still ? longest_still : longest_moving);
      }
    }
  });
}

} // namespace packtrace
