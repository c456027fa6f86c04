#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Returns, for each mesh, the first mesh with equal content: the same bytes in the same order; names may differ.
/// Candidates are found by hash and compared byte by byte.
std::vector<uint32_t> first_equal_meshes(const Scene& scene);

} // namespace packtrace
