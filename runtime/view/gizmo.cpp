#include "runtime/view/gizmo.h"

#include <algorithm>

namespace packtrace {
namespace {

constexpr double kArrow = 1.0 / 6.0; ///< of the picture's shorter side
constexpr double kShortest_px = 4.0; ///< an arrow that can be dragged

DVec3 axis_direction(size_t axis) {
  DVec3 direction(0.0);
  direction[static_cast<int>(axis)] = 1.0;
  return direction;
}

} // namespace

std::optional<Gizmo> gizmo_at(DVec3 centre, const Camera& camera, ImageSize size) {
  const PrimaryCamera view(camera, size);
  const auto middle = view.project(centre);
  if (!middle) return std::nullopt;
  // The arrows of unit directions are measured on a small scale, where perspective does not bend them.
  const double step = 1e-3 * glm::length(centre - DVec3(camera.world_from_camera[3]));
  double longest_px = 0.0;
  for (size_t axis = 0; axis < 3; ++axis)
    if (const auto tip = view.project(centre + step * axis_direction(axis)))
      longest_px = std::max(longest_px, glm::length(tip->pixel - middle->pixel));
  if (!(longest_px > 0.0)) return std::nullopt;
  Gizmo gizmo;
  const glm::dvec2 pixels(size.width, size.height);
  gizmo.centre = middle->pixel / pixels;
  gizmo.length = step * kArrow * std::min(pixels.x, pixels.y) / longest_px;
  for (size_t axis = 0; axis < 3; ++axis)
    if (const auto tip = view.project(centre + gizmo.length * axis_direction(axis)))
      gizmo.tips[axis] = tip->pixel / pixels;
  return gizmo;
}

double dragged_distance(const Gizmo& gizmo, size_t axis, glm::dvec2 by, ImageSize size) {
  if (!gizmo.tips[axis]) return 0.0;
  const glm::dvec2 pixels(size.width, size.height);
  const glm::dvec2 arrow = (*gizmo.tips[axis] - gizmo.centre) * pixels;
  const double length2 = glm::dot(arrow, arrow);
  return length2 < kShortest_px * kShortest_px ? 0.0 : gizmo.length * glm::dot(by * pixels, arrow) / length2;
}

} // namespace packtrace
