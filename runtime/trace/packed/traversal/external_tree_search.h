#pragma once

#include "runtime/trace/packed/kernels/leaf_tests.h"
#include "runtime/trace/packed/kernels/node_children.h"

/// Traces rays through a placed tree whose leaf nodes are found by KernelScene::search_tree, without its inner nodes.
namespace packtrace::packed {
namespace {

/// @tparam Traversal the GroupTraversal that tests the leaves
template <typename Traversal>
struct ExternalTreeSearch {
  using Lanes = typename Traversal::Kernel;

  /// See GroupTraversal::trace_tree().
  static void run(Traversal& self, uint32_t placement, const baked::PackedNode* nodes, RayGroup& group, uint64_t rays,
                  uint32_t octant) {
    const KernelScene& scene = self.scene_;
    ExternalTreeSearch state{&self, nodes, &group, placement, octant};
    TreeSearch search;
    search.tree = scene.placements[placement].tree;
    search.any = Traversal::kAnyHit ? 1 : 0;
    search.count = 0;
    search.limits = group.limits;
    search.traversal = &state;
    search.visit = visit_leaf_nodes;
    for (uint64_t m = rays & self.alive_; m != 0; m &= m - 1) {
      const uint32_t i = first_bit(m);
      KernelRay& ray = search.rays[search.count];
      search.number[search.count++] = i;
      for (uint32_t axis = 0; axis < 3; ++axis)
        ray.origin[axis] = group.origin[axis][i], ray.direction[axis] = 1.0f / within_limit(group.inverse[axis][i]);
      // tnear may be negative if the origin was moved. Embree needs tnear >= 0, and there is nothing to hit before a
      // moved origin.
      ray.tnear = group.limits[i][0] > 0.0f ? group.limits[i][0] : 0.0f;
      ray.tfar = group.tmax(i);
    }
    scene.search_tree(scene.searcher, search);
  }

  Traversal* self;
  const baked::PackedNode* nodes;
  RayGroup* group;
  uint32_t placement, octant;

private:
  /// Embree treats direction components below 1e-18 as 0. Components are therefore at least 2^-40 here, which moves a
  /// ray by at most 6 M 2^-40; the pad of Embree's boxes covers that.
  static float within_limit(float inverse) {
    constexpr float kMax = 0x1p40f;
    return inverse > kMax ? kMax : inverse < -kMax ? -kMax : inverse;
  }

  static uint64_t visit_leaf_nodes(const TreeSearch& search, const uint32_t* nodes, uint32_t node_count,
                                   uint64_t rays) {
    const ExternalTreeSearch& at = *static_cast<const ExternalTreeSearch*>(search.traversal);
    Traversal& self = *at.self;
    for (uint32_t i = 0; i < node_count && (rays &= self.alive_) != 0; ++i) {
      const baked::PackedNode& node = at.nodes[nodes[i]];
      self.count_node(rays);
      typename Lanes::Boxes boxes(node, at.octant);
      if (self.graded_) enlarge_boxes(node, at.octant, boxes);
      self.trace_leaves(at.placement, node, NodeChildren(node), boxes, *at.group, rays);
    }
    return rays & self.alive_;
  }
};

} // namespace
} // namespace packtrace::packed
