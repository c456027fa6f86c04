#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/trees/box_tree.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// Returns a single node over up to eight boxes; child i is kTopLeaf + i.
packed::TopNode top_node(std::span<const TreeBox> boxes);

/// Builds eight-wide trees over placements, fast enough to do so in every frame. Boxes are split by the surface area
/// heuristic over 16 bins; a node's widest children are split until it has eight. Keeps its memory from build to build.
/// Runs on all threads; the result depends only on the boxes. Source: Wald, "On fast construction of SAH-based bounding
/// volume hierarchies" (2007); Wald, Benthin, Boulos, "Getting rid of packets" (2008), section 3.
class TopTreeBuilder {
public:
  /// Replaces `nodes` by a tree over the boxes, root first. A leaf child is kTopLeaf + the number of its box. Returns
  /// its levels of nodes, at most kMaxTopDepth.
  /// @param boxes 2 .. 2^31 - 1 boxes
  uint32_t build(std::span<const TreeBox> boxes, std::vector<packed::TopNode>& nodes);

  uint64_t bytes() const {
    return boxes_.capacity() * sizeof(Box) + scattered_.capacity() * sizeof(packed::TopNode) +
           waiting_.capacity() * sizeof(Waiting);
  }

private:
  using Float4 = float __attribute__((vector_size(16)));

  /// A box in the order of the tree. The fourth components are zero.
  struct Box {
    Float4 lo, hi;
    uint32_t number;
  };
  /// A run of boxes_, and its bounds.
  struct Run {
    uint32_t first, count;
    Float4 lo, hi;
    float area; ///< half the surface area

    static Run empty(uint32_t first);
    void finish();
    void extend(Float4 box_lo, Float4 box_hi);
  };
  struct Waiting {
    uint32_t scattered, parent, slot, level;
  };
  struct Bins;

  void build_node(const Run& run, uint32_t place, uint32_t levels);
  void split(const Run& run, bool by_area, Run& left, Run& right);
  bool split_by_area(const Run& run, Run& left, Run& right);
  void halve(const Run& run, Run& left, Run& right);
  Run bounded(uint32_t first, uint32_t count) const;
  uint32_t gather(std::vector<packed::TopNode>& nodes);

  std::vector<Box> boxes_;
  /// The nodes, with gaps: a subtree over n boxes has room for n - 1 nodes, so that threads need not agree on numbers.
  std::vector<packed::TopNode> scattered_;
  std::vector<Waiting> waiting_;
};

} // namespace packtrace
