#pragma once

#include <span>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Moves a world that lies more than 256 of its diagonals from its zero to where floats are fine: everything
/// downstream keeps positions in floats. Scene::origin is where the new zero lies in the world, a multiple of a power
/// of two that is near the diagonal. The shapes of an object that is 4096 of its diagonals from the object's zero are
/// moved there too, and the instances by the opposite, unless they are animated. Transforms must be those of the source
/// in doubles: coordinates of meshes are floats, and what these have lost does not come back. Scenes that lie nearer
/// are not changed.
/// @param rests by instance: transform in doubles minus world_from_object; empty if all are 0
void move_far_world(Scene& scene, std::span<const Affine> rests = {});

} // namespace packtrace
