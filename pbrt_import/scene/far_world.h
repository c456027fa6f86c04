#pragma once

#include <cstddef>
#include <functional>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Moves a world that lies more than 256 of its diagonals from zero to near zero, where the floats in which later steps
/// keep positions are accurate. Scene::origin is the world position of the new zero, a multiple of a power of two near
/// the diagonal. Likewise moves the shapes of an object that lie more than 4096 of their diagonals from the object's
/// zero, and its instances by the opposite, unless an instance is animated. Other scenes are not changed.
///
/// All transforms must be those of the source in doubles. Coordinates of meshes are floats already, so their rounding
/// errors remain.
/// @param add_residual adds to world_from_object of an instance what its rounding to floats lost; empty: nothing
void move_far_world(Scene& scene, const std::function<void(size_t instance, DAffine& map)>& add_residual = {});

} // namespace packtrace
