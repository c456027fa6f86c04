#pragma once

#include <array>
#include <optional>

#include "pbrt_import/scene/camera_rays.h"

namespace packtrace {

/// The handles with which the picked instance is moved along the world's axes: three arrows from its centre, as
/// fractions of the picture, x right and y down.
struct Gizmo {
  glm::dvec2 centre{0.0};
  std::array<std::optional<glm::dvec2>, 3> tips; ///< of x, y and z; none where the camera cannot see it
  double length = 0.0;                           ///< of an arrow, world units
};

/// Returns the handles at a place; none if the camera cannot see it. The longest arrow has about a sixth of the
/// picture's shorter side.
/// @param centre in the camera's world
std::optional<Gizmo> gizmo_at(DVec3 centre, const Camera& camera, ImageSize size);

/// Distance by which an instance moves if its arrow is dragged, in world units along the arrow's axis. 0 for arrows
/// that point at the camera.
/// @param axis 0 to 2
/// @param by fractions of the picture
double dragged_distance(const Gizmo& gizmo, size_t axis, glm::dvec2 by, ImageSize size);

} // namespace packtrace
