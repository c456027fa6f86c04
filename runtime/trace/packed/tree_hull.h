#pragma once

#include <vector>

#include "compress/bvh/box_tree.h"
#include "compress/format/packed_node.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The boxes of a tree's topmost nodes: where it lies, more closely than its root's box does.
class TreeHull {
public:
  /// @param nodes of one tree, root first
  explicit TreeHull(const baked::PackedNode* nodes);

  /// The box of all of them, in the tree's grid.
  const DVec3& lo() const { return lo_; }
  const DVec3& hi() const { return hi_; }

  /// Around all of them, in unit space, a little larger than what rays may hit.
  TreeBox placed(const DAffine& unit_from_grid) const;

private:
  DVec3 lo_, hi_;
  std::vector<double> centre_[3], half_[3]; ///< by axis
};

} // namespace packtrace
