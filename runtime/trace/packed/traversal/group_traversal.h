#pragma once

#include "runtime/trace/packed/kernels/beam.h"
#include "runtime/trace/packed/kernels/enter_run.h"
#include "runtime/trace/packed/kernels/group_bounds.h"
#include "runtime/trace/packed/kernels/node_children.h"
#include "runtime/trace/packed/kernels/prefetch.h"
#include "runtime/trace/packed/kernels/unit_beam.h"
#include "runtime/trace/packed/traversal/child_tests.h"
#include "runtime/trace/packed/traversal/external_tree_search.h"
#include "runtime/trace/packed/traversal/leaf_tracer.h"

/// Traces groups of rays through the tree over placements and through placed trees. A group visits a node together, as
/// a 64-bit mask of rays, and the node test yields a mask per child of the rays that hit its box. A node is read and
/// unpacked once per group, and no ray's test waits for the result of another. Source of the idea: Barringer,
/// Akenine-Moeller, "Dynamic ray stream traversal" (2014).
namespace packtrace::packed {
namespace {

/// Number of bytes of a cluster's bits to prefetch: most of the 400 to 500 of a cluster without normals.
constexpr size_t kPrefetchedBytes = 448;

/// Finds any hits (kAny) or nearest hits of one ray class in one scene, on one thread, group by group.
template <typename Lanes, bool kAny, bool kCount>
class GroupTraversal : LeafTracer<Lanes, kAny, kCount> {
  using Leaves = LeafTracer<Lanes, kAny, kCount>;
  using Leaves::fine_grid_, Leaves::trace_leaf;
  using Leaves::numbers_, Leaves::hits_, Leaves::run_hits_, Leaves::is_run_, Leaves::exact_differences_;
  using Leaves::scene_, Leaves::counters_, Leaves::ray_class_, Leaves::alive_, Leaves::nearer_, Leaves::unit_;

public:
  using Kernel = Lanes;
  static constexpr bool kAnyHit = kAny;

  /// @param hits for nearest hits: one per ray, with placement ~0 where there is no hit yet. Records of rays that are
  /// traced by trace_run() are only written.
  GroupTraversal(const KernelScene& scene, BatchCache& cache, const KernelRay* rays, uint32_t ray_class,
                 KernelHit* hits, KernelCounters* counters)
      : Leaves(scene, cache, ray_class, hits, counters), rays_(rays) {}

  /// Makes the given rays the current group.
  /// @param numbers indices of 1 to kGroup rays; must stay valid while the group is traced
  void take(const uint32_t* numbers, uint32_t count) {
    numbers_ = numbers, is_run_ = has_beam_ = false;
    alive_ = ~uint64_t{0} >> (kGroup - count);
    for (uint32_t first = 0; first < count; first += kBlock) {
      uint32_t block[kBlock];
      for (uint32_t i = 0; i < kBlock; ++i) block[i] = numbers[first + i < count ? first + i : 0];
      read_rays(rays_, block, first, unit_);
    }
    if constexpr (!kAny) unit_.one_origin = start_at_one_place(unit_, count);
  }

  /// Makes kGroup rays that follow each other the current group and traces them. Returns false, and traces nothing,
  /// unless they are camera rays of one octant.
  /// @param first index of the first ray
  bool trace_run(uint32_t first) {
    const KernelRay& a = rays_[first];
    // With the first ray, the corners of the four blocks of 4 x 4 pixels.
    for (const uint32_t other : {12u, 51u, kGroup - 1}) {
      const KernelRay& b = rays_[first + other];
      for (uint32_t axis = 0; axis < 3; ++axis)
        if (b.origin[axis] != a.origin[axis] ||
            __builtin_signbit(b.direction[axis]) != __builtin_signbit(a.direction[axis]))
          return false;
    }
    if (!read_run(&a, hits_ + first, unit_)) return false;
    unit_.one_origin = is_run_ = true;
    alive_ = ~uint64_t{0};
    run_hits_.clear();
    has_beam_ = make_unit_beam(unit_, scene_.top_max_coordinate, beam_);
    trace();
    run_hits_.write(unit_.tmax, hits_ + first);
    return true;
  }

  /// Does the same as take(), and keeps the hits found so far: each ray ends at its nearest hit.
  void take_with_hits(const uint32_t* numbers, uint32_t count) {
    take(numbers, count);
    if constexpr (!kAny)
      for (uint32_t i = 0; i < count; ++i)
        if (const KernelHit& hit = hits_[numbers[i]]; hit.placement != ~0u) unit_.tmax[i] = hit.t;
  }

  /// Traces the current group through the whole scene.
  [[gnu::noinline]] void trace() {
    if (scene_.top_nodes == nullptr) {
      if (scene_.placement_count > 0) trace_placement(0, alive_);
    } else if (!kAny && has_beam_) {
      trace_top_beam();
    } else {
      trace_top();
    }
  }

  /// Traces the current group through one placement.
  void trace(uint32_t placement) {
    nearer_ = 0;
    trace_placement(placement, alive_);
  }

