#pragma once

#include <functional>
#include <vector>

#include "pbrt_import/builder/instance_residuals.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Calls function(Shape&) for the shapes of the world, then for those of each object.
template <class Function>
void for_each_shape(Scene& scene, Function function) {
  for (Shape& shape : scene.shapes) function(shape);
  for (Object& object : scene.objects)
    for (Shape& shape : object.shapes) function(shape);
}

/// New number of what was dropped.
inline constexpr uint32_t kDropped = ~0u;

/// Drops objects without instances, and objects without shapes together with their instances. The rest keeps its order.
/// @param residuals updated with the instances
/// @param keep_unplaced keep objects that have shapes but no instance
/// @return by old number of an instance: its new one, or kDropped; empty if nothing was dropped
/// @param unused called with the index of each object that has shapes but no instance
std::vector<uint32_t> drop_unused_objects(Scene& scene, InstanceResiduals& residuals, bool keep_unplaced,
                                          const std::function<void(uint32_t object)>& unused);

/// Drops meshes and materials that no shape uses, then masks and textures that no material uses, then unused
/// animations.
/// @return the new number of each mesh, or kDropped
std::vector<uint32_t> drop_unused_parts(Scene& scene);

} // namespace packtrace
