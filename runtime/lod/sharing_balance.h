#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/lod_geometry.h"

namespace packtrace {

/// Who builds what of one geometry.
struct SharingBalance {
  size_t own_cuts = 0;           ///< so many of the savings are made: their instances have cuts of their own
  size_t builds = 0;             ///< of steps, on top of that
  uint64_t traced = 0;           ///< triangles over all instances
  std::vector<uint32_t> users;   ///< by step: instances
  std::vector<uint32_t> instead; ///< by step: the one its users take
};

/// What an instance would save by a cut of its own.
struct OwnCutSaving {
  uint64_t triangles = 0;
  uint32_t step = 0; ///< that it would use else
  uint32_t slot = 0; ///< whose it is; for the caller
};

/// Few builds such that no more than `limit` triangles are traced. Own cuts go to those that save most. For some
/// numbers of them, from the least that the limit asks for, it finds the fewest steps to build: users of the others
/// take the next finer one that is built. The last step needs no build.
/// @param users by step @param traced triangles of all instances as they are
/// @param savings of instances counted in `users`; sorted: largest first, ties by slot
/// If the limit cannot be met, all savings are made and no step is left out.
SharingBalance balance_builds(std::span<const LodStep> steps, std::span<const uint32_t> users, uint64_t traced,
                              double limit, std::span<const OwnCutSaving> savings);

} // namespace packtrace
