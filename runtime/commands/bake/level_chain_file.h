#pragma once

#include <filesystem>
#include <vector>

#include "compress/bake/level_chain.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Reads the levels by distance of a scene's objects: {"chains": [{"objects": [NAME, ...], "distances": [D, ...]}]}
/// (docs/deformation.md). Memory is reserved in proportion to the file's size.
/// Throws Error(kInput) with file:line:column for unknown fields and names, chains of less than two or more than
/// baked::kMaxChainLevels objects, distances that are not positive, finite, ascending and one less than the objects,
/// and objects that are given twice.
std::vector<LevelChain> read_level_chains(const std::filesystem::path& file, const Scene& scene,
                                          const MemoryBudget& budget);

} // namespace packtrace
