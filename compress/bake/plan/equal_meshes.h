#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// For each mesh the first mesh with equal content: the same bytes in the same order, whatever the name. Found by hash
/// and verified.
std::vector<uint32_t> first_equal_meshes(const Scene& scene);

} // namespace packtrace
