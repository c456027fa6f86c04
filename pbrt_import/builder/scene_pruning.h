#pragma once

#include <functional>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Calls function(Shape&) for the shapes of the world, then for those of each object.
template <class Function>
void for_each_shape(Scene& scene, Function function) {
  for (Shape& shape : scene.shapes) function(shape);
  for (Object& object : scene.objects)
    for (Shape& shape : object.shapes) function(shape);
}

/// Leaves out objects that nothing shows and objects without shapes, with the instances of the latter; what is left
/// keeps its order.
/// @param unused called with the number of each object that has shapes but no instance
void drop_unused_objects(Scene& scene, const std::function<void(uint32_t object)>& unused);

/// Leaves out meshes and materials that no shape uses, then masks that no material uses, then animations that nothing
/// has.
void drop_unused_parts(Scene& scene);

} // namespace packtrace
