#pragma once

#include <vector>

#include "pbrt_import/scene/shading.h"

namespace packtrace {

/// A direction with its density over solid angle.
struct SampledDirection {
  Vec3 direction{0.0f}; ///< unit length
  float density = 0.0f; ///< 0: no direction
};

/// An environment map with a distribution of directions that follows its luminance.
class Environment {
public:
  /// @param map must outlive this object
  explicit Environment(const EnvironmentMap& map);

  /// Radiance from a direction in light space, bilinear.
  Vec3 radiance(Vec3 direction) const;

  /// A direction in light space, from a point of the unit square.
  SampledDirection sample(Vec2 point) const;
  float density(Vec3 direction) const;

  /// Mean radiance over all directions.
  Vec3 mean() const { return mean_; }

private:
  Vec3 pixel(int64_t x, int64_t y) const;

  const EnvironmentMap& map_;
  std::vector<float> cumulative_; ///< by pixel: share of its row that lies before the pixel's end
  std::vector<float> rows_;       ///< by row: share of all that lies before the row's end
  std::vector<float> row_share_;  ///< by row
  Vec3 mean_{0.0f};
};

} // namespace packtrace
