#pragma once

#include "runtime/trace/packed/kernels/batch_decode.h"
#include "runtime/trace/packed/kernels/beam.h"
#include "runtime/trace/packed/kernels/enter.h"
#include "runtime/trace/packed/kernels/group_bounds.h"
#include "runtime/trace/packed/kernels/leaf_tests.h"
#include "runtime/trace/packed/kernels/node_children.h"
#include "runtime/trace/packed/traversal/child_tests.h"
#include "runtime/trace/packed/traversal/external_tree_search.h"

/// Traces groups of rays through the tree over placements and through placed trees. A group visits a node together, as
/// a 64-bit mask of rays, and the node test yields a mask per child of the rays that hit its box. A node is read and
/// unpacked once per group, and no ray's test waits for the result of another. Source of the idea: Barringer,
/// Akenine-Moeller, "Dynamic ray stream traversal" (2014).
namespace packtrace::packed {
namespace {

/// Number of cache lines of a cluster's bits to prefetch. They hold most of the 400 to 500 bytes of a cluster without
/// normals.
constexpr uint32_t kPrefetchedLines = 7;

/// Finds any hits (kAny) or nearest hits of one ray class in one scene, on one thread, group by group.
template <typename Lanes, bool kAny, bool kCount>
class GroupTraversal {
public:
  using Kernel = Lanes;
  static constexpr bool kAnyHit = kAny;

  /// @param hits for nearest hits: one per ray, with placement ~0 where there is no hit yet
  GroupTraversal(const KernelScene& scene, BatchCache& cache, const KernelRay* rays, uint32_t ray_class,
                 KernelHit* hits, KernelCounters* counters)
      : scene_(scene), cache_(cache), rays_(rays), ray_class_(ray_class), hits_(hits), counters_(counters) {}

  /// Makes the given rays the current group.
  /// @param numbers indices of 1 to kGroup rays; must stay valid while the group is traced
  void take(const uint32_t* numbers, uint32_t count) {
    numbers_ = numbers;
    alive_ = ~uint64_t{0} >> (kGroup - count);
    for (uint32_t first = 0; first < count; first += kBlock) {
      uint32_t block[kBlock];
      for (uint32_t i = 0; i < kBlock; ++i) block[i] = numbers[first + i < count ? first + i : 0];
      read_rays(rays_, block, first, unit_);
    }
    if constexpr (!kAny) unit_.one_origin = start_at_one_place(unit_, count);
  }

  /// Does the same, and keeps the hits found so far: each ray ends at its nearest hit.
  void take_with_hits(const uint32_t* numbers, uint32_t count) {
    take(numbers, count);
    if constexpr (!kAny)
      for (uint32_t i = 0; i < count; ++i)
        if (const KernelHit& hit = hits_[numbers[i]]; hit.placement != ~0u) unit_.tmax[i] = hit.t;
  }

  /// Traces the current group through the whole scene.
  void trace() {
    if (scene_.top_nodes != nullptr)
      trace_top();
    else if (scene_.placement_count > 0)
      trace_placement(0, alive_);
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

  struct Place {
    uint32_t placement, cluster, triangle;
  };

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
    if constexpr (kCount) counters_->placements += count_ones(rays);
    const TraceTree& tree = scene_.trees[place.tree];
    exact_differences_ = tree.max_coordinate <= kExactDifferences;
    fine_grid_ = tree.max_coordinate > kFineGrid;
    RayGroup group;
    graded_ = tree.graded != 0;
    const float pad_coordinate = (graded_ ? kMinTopPad : 1.0f) * tree.max_coordinate;
    rays = enter<!kAny>(place, tree.max_coordinate, pad_coordinate, unit_, rays, group);
    if (graded_) group.reach = kUnboundedGroup;
    Beam beam;
    if constexpr (!kAny)
      if (unit_.one_origin && make_beam(group, pad_coordinate, rays, beam)) group.beam = &beam;
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
      if (!children.leaves()) prefetch_siblings(nodes + node.first_child);
      typename Lanes::Boxes boxes(node, octant);
      if constexpr (kGraded) enlarge_boxes(node, octant, boxes);
      if (children.leaves())
        trace_leaves(placement, node, children, boxes, group, active);
      else
        Tests::push_children(boxes, group, active, children.slots(), stack, size,
                             [&](uint32_t slot) { return node.first_child + slot; });
    }
  }

