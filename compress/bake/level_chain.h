#pragma once

#include <cstdint>
#include <vector>

namespace packtrace {

/// Objects that replace each other by distance from the eye, fine to coarse.
struct LevelChain {
  std::vector<uint32_t> objects; ///< numbers in Scene::objects; 2..baked::kMaxChainLevels
  /// World units, positive, ascending: from the eye to the centre of the box of level 0, where the next level begins.
  std::vector<double> distances;
};

} // namespace packtrace
