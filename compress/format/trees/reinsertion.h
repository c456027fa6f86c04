#pragma once

#include <cstdint>

#include "compress/format/trees/box_tree.h"

namespace packtrace {

/// Work that reinsert_subtrees() does at most.
struct ReinsertionConfig {
  uint32_t passes = 4;         ///< over the largest subtrees; fewer where one changes nothing
  uint32_t subtrees = 1 << 14; ///< of a pass: those with the largest boxes
  uint32_t search = 256;       ///< places that are looked at for one of them
};

/// Takes subtrees out and puts each in where the sum of the inner nodes' areas becomes the least, the largest first, so
/// that boxes of very different size come to lie at levels of their own, which no split of all boxes does: boxes that
/// lie one in the other become a chain, as deep as there are boxes. On the calling thread; time O(n), and for each
/// place that a subtree is moved to, the levels above it whose boxes change. Source: Bittner, Hapala, Havran, "Fast
/// insertion-based optimization of bounding volume hierarchies" (2013); the search is that of Meister, Bittner,
/// "Parallel reinsertion for bounding volume hierarchy optimization" (2018).
void reinsert_subtrees(BoxTree& tree, const ReinsertionConfig& config = {});

} // namespace packtrace
