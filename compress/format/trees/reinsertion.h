#pragma once

#include <cstdint>

#include "compress/format/trees/box_tree.h"

namespace packtrace {

/// Limits of the work of reinsert_subtrees().
struct ReinsertionConfig {
  uint32_t passes = 4;         ///< stops earlier if a pass moves nothing
  uint32_t subtrees = 1 << 14; ///< per pass: the subtrees with the largest boxes
  uint32_t search = 256;       ///< maximum number of nodes visited to find a place for one subtree
};

/// Optimises a tree by reinsertion: removes subtrees, largest first, and inserts each where the sum of the areas of
/// inner nodes becomes least. Boxes of very different size thereby move to separate levels, which top-down splits
/// do not achieve. Nested boxes become a chain as deep as the number of boxes. Runs on the calling thread. Takes O(n)
/// time, plus for each move the levels above whose boxes change.
/// Source: Bittner, Hapala, Havran, "Fast insertion-based optimization of bounding volume hierarchies" (2013); the
/// search is from Meister, Bittner, "Parallel reinsertion for bounding volume hierarchy optimization" (2018).
void reinsert_subtrees(BoxTree& tree, const ReinsertionConfig& config = {});

} // namespace packtrace
