#pragma once

#include "runtime/trace/packed/kernels/octant_guess.h"
#include "runtime/trace/packed/traversal/group_traversal.h"

/// Traces many groups of rays through the tree over placements together. It is for scenes in which few rays of a group
/// enter the same placement: the rays that all groups send to a placement are regrouped there.
namespace packtrace::packed {
namespace {

/// A group of rays of one octant in the tree over placements.
struct StreamGroup {
  BoxRays boxes;
  uint64_t alive;  ///< bit mask of the rays that still look for a hit
  uint32_t octant; ///< of all its rays
  uint32_t numbers[kGroup];
};
static_assert(sizeof(StreamGroup) == kStreamGroupBytes && alignof(StreamGroup) <= kStreamAlignment);

/// The rays of one group that are to visit a node.
struct StreamPart {
  uint64_t rays; ///< bit mask
  uint32_t group;
};
static_assert(sizeof(StreamPart) == kStreamPartBytes);

/// Finds any hits (kAny) or nearest hits for portions of at most kStreamRays rays.
template <typename Lanes, bool kAny, bool kCount>
class PlacementStream {
public:
  /// @param groups traces the groups that are formed at placements
  /// @param memory ThreadMemory::stream; may be null if add() is not called
  /// @param occluded for any hits: one element per ray, set to 1 where the ray hits
  PlacementStream(const KernelScene& scene, GroupTraversal<Lanes, kAny, kCount>& groups, void* memory,
                  const KernelRay* rays, uint32_t ray_class, uint8_t* occluded)
      : scene_(scene), traversal_(groups), rays_(rays), ray_class_(ray_class), occluded_(occluded),
        groups_(static_cast<StreamGroup*>(memory)),
        parts_(memory != nullptr ? reinterpret_cast<StreamPart*>(groups_ + kStreamGroups) : nullptr) {}

  /// Adds a group of rays of one octant to the portion.
  void add(const uint32_t* numbers, uint32_t count, uint32_t octant) {
    StreamGroup& group = groups_[group_count_++];
    for (uint32_t i = 0; i < count; ++i) group.numbers[i] = numbers[i];
    group.octant = octant;
    traversal_.take(numbers, count);
    group.alive = enter<!kAny>(scene_.top, scene_.top_max_coordinate, scene_.top_pad_coordinate, traversal_.unit(),
                               traversal_.alive(), group.boxes);
  }

  /// Traces the portion and begins a new one.
  void trace() {
    Visit stack[kMaxTopDepth * (baked::kNodeWidth - 1) + 1];
    uint32_t size = 0;
    uint32_t part_count = 0;
    for (uint32_t octant = 0; octant < 8; ++octant) // Sorted by octant, so a node's boxes are set up once per octant.
      for (uint32_t g = 0; g < group_count_; ++g)
        if (groups_[g].octant == octant) parts_[part_count++] = {groups_[g].alive, g};
    stack[size++] = {parts_, parts_ + part_count, part_count, 0, 0.0f};
    while (size > 0) {
      const Visit next = stack[--size];
      if ((next.node & kTopLeaf) != 0)
        visit_placement(next);
      else
        visit_node(next, stack, size);
    }
    group_count_ = 0;
  }

private:
  struct Visit {
    const StreamPart* parts;
    StreamPart* free; ///< begin of unused memory, after the parts of all nodes on the stack
    uint32_t part_count;
    uint32_t node;  ///< or kTopLeaf + placement
    float distance; ///< squared distance of the box from the first ray's origin
  };

