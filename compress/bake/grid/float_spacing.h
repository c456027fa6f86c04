#pragma once

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Distance of neighbouring floats at a box's largest coordinate; 0 if it is empty.
double float_spacing(const Bounds& box);

/// Largest float_spacing() of a mesh, in world units where it is stretched most.
double largest_mesh_spacing(const Scene& scene);

} // namespace packtrace
