#include "pbrt_import/scene/world_view.h"

#include <array>
#include <cmath>

namespace packtrace {
namespace {

/// How well an axis explains a camera as upright, in [0, 1].
double upright_score(const glm::dmat3& camera_axes, DVec3 axis) {
  constexpr double kMaxRoll = 0.0175; // tangent of a degree
  constexpr double kRolledWeight = 0.01, kUpwardsWeight = 0.5;
  const double up = glm::dot(axis, camera_axes[1]), right = glm::dot(axis, camera_axes[0]);
  if (!(up > 0.0)) return 0.0;
  const double roll = std::abs(right) <= kMaxRoll * up ? 1.0 : kRolledWeight;
  const double elevation = glm::dot(axis, camera_axes[2]) > 1e-9 ? kUpwardsWeight : 1.0;
  return up * roll * elevation;
}

} // namespace

WorldView estimate_world_view(std::span<const Camera> cameras) {
  constexpr std::array<DVec3, 6> kAxes{DVec3(0, 1, 0),  DVec3(0, 0, 1),  DVec3(1, 0, 0),
                                       DVec3(0, -1, 0), DVec3(0, 0, -1), DVec3(-1, 0, 0)};
  std::array<double, 6> scores{};
  size_t counted = 0, mirrored = 0;
  for (const Camera& camera : cameras) {
    glm::dmat3 axes(camera.world_from_camera);
    for (int i = 0; i < 3; ++i) axes[i] = glm::normalize(axes[i]);
    const double handedness = glm::determinant(axes);
    if (!std::isfinite(handedness) || handedness == 0.0) continue;
    ++counted, mirrored += handedness < 0.0;
    for (size_t i = 0; i < kAxes.size(); ++i) scores[i] += upright_score(axes, kAxes[i]);
  }
  size_t best = 0;
  for (size_t i = 1; i < kAxes.size(); ++i)
    if (scores[i] > scores[best] * (1.0 + 1e-9)) best = i;
  return {kAxes[best], 2 * mirrored > counted};
}

} // namespace packtrace