  /// Pushes the children that rays hit. The child nearest to the first ray's origin ends on top, because rays that
  /// start at one place mostly hit something near it, whatever their direction.
  void visit_node(const Visit& at, Visit* stack, uint32_t& size) {
    const TopNode& node = scene_.top_nodes[at.node];
    StreamPart* parts[baked::kNodeWidth];
    uint32_t part_counts[baked::kNodeWidth] = {}, used = 0;
    for (uint32_t slot = 0; slot < baked::kNodeWidth; ++slot) parts[slot] = at.free + slot * at.part_count;
    const KernelRay* first = nullptr;
    for (uint32_t i = 0; i < at.part_count;) {
      const uint32_t octant = groups_[at.parts[i].group].octant;
      const typename Lanes::Boxes boxes(node, octant);
      for (; i < at.part_count && groups_[at.parts[i].group].octant == octant; ++i) {
        const StreamGroup& group = groups_[at.parts[i].group];
        const uint64_t rays = at.parts[i].rays & group.alive;
        if (rays == 0) continue;
        if (first == nullptr) first = rays_ + group.numbers[first_bit(rays)];
        uint64_t by_child[baked::kNodeWidth];
        uint32_t slots = node.slots & Lanes::Children::pass(boxes, group.boxes, rays, by_child);
        used |= slots;
        for (; slots != 0; slots &= slots - 1) {
          const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
          parts[slot][part_counts[slot]++] = {by_child[slot], at.parts[i].group};
        }
      }
    }
    if (used == 0) return;
    float distance[baked::kNodeWidth];
    distances(node, first->origin, distance);
    StreamPart* const free = at.free + baked::kNodeWidth * at.part_count;
    const uint32_t begin = size;
    for (; used != 0; used &= used - 1) {
      const auto slot = static_cast<uint32_t>(__builtin_ctz(used));
      uint32_t place = size++;
      for (; place > begin && stack[place - 1].distance < distance[slot]; --place) stack[place] = stack[place - 1];
      stack[place] = {parts[slot], free, part_counts[slot], node.child[slot], distance[slot]};
    }
  }

  /// Computes the squared distances of a point from a node's boxes.
  static void distances(const TopNode& node, const float (&point)[3], float (&out)[baked::kNodeWidth]) {
    using F = typename Lanes::F;
    F sum = Lanes::set(0.0f);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const F p = Lanes::set(point[axis]);
      const F before = Lanes::sub(Lanes::load(node.lo[axis]), p), behind = Lanes::sub(p, Lanes::load(node.hi[axis]));
      const F outside = Lanes::max(Lanes::max(before, behind), Lanes::set(0.0f));
      sum = Lanes::fma(outside, outside, sum);
    }
    Lanes::store(out, sum);
  }

  /// Rays of one octant of a placement's grid.
  struct Gathered {
    uint32_t count = 0;
    uint32_t rays[kGroup]; ///< kGroup * number of the StreamGroup + bit in it
  };

  void visit_placement(const Visit& at) {
    const uint32_t number = at.node & ~kTopLeaf;
    const TracePlacement& placement = scene_.placements[number];
    if ((placement.ray_classes & ray_class_) == 0) return;
    const ApproximateOctant octant_of(placement);
    Gathered gathered[8];
    for (uint32_t i = 0; i < at.part_count; ++i) {
      const StreamGroup& group = groups_[at.parts[i].group];
      for (uint64_t left = at.parts[i].rays & group.alive; left != 0; left &= left - 1) {
        const uint32_t bit = first_bit(left);
        Gathered& same = gathered[octant_of(rays_[group.numbers[bit]].direction)];
        same.rays[same.count++] = at.parts[i].group * kGroup + bit;
        if (same.count == kGroup) trace(number, same);
      }
    }
    for (Gathered& same : gathered)
      if (same.count > 0) trace(number, same);
  }

  void trace(uint32_t placement, Gathered& gathered) {
    uint32_t numbers[kGroup] = {};
    for (uint32_t i = 0; i < gathered.count; ++i)
      numbers[i] = groups_[gathered.rays[i] / kGroup].numbers[gathered.rays[i] % kGroup];
    traversal_.take_with_hits(numbers, gathered.count);
    const uint64_t before = traversal_.alive();
    traversal_.trace(placement);
    for (uint64_t m = kAny ? before & ~traversal_.alive() : traversal_.nearer(); m != 0; m &= m - 1) {
      const uint32_t i = first_bit(m), bit = gathered.rays[i] % kGroup;
      StreamGroup& group = groups_[gathered.rays[i] / kGroup];
      if constexpr (kAny)
        group.alive &= ~(uint64_t{1} << bit), occluded_[numbers[i]] = 1;
      else
        group.boxes.set_tmax(bit, group.boxes.t_of(bit, traversal_.unit().tmax[i]));
    }
    gathered.count = 0;
  }

  const KernelScene& scene_;
  GroupTraversal<Lanes, kAny, kCount>& traversal_;
  const KernelRay* const rays_;
  const uint32_t ray_class_;
  uint8_t* const occluded_;
  StreamGroup* const groups_;
  StreamPart* const parts_;
  uint32_t group_count_ = 0;
};

} // namespace
} // namespace packtrace::packed
