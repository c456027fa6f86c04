#pragma once

#include <functional>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Leaves out objects that nothing shows and objects without shapes, with the instances of the latter; what is left
/// keeps its order.
/// @param unused called with the number of each object that has shapes but no instance
void drop_unused_objects(Scene& scene, const std::function<void(uint32_t object)>& unused);

/// Leaves out meshes and materials that no shape uses, then masks that no material uses, then animations that nothing
/// has.
void drop_unused_parts(Scene& scene);

} // namespace packtrace