  /// Prefetches all children of a node before their boxes are tested, because the first child is read right after that.
  static void prefetch_siblings(const baked::PackedNode* first) {
    const auto begin = reinterpret_cast<uintptr_t>(first), end = begin + baked::kNodeWidth * sizeof *first;
    for (uintptr_t line = begin; line < end; line += 64) __builtin_prefetch(reinterpret_cast<const void*>(line));
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
    const uint8_t* const bits = scene_.clusters[node.cluster].bits;
    for (uint32_t line = 0; line < kPrefetchedLines; ++line) __builtin_prefetch(bits + 64 * line);
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

  void trace_leaf(uint32_t placement, uint32_t cluster, uint32_t first, uint32_t count, RayGroup& group,
                  uint64_t rays) {
    if (fine_grid_) [[unlikely]]
      trace_fine_leaf(placement, cluster, first, count, group, rays);
    else
      trace_leaf(placement, cluster, first, count, group, rays, FineGrid<false>());
  }

  [[gnu::noinline]] void trace_fine_leaf(uint32_t placement, uint32_t cluster, uint32_t first, uint32_t count,
                                         RayGroup& group, uint64_t rays) {
    trace_leaf(placement, cluster, first, count, group, rays, FineGrid<true>());
  }

  template <typename Fine>
  void trace_leaf(uint32_t placement, uint32_t cluster, uint32_t first, uint32_t count, RayGroup& group, uint64_t rays,
                  Fine fine) {
    if constexpr (kCount) ++counters_->leaves, counters_->leaf_rays += count_ones(rays);
    while (count > 0) {
      const DecodedBatch& batch = decoded(cluster, first, count);
      if constexpr (kCount) counters_->triangles += count_ones(rays) * batch.count;
      const Place place{placement, cluster, first};
      BatchNormals normals;
      if (exact_differences_)
        normals = batch_normals<Lanes>(batch);
      else
        batch_normals_of_large(batch, normals);
      uint64_t exact = 0;
      if (kAny && (scene_.clusters[cluster].flags & kMasked) == 0) {
        alive_ &= ~rays_that_hit<Lanes, !kAny>(batch, normals, group, rays, fine, exact);
      } else {
        const uint64_t others = test_side_by_side(batch, normals, place, group, rays, fine);
        const bool many = Lanes::WideLanes::kLanes > kBatch && count_ones(others) >= kMinPrefilteredRays;
        test_each(batch, normals, place, group,
                  many ? rays_that_hit<Lanes, !kAny>(batch, normals, group, others, fine, exact) : others, fine);
      }
      if constexpr (kCount) counters_->exact_triangles += exact;
      rays &= alive_;
      first += batch.count;
      count -= batch.count;
    }
  }

  /// Tests one ray after the other, each against all triangles of the batch.
  template <typename Fine>
  void test_each(const DecodedBatch& batch, const BatchNormals& normals, const Place& place, RayGroup& group,
                 uint64_t rays, Fine fine) {
    for (uint64_t m = rays; m != 0; m &= m - 1) {
      const uint32_t i = first_bit(m);
      LaneHits<Lanes> hits;
      uint64_t exact = 0;
      const uint32_t lanes = test_triangles<Lanes, !kAny>(batch, normals, group, i, fine, hits, exact);
      if constexpr (kCount) counters_->exact_triangles += exact;
      if (lanes != 0) take_hits(place, i, hits, lanes, group);
    }
  }

  /// Tests one triangle after the other against registers of rays, where a register has at least as many active rays as
  /// the batch has triangles. Returns the remaining rays, as a bit mask.
  template <typename Fine>
  uint64_t test_side_by_side(const DecodedBatch& batch, const BatchNormals& normals, Place place, RayGroup& group,
                             uint64_t rays, Fine fine) {
    using WideLanes = typename Lanes::WideLanes;
    const uint32_t begin = place.triangle;
    for (uint32_t at = 0; at < kGroup; at += WideLanes::kLanes) {
      const uint32_t wanted = lanes_at<WideLanes>(rays, at);
      uint32_t axis[3];
      if (count_ones(wanted) < batch.count || !same_axes<WideLanes>(group, at, wanted, axis)) continue;
      rays &= ~(uint64_t{wanted} << at);
      for (uint32_t triangle = 0; triangle < batch.count; ++triangle) {
        LaneHits<WideLanes> hits;
        uint64_t exact = 0;
        uint32_t lanes =
            test_rays<WideLanes, !kAny>(batch, normals, triangle, group, axis, at, fine, wanted, hits, exact);
        if constexpr (kCount) counters_->exact_triangles += exact;
        place.triangle = begin + triangle;
        for (; lanes != 0; lanes &= lanes - 1) {
          const auto lane = static_cast<uint32_t>(__builtin_ctz(lanes));
          take_hit(place, at + lane, hits.t[lane], hits.u[lane], hits.v[lane], group);
        }
      }
    }
    return rays;
  }

  const DecodedBatch& decoded(uint32_t cluster, uint32_t first, uint32_t count) {
    const uint64_t tag = (uint64_t{cluster} << 8 | first) + 1;
    const auto hash = static_cast<uint32_t>(tag) * 0x9e3779b1u;
    DecodedBatch& batch = cache_.entries[hash >> cache_.hash_shift];
    if (batch.tag != tag) {
      if constexpr (kCount) ++counters_->batches_decoded;
      const TraceCluster& packed = scene_.clusters[cluster];
      batch.tag = tag;
      batch.count = (packed.flags & kNeedsWideDecode) == 0
                        ? Lanes::decode(packed, first, count, batch)
                        : scene_.decode_wide(scene_.owner, cluster, first, count, batch);
    }
    return batch;
  }

  /// Records the hits of ray i in the given lanes (triangles) of a batch that begins at `place`.
  void take_hits(Place place, uint32_t i, const LaneHits<Lanes>& hits, uint32_t lanes, RayGroup& group) {
    const uint32_t begin = place.triangle;
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<uint32_t>(__builtin_ctz(lanes));
      place.triangle = begin + lane;
      if (take_hit(place, i, hits.t[lane], hits.u[lane], hits.v[lane], group) && kAny) return;
    }
  }

