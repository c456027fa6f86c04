#include "runtime/denoise/reprojection.h"

#include <bit>
#include <cmath>

namespace packtrace {
namespace {

/// History with less weight than this is noise of the tests, not a surface.
constexpr float kLeastWeight = 1e-3f;

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

/// Weighted sum of history over a 2 x 2 footprint.
struct Gathered {
  float weight = 0, mean = 0, square = 0, fast = 0, samples = 0;

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
    history.mean.row(y)[x] = mean * scale;
    history.square.row(y)[x] = square * scale;
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
