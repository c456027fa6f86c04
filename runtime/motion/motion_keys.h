#pragma once

#include <filesystem>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/motion/motion_targets.h"

namespace packtrace {

/// Reads a file of keys (docs/motion.md) for a scene or file. Each instance it names moves relative to its placement.
/// Throws Error(kInput), "file:line:column: problem", for what is not JSON of that form: unknown fields, names without
/// an instance, no keys, times that do not ascend, turns and scales that cannot be interpolated, values out of range.
/// Throws MemoryError.
RigidMotion read_motion_keys(const std::filesystem::path& file, const MotionTargets& targets,
                             const MemoryBudget& budget = MemoryBudget());

} // namespace packtrace