  /// Records a hit of ray i and returns true if it counts: it is not masked out and, for nearest hits, is the nearest
  /// so far. Hits are compared by their t in unit space, so the result does not depend on the order of placements.
  bool take_hit(const Place& place, uint32_t i, float t, float u, float v, RayGroup& group) {
    float unit_t = 0.0f;
    if constexpr (!kAny) {
      unit_t = group.unit_t(i, t);
      if (unit_t > unit_.tmax[i] || (unit_t == unit_.tmax[i] && !precedes(place, hits_[numbers_[i]]))) return false;
    }
    if ((scene_.clusters[place.cluster].flags & kMasked) != 0 &&
        !scene_.present(scene_.owner, place.placement, place.cluster, place.triangle, u, v, ray_class_))
      return false;
    if constexpr (kAny) {
      alive_ &= ~(uint64_t{1} << i);
    } else {
      nearer_ |= uint64_t{1} << i;
      group.set_tmax(i, group.t_of(i, unit_t));
      if (group.beam != nullptr) group.beam->stale = true;
      unit_.tmax[i] = unit_t;
      hits_[numbers_[i]] = {unit_t, u, v, place.placement, place.cluster, place.triangle};
    }
    return true;
  }

  /// Of two hits with equal t, the one with the smaller numbers counts.
  static bool precedes(const Place& place, const KernelHit& hit) {
    // Every placement number is less than ~0, which means no hit.
    if (hit.placement != place.placement) return place.placement < hit.placement;
    if (hit.cluster != place.cluster) return place.cluster < hit.cluster;
    return place.triangle < hit.triangle;
  }

  const KernelScene& scene_;
  BatchCache& cache_;
  const KernelRay* const rays_;
  const uint32_t ray_class_;
  KernelHit* const hits_;
  KernelCounters* const counters_;
  // State of the current group:
  const uint32_t* numbers_ = nullptr; ///< indices of its rays
  uint64_t alive_ = 0;                ///< rays that still look for a hit
  uint64_t nearer_ = 0;               ///< rays whose nearest hit lies in the placement traced last
  bool graded_ = false;               ///< TraceTree::graded of the current tree
  bool exact_differences_ = false;    ///< whether vertex differences are exact in floats in the current tree
  bool fine_grid_ = false;            ///< whether coordinates of the current tree exceed kFineGrid
  UnitRays unit_;
};

} // namespace
} // namespace packtrace::packed
