#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/layout/packed_node.h"

namespace packtrace::test {

/// A box of exact tree coordinates.
struct ExactBox {
  std::array<double, 3> lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
  void extend(const ExactBox& other) {
    for (size_t axis = 0; axis < 3; ++axis)
      lo[axis] = std::min(lo[axis], other.lo[axis]), hi[axis] = std::max(hi[axis], other.hi[axis]);
  }
};

/// Walks a tree, checks the guarantees of packed_node.h, and counts the leaves that hold each triangle.
class TreeWalk {
public:
  /// @param looseness maximum excess of a node's boxes over their contents, in steps of the node's boxes
  TreeWalk(const BakedFile& file, const baked::TreeRecord& tree, std::span<const baked::PackedNode> all,
           double looseness = 1.0)
      : file_(file), tree_(tree), looseness_(looseness),
        nodes_(all.subspan(static_cast<size_t>(tree.first_node), tree.node_count)) {
    for (uint32_t g = 0; g < file.geometries().size(); ++g)
      for (uint32_t c = 0; c < file.clusters(g).size(); ++c) geometry_of_.push_back(g);
    seen_.resize(file.sections().clusters.size());
    for (size_t c = 0; c < seen_.size(); ++c) seen_[c].resize(file.sections().clusters[c].triangle_count);
    if (!nodes_.empty()) walk(0, 1);
    EXPECT_EQ(visited_, tree.node_count);
    EXPECT_EQ(deepest_, tree.depth);
  }
  /// By cluster of the file, then by triangle: number of leaves that hold it.
  const std::vector<std::vector<uint32_t>>& seen() const { return seen_; }

private:
  ExactBox walk(uint32_t number, uint32_t level) {
    ++visited_;
    deepest_ = std::max(deepest_, level);
    const baked::PackedNode& node = nodes_[number];
    uint32_t next_child = node.first_child, next_triangle = node.first_triangle, classes = 0;
    ExactBox whole;
    for (uint32_t slot = 0; slot < baked::kNodeWidth; ++slot) {
      if (node.children[slot] == baked::kNoChild) {
        EXPECT_EQ(std::pair(node.lo[0][slot], node.hi[0][slot]), std::pair(uint8_t{255}, uint8_t{0}));
        continue;
      }
      ExactBox box;
      if (node.children[slot] == baked::kInnerChild) {
        EXPECT_GT(next_child, number);
        classes |= nodes_[next_child].ray_classes;
        box = walk(next_child++, level + 1);
      } else {
        box = leaf_box(node.cluster, next_triangle, node.children[slot]);
        next_triangle += node.children[slot];
      }
      for (size_t axis = 0; axis < 3; ++axis) {
        const double unit = std::ldexp(1.0, static_cast<int>(node.exponent(static_cast<uint32_t>(axis))));
        const double lo = node.origin[axis] + node.lo[axis][slot] * unit,
                     hi = node.origin[axis] + node.hi[axis][slot] * unit;
        EXPECT_LE(lo, box.lo[axis]);
        EXPECT_GE(hi, box.hi[axis]);
        EXPECT_GT(lo + looseness_ * unit, std::floor(box.lo[axis])) << "no looser than rounding makes it";
        EXPECT_LT(hi - looseness_ * unit, std::ceil(box.hi[axis]));
      }
      whole.extend(box);
    }
    if (!node.has_leaves()) {
      EXPECT_EQ(node.ray_classes, classes & 3u);
    }
    return whole;
  }

  ExactBox leaf_box(uint32_t cluster, uint32_t first, uint32_t count) {
    const uint32_t g = geometry_of_[cluster];
    const baked::GeometryRecord& geometry = file_.geometries()[g];
    const ClusterView view = file_.cluster(g, cluster - static_cast<uint32_t>(geometry.first_cluster));
    ExactBox box;
    for (uint32_t t = first; t < first + count; ++t) {
      ++seen_[cluster].at(t);
      for (int corner = 0; corner < 3; ++corner) {
        const LatticePoint q = view.lattice(view.triangle(t)[corner]);
        ExactBox point;
        for (size_t axis = 0; axis < 3; ++axis)
          point.lo[axis] = point.hi[axis] =
              std::ldexp(static_cast<double>(q[axis]), geometry.step_exponent - tree_.step_exponent) -
              static_cast<double>(tree_.origin[axis]);
        box.extend(point);
      }
    }
    return box;
  }

  const BakedFile& file_;
  const baked::TreeRecord& tree_;
  const double looseness_;
  std::span<const baked::PackedNode> nodes_;
  std::vector<uint32_t> geometry_of_; // by cluster
  std::vector<std::vector<uint32_t>> seen_;
  uint32_t visited_ = 0, deepest_ = 0;
};

} // namespace packtrace::test