  const UnitRays& unit() const { return unit_; }
  /// The rays that still look for a hit, as a bit mask.
  uint64_t alive() const { return alive_; }
  /// The rays whose nearest hit lies in the placement traced last, as a bit mask.
  uint64_t nearer() const { return nearer_; }

private:
  friend struct ExternalTreeSearch<GroupTraversal>;
  using Tests = ChildTests<Lanes, kAny>;

  /// Partitions rays by the octant of their direction and calls visit(rays, octant) for each part.
  template <typename Visit>
  static void by_octant(const BoxRays& group, uint64_t rays, Visit visit) {
    while (rays != 0) {
      const uint32_t first = first_bit(rays);
      uint64_t together = rays;
      uint32_t octant = 0;
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const uint64_t backward = (group.backward[axis] >> first) & 1u;
        together &= group.backward[axis] ^ (backward - 1); // rays with the same sign as `first`
        octant |= static_cast<uint32_t>(backward) << axis;
      }
      visit(together, octant);
      rays &= ~together;
    }
  }

  /// Traces the current group through the tree over placements.
  void trace_top() {
    SideBySideRays group;
    const uint64_t rays =
        enter<!kAny>(scene_.top, scene_.top_max_coordinate, scene_.top_pad_coordinate, unit_, alive_, group);
    by_octant(group, rays, [&](uint64_t together, uint32_t octant) { trace_top(group, together, octant); });
  }

  void trace_top(SideBySideRays& group, uint64_t rays, uint32_t octant) {
    group.reach.set_octant(octant);
    Pending stack[kMaxTopDepth * (baked::kNodeWidth - 1) + 1];
    uint32_t size = 0;
    stack[size++] = {rays, 0, 0.0f};
    while (size > 0) {
      const Pending next = stack[--size];
      const uint64_t active = next.rays & alive_;
      if (active == 0) continue;
      if ((next.node & kTopLeaf) != 0) {
        nearer_ = 0;
        trace_placement(next.node & ~kTopLeaf, reach_parts(next.node & ~kTopLeaf, group, active, octant));
        if constexpr (!kAny)
          for (uint64_t m = nearer_; m != 0; m &= m - 1) {
            const uint32_t i = first_bit(m);
            group.set_tmax(i, group.t_of(i, unit_.tmax[i]));
          }
        continue;
      }
      const TopNode& node = scene_.top_nodes[next.node];
      Tests::push_children(typename Lanes::Boxes(node, octant), group, active, node.slots, stack, size,
                           [&](uint32_t slot) { return node.child[slot]; });
    }
  }

  /// Traces a beam through the tree over placements. Rays are not tested one by one before they are transformed: most
  /// beams meet few placements.
  void trace_top_beam() {
    Pending stack[kMaxTopDepth * (baked::kNodeWidth - 1) + 1];
    uint32_t size = 0;
    stack[size++] = {0, 0, 0.0f};
    float last = find_last();
    while (size > 0) {
      const Pending next = stack[--size];
      if (next.t > last) continue;
      if ((next.node & kTopLeaf) != 0) {
        const uint32_t placement = next.node & ~kTopLeaf;
        float t[baked::kNodeWidth];
        if (scene_.parts != nullptr &&
            (pass_beam(typename Lanes::Boxes(scene_.parts[placement], beam_.octant), beam_.beam, t) &
             scene_.parts[placement].slots) == 0)
          continue;
        nearer_ = 0;
        trace_placement(placement, alive_);
        if (nearer_ != 0) last = find_last();
        continue;
      }
      const TopNode& node = scene_.top_nodes[next.node];
      float t[baked::kNodeWidth];
      uint32_t slots = node.slots & pass_beam(typename Lanes::Boxes(node, beam_.octant), beam_.beam, t);
      for (const uint32_t begin = size; slots != 0; slots &= slots - 1) {
        const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
        uint32_t at = size++;
        for (; at > begin && stack[at - 1].t < t[slot]; --at) stack[at] = stack[at - 1];
        stack[at] = {0, node.child[slot], t[slot]};
      }
    }
  }

  /// Returns the largest tmax of a full group.
  float find_last() const {
    float last = unit_.tmax[0];
    for (uint32_t first = 0; first < kGroup; first += kBlock) {
      Floats some;
      read_block(some, &unit_.tmax[first]);
      const float largest = largest_lane(some);
      last = last < largest ? largest : last;
    }
    return last;
  }

  /// Returns the rays that hit the box of a part of the placement, or all rays if the scene has no parts.
  uint64_t reach_parts(uint32_t placement, const SideBySideRays& group, uint64_t rays, uint32_t octant) const {
    if (scene_.parts == nullptr) return rays;
    const TopNode& parts = scene_.parts[placement];
    uint64_t by_part[baked::kNodeWidth], reaching = 0;
    float t[baked::kNodeWidth];
    uint32_t slots = Tests::pass(typename Lanes::Boxes(parts, octant), group, rays, parts.slots, by_part, t);
    for (; slots != 0; slots &= slots - 1) reaching |= by_part[__builtin_ctz(slots)];
    return reaching;
  }

