#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/gltf/gltf_materials.h"
#include "pbrt_import/gltf/gltf_pose.h"

namespace packtrace::gltf {

/// Adds a primitive as a triangle mesh of its material: triangles, strips or fans, with or without indices, compressed
/// by Draco or not, deformed by morph targets and a skin. Points and lines are left out with a warning.
/// Throws Error(kInput) if it is malformed; MemoryError.
void add_gltf_primitive(Document& document, const Materials& materials, const Value& mesh, const Value& primitive,
                        const Pose& pose);

/// Mantissa and exponent of the position lattice in the `packtrace_lattice` extra of the mesh or, without one, of the
/// asset. None if neither has the extra. Throws Error(kInput) if it is malformed.
std::optional<std::vector<int32_t>> stated_lattice(Document& document, const Value& mesh);

} // namespace packtrace::gltf
