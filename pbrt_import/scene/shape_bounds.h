#pragma once

#include <span>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Bounds of shapes in their parent's space, from the bounds of the scene's meshes.
/// @param meshes by mesh, in the mesh's own space
Bounds bounds_of_shapes(std::span<const Shape> shapes, std::span<const Bounds> meshes);

} // namespace packtrace