  void trace_placement(uint32_t placement, uint64_t rays) {
    const TracePlacement& place = scene_.placements[placement];
    if (rays == 0 || (place.ray_classes & ray_class_) == 0) return;
    const TraceTree& tree = scene_.trees[place.tree];
    if constexpr (!kAny)
      if (has_beam_ && scene_.search_tree == nullptr && !may_enter<typename Lanes::Boxes>(place, tree, unit_, beam_))
        return;
    if constexpr (kCount) counters_->placements += count_ones(rays);
    exact_differences_ = tree.max_coordinate <= kExactDifferences;
    fine_grid_ = tree.max_coordinate > kFineGrid;
    RayGroup group;
    graded_ = tree.graded != 0;
    const float pad_coordinate = (graded_ ? kMinTopPad : 1.0f) * tree.max_coordinate;
    Beam beam;
    if (!kAny && unit_.one_origin && scene_.search_tree == nullptr) {
      bool is_beam =
          is_run_ && rays == ~uint64_t{0} && enter_run(place, tree.max_coordinate, pad_coordinate, unit_, group, beam);
      if (!is_beam) {
        rays = enter<true, true>(place, tree.max_coordinate, pad_coordinate, unit_, rays, group);
        is_beam = make_beam(group, pad_coordinate, rays, beam);
      }
      if (is_beam)
        group.beam = &beam;
      else
        fill_records(group);
    } else {
      rays = enter<!kAny>(place, tree.max_coordinate, pad_coordinate, unit_, rays, group);
    }
    if (graded_) group.reach = kUnboundedGroup;
    by_octant(group, rays, [&](uint64_t together, uint32_t octant) {
      group.reach.set_octant(octant);
      if (scene_.search_tree != nullptr)
        ExternalTreeSearch<GroupTraversal>::run(*this, placement, tree.nodes, group, together, octant);
      else if (graded_)
        trace_tree<true>(placement, tree.nodes, group, together, octant);
      else
        trace_tree<false>(placement, tree.nodes, group, together, octant);
    });
  }

  /// Traces rays of one octant through a placed tree.
  /// @tparam kGraded TraceTree::graded
  template <bool kGraded>
  void trace_tree(uint32_t placement, const baked::PackedNode* nodes, RayGroup& group, uint64_t rays, uint32_t octant) {
    Pending stack[baked::kMaxTreeDepth * (baked::kNodeWidth - 1) + 1];
    uint32_t size = 0;
    stack[size++] = {rays, 0, 0.0f};
    while (size > 0) {
      const Pending next = stack[--size];
      const uint64_t active = next.rays & alive_;
      if (active == 0 || is_beyond_beam_hits(group, next)) continue;
      const baked::PackedNode& node = nodes[next.node];
      count_node(active);
      if ((node.ray_classes & ray_class_) == 0) continue;
      const NodeChildren children(node);
      // All children, before their boxes are tested, because the first child is read right after that.
      if (!children.leaves()) prefetch(nodes + node.first_child, 0, baked::kNodeWidth * sizeof node);
      typename Lanes::Boxes boxes(node, octant);
      if constexpr (kGraded) enlarge_boxes(node, octant, boxes);
      if (children.leaves())
        trace_leaves(placement, node, children, boxes, group, active);
      else
        Tests::push_children(boxes, group, active, children.slots(), stack, size,
                             [&](uint32_t slot) { return node.first_child + slot; });
    }
  }

  void count_node(uint64_t rays) {
    if constexpr (kCount) ++counters_->nodes, counters_->node_rays += count_ones(rays);
  }

  /// Whether a beam has no ray left that reaches this entry: all its nearest hits are in front of it.
  static bool is_beyond_beam_hits(const RayGroup& group, const Pending& pending) {
    if constexpr (kAny) return false;
    return group.beam != nullptr && pending.t > -group.beam->limits[1];
  }

  void trace_leaves(uint32_t placement, const baked::PackedNode& node, NodeChildren children,
                    const typename Lanes::Boxes& boxes, RayGroup& group, uint64_t rays) {
    // Without the prefetch, decoding waits longer for them than it takes.
    prefetch(scene_.clusters[node.cluster].bits, 0, kPrefetchedBytes);
    if ((scene_.clusters[node.cluster].flags & ray_class_) == 0) return;
    uint64_t by_child[baked::kNodeWidth];
    float t[baked::kNodeWidth];
    uint32_t slots = Tests::pass(boxes, group, rays, children.slots(), by_child, t);
    const uint64_t begins = children.leaf_begins();
    for (; slots != 0; slots &= slots - 1) {
      const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
      if (const uint64_t active = by_child[slot] & alive_; active != 0)
        trace_leaf(placement, node.cluster, node.first_triangle + byte_of(begins, slot), byte_of(children.bytes, slot),
                   group, active);
    }
    if constexpr (!kAny)
      if (group.beam != nullptr && group.beam->stale) group.beam->update_limits(group);
  }

  const KernelRay* const rays_;
  UnitBeam beam_; ///< of the current run, if has_beam_
  bool has_beam_ = false;
  bool graded_ = false; ///< TraceTree::graded of the current tree
};

} // namespace
} // namespace packtrace::packed
