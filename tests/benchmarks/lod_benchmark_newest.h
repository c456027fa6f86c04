#pragma once

#include <filesystem>

#include "tests/benchmarks/lod_benchmark_simplifiers.h"

namespace packtrace {

/// Simplifies with meshopt_simplifyWithUpdate() of the npm package meshoptimizer, run by Node.js. Leaves `seconds` at
/// 0, as WebAssembly does not compare with native code. Throws Error if that fails.
/// @param package its folder, node_modules/meshoptimizer
SimplifierResult simplify_with_newest_meshoptimizer(const BareMesh& mesh, uint32_t target_triangles,
                                                    const std::filesystem::path& package);

} // namespace packtrace
