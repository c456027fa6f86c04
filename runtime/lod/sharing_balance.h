#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/lod_geometry.h"

namespace packtrace {

/// Which own cuts and steps of one geometry are built.
struct SharingBalance {
  size_t own_cuts = 0;           ///< number of savings made: their instances get own cuts
  size_t builds = 0;             ///< number of steps built in addition
  uint64_t traced = 0;           ///< triangles, summed over all instances
  std::vector<uint32_t> users;   ///< per step: number of instances
  std::vector<uint32_t> instead; ///< per step: the step that its users take instead
};

/// What an instance would save with its own cut.
struct OwnCutSaving {
  uint64_t triangles = 0;
  uint32_t step = 0; ///< the step that it would use otherwise
  uint32_t slot = 0; ///< the instance's slot; for the caller
};

/// Reduces the number of builds such that at most `limit` triangles are traced. Instances with the largest savings get
/// own cuts. Tries several numbers of own cuts, from the smallest that meets the limit; for each, finds the fewest
/// steps to build, where users of the other steps take the next finer step built. The last step needs no build. If the
/// limit cannot be met, all savings are made and no step is left out.
/// @param users per step
/// @param traced triangles of all instances before balancing
/// @param savings of instances counted in `users`; sorted by triangles, descending, ties by slot
SharingBalance balance_builds(std::span<const LodStep> steps, std::span<const uint32_t> users, uint64_t traced,
                              double limit, std::span<const OwnCutSaving> savings);

} // namespace packtrace
