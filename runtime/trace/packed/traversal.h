#pragma once

#include "runtime/trace/packed/batch_decode.h"
#include "runtime/trace/packed/node_test.h"
#include "runtime/trace/packed/triangle_test.h"

/// One ray at a time through trees of nodes.
namespace packtrace::packed {
namespace {

/// PackedNode::children as one number.
struct NodeChildren {
  uint64_t bytes;

  explicit NodeChildren(const baked::PackedNode& node) {
    __builtin_memcpy(&bytes, reinterpret_cast<const uint8_t*>(&node) + offsetof(baked::PackedNode, children),
                     sizeof bytes);
  }
  bool leaves() const { return (bytes & 0xffu) != baked::kInnerChild; }
  /// Slots in use, which come first.
  uint32_t slots() const { return bytes == 0 ? 0u : 0xffu >> (static_cast<uint32_t>(__builtin_clzll(bytes)) / 8); }
  /// Byte i: triangles in the leaves of slots below i; at most 128.
  uint64_t leaf_begins() const { return bytes * 0x0101010101010100u; }
};

inline uint32_t byte_of(uint64_t word, uint32_t slot) { return static_cast<uint32_t>(word >> (8 * slot)) & 0xffu; }

/// One ray class and scene, for many rays on one thread.
template <typename Lanes, bool kCount>
class Traversal {
public:
  Traversal(const KernelScene& scene, BatchCache& cache, uint32_t ray_class, KernelCounters* counters)
      : scene_(scene), cache_(cache), ray_class_(ray_class), counters_(counters) {}

  void closest(const KernelRay& from, KernelHit& hit) {
    hit = {__builtin_inff(), 0.0f, 0.0f, ~0u, 0, 0};
    trace(from, [&](uint32_t placement, float tmax) {
      GridRay ray;
      if (!enter_placement(placement, from, tmax, ray)) return tmax;
      return closest_in_tree(placement, ray, tmax, hit);
    });
  }

  bool any(const KernelRay& from) {
    bool found = false;
    trace(from, [&](uint32_t placement, float tmax) {
      GridRay ray;
      if (!enter_placement(placement, from, tmax, ray) || !any_in_tree(placement, ray)) return tmax;
      found = true;
      return -1.0f;
    });
    return found;
  }

private:
  struct Pending {
    float t;
    uint32_t node;
  };

  /// Calls visit(placement, tmax) for placements along the ray; it returns the new tmax.
  template <typename Visit>
  void trace(const KernelRay& from, Visit visit) {
    if constexpr (kCount) ++counters_->rays;
    if (!(from.tfar > from.tnear)) return;
    const float tmax = next_below(from.tfar);
    if (scene_.top_nodes != nullptr)
      trace_top(from, tmax, visit);
    else if (scene_.placement_count > 0)
      visit(0u, tmax);
  }

  template <typename Visit>
  void trace_top(const KernelRay& from, float tmax, Visit visit) {
    GridRay ray;
    double origin[3], direction[3], largest = 0.0;
    for (uint32_t i = 0; i < 3; ++i) {
      origin[i] = double{from.origin[i]};
      direction[i] = double{from.direction[i]};
      largest = __builtin_fabs(direction[i]) > largest ? __builtin_fabs(direction[i]) : largest;
    }
    if (!(largest > 0.0 && largest < 1e300)) return;
    const double power = power_below(largest);
    for (double& component : direction) component /= power;
    aim(ray, origin, direction, scene_.top_max_coordinate);
    ray.tnear = static_cast<float>(double{from.tnear} * power);
    Pending stack[kMaxTopDepth * 8];
    uint32_t size = 0;
    stack[size++] = {0.0f, 0};
    while (size > 0) {
      const Pending next = stack[--size];
      ray.tmax = static_cast<float>(double{tmax} * power);
      if (next.t > ray.tmax) continue;
      if ((next.node & kTopLeaf) != 0) {
        tmax = visit(next.node & ~kTopLeaf, tmax);
        if (tmax < 0.0f) return;
        continue;
      }
      const TopNode& node = scene_.top_nodes[next.node];
      alignas(32) float entry[8];
      const uint32_t begin = size;
      for (uint32_t slots = test_boxes<Lanes>(node, ray, entry); slots != 0; slots &= slots - 1) {
        const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
        if (node.child[slot] != kTopNone) push_sorted(stack, begin, size, {entry[slot], node.child[slot]});
      }
    }
  }

  /// Keeps stack[begin..size) descending, so that the nearest is on top.
  static void push_sorted(Pending* stack, uint32_t begin, uint32_t& size, Pending item) {
    uint32_t at = size++;
    for (; at > begin && stack[at - 1].t < item.t; --at) stack[at] = stack[at - 1];
    stack[at] = item;
  }

  bool enter_placement(uint32_t placement, const KernelRay& from, float tmax, GridRay& ray) {
    const TracePlacement& place = scene_.placements[placement];
    if ((place.ray_classes & ray_class_) == 0) return false;
    if constexpr (kCount) ++counters_->placements;
    return enter(place, scene_.trees[place.tree], from, tmax, ray);
  }

  const DecodedBatch& decoded(uint32_t cluster, uint32_t first, uint32_t count) {
    const uint64_t tag = (uint64_t{cluster} << 8 | first) + 1;
    const auto hash = static_cast<uint32_t>(tag) * 0x9e3779b1u;
    DecodedBatch& batch = cache_.entries[hash >> cache_.hash_shift];
    if (batch.tag != tag || batch.count > count) {
      if constexpr (kCount) ++counters_->batches_decoded;
      const TraceCluster& packed = scene_.clusters[cluster];
      batch.tag = tag;
      batch.count = (packed.flags & kWide) == 0 ? Lanes::decode(packed, first, count, batch)
                                                : scene_.decode_wide(scene_.owner, cluster, first, count, batch);
    }
    return batch;
  }

  bool present(uint32_t placement, uint32_t cluster, uint32_t triangle, const BatchHits& hits, uint32_t lane) const {
    return scene_.present(scene_.owner, placement, cluster, triangle, hits.u[lane], hits.v[lane], ray_class_);
  }

  /// Calls use(first triangle, hits, lanes) for each batch of a leaf that is hit, until it returns true.
  template <typename Use>
  bool for_hits(const GridRay& ray, uint32_t cluster, uint32_t first, uint32_t count, Use use) {
    if constexpr (kCount) ++counters_->leaves, counters_->triangles += count;
    while (count > 0) {
      const DecodedBatch& batch = decoded(cluster, first, count);
      BatchHits hits;
      uint64_t exact = 0;
      const uint32_t lanes = test_triangles<Lanes>(batch, ray, hits, exact);
      if constexpr (kCount) counters_->exact_triangles += exact;
      if (lanes != 0 && use(first, hits, lanes)) return true;
      first += batch.count;
      count -= batch.count;
    }
    return false;
  }

  bool any_in_leaf(uint32_t placement, const GridRay& ray, uint32_t cluster, uint32_t first, uint32_t count) {
    const uint8_t flags = scene_.clusters[cluster].flags;
    return for_hits(ray, cluster, first, count, [&](uint32_t begin, const BatchHits& hits, uint32_t lanes) {
      if ((flags & kMasked) == 0) return true;
      for (; lanes != 0; lanes &= lanes - 1) {
        const auto lane = static_cast<uint32_t>(__builtin_ctz(lanes));
        if (present(placement, cluster, begin + lane, hits, lane)) return true;
      }
      return false;
    });
  }

  bool any_in_node(uint32_t placement, const GridRay& ray, const baked::PackedNode& node, NodeChildren children,
                   uint32_t slots) {
    if ((scene_.clusters[node.cluster].flags & ray_class_) == 0) return false;
    const uint64_t begins = children.leaf_begins();
    for (; slots != 0; slots &= slots - 1) {
      const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
      if (any_in_leaf(placement, ray, node.cluster, node.first_triangle + byte_of(begins, slot),
                      byte_of(children.bytes, slot)))
        return true;
    }
    return false;
  }

  bool any_in_tree(uint32_t placement, const GridRay& ray) {
    const baked::PackedNode* nodes = scene_.trees[scene_.placements[placement].tree].nodes;
    const typename Lanes::NodeRay node_ray(ray);
    uint32_t stack[kStackSize], size = 0;
    for (uint32_t at = 0;;) {
      const baked::PackedNode& node = nodes[at];
      if constexpr (kCount) ++counters_->nodes;
      if ((node.ray_classes & ray_class_) != 0) {
        const NodeChildren children(node);
        alignas(32) float entry[8];
        uint32_t slots = Lanes::test_node(node, node_ray, ray, entry) & children.slots();
        if (children.leaves()) {
          if (slots != 0 && any_in_node(placement, ray, node, children, slots)) return true;
        } else {
          for (; slots != 0; slots &= slots - 1) {
            stack[size] = node.first_child + static_cast<uint32_t>(__builtin_ctz(slots));
            __builtin_prefetch(nodes + stack[size++]);
          }
        }
      }
      if (size == 0) return false;
      at = stack[--size];
    }
  }

  /// Of two hits at one place the one with the smaller numbers counts.
  static bool precedes(uint32_t placement, uint32_t cluster, uint32_t triangle, const KernelHit& hit) {
    if (hit.placement != placement) return placement < hit.placement; // as all are than kNoHit
    if (hit.cluster != cluster) return cluster < hit.cluster;
    return triangle < hit.triangle;
  }

  void closest_in_leaf(uint32_t placement, GridRay& ray, uint32_t cluster, uint32_t first, uint32_t count,
                       KernelHit& hit, bool& nearer) {
    const uint8_t flags = scene_.clusters[cluster].flags;
    for_hits(ray, cluster, first, count, [&](uint32_t begin, const BatchHits& hits, uint32_t lanes) {
      for (; lanes != 0; lanes &= lanes - 1) {
        const auto lane = static_cast<uint32_t>(__builtin_ctz(lanes));
        const float t = hits.t[lane];
        if (t > ray.tmax || (t == ray.tmax && !precedes(placement, cluster, begin + lane, hit))) continue;
        if ((flags & kMasked) != 0 && !present(placement, cluster, begin + lane, hits, lane)) continue;
        hit.u = hits.u[lane], hit.v = hits.v[lane];
        hit.placement = placement, hit.cluster = cluster, hit.triangle = begin + lane;
        ray.tmax = t;
        nearer = true;
      }
      return false;
    });
  }

  void closest_in_node(uint32_t placement, GridRay& ray, const baked::PackedNode& node, NodeChildren children,
                       uint32_t slots, const float (&entry)[8], KernelHit& hit, bool& nearer) {
    if ((scene_.clusters[node.cluster].flags & ray_class_) == 0) return;
    const uint64_t begins = children.leaf_begins();
    for (; slots != 0; slots &= slots - 1) {
      const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
      if (entry[slot] <= ray.tmax)
        closest_in_leaf(placement, ray, node.cluster, node.first_triangle + byte_of(begins, slot),
                        byte_of(children.bytes, slot), hit, nearer);
    }
  }

  /// Returns the new tmax in unit space.
  float closest_in_tree(uint32_t placement, GridRay& ray, float tmax, KernelHit& hit) {
    const baked::PackedNode* nodes = scene_.trees[scene_.placements[placement].tree].nodes;
    const typename Lanes::NodeRay node_ray(ray);
    Pending stack[kStackSize];
    uint32_t size = 0;
    bool nearer = false;
    for (uint32_t at = 0;;) {
      const baked::PackedNode& node = nodes[at];
      if constexpr (kCount) ++counters_->nodes;
      if ((node.ray_classes & ray_class_) != 0) {
        const NodeChildren children(node);
        alignas(32) float entry[8];
        uint32_t slots = Lanes::test_node(node, node_ray, ray, entry) & children.slots();
        if (children.leaves()) {
          if (slots != 0) closest_in_node(placement, ray, node, children, slots, entry, hit, nearer);
        } else {
          for (const uint32_t begin = size; slots != 0; slots &= slots - 1) {
            const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
            __builtin_prefetch(nodes + node.first_child + slot);
            push_sorted(stack, begin, size, {entry[slot], node.first_child + slot});
          }
        }
      }
      do {
        if (size == 0) return nearer ? hit.t = from_grid(ray) : tmax;
        --size;
      } while (stack[size].t > ray.tmax);
      at = stack[size].node;
    }
  }

  static float from_grid(const GridRay& ray) {
    return static_cast<float>((double{ray.tmax} + ray.t_begin) * ray.t_scale);
  }

  static constexpr uint32_t kStackSize = baked::kMaxTreeDepth * (baked::kNodeWidth - 1) + 1;

  const KernelScene& scene_;
  BatchCache& cache_;
  const uint32_t ray_class_;
  KernelCounters* const counters_;
};

template <typename Lanes, bool kCount>
void closest_hits(const KernelScene& scene, BatchCache& cache, const KernelRay* rays, size_t count, uint32_t ray_class,
                  KernelHit* hits, KernelCounters* counters) {
  Traversal<Lanes, kCount> traversal(scene, cache, ray_class, counters);
  for (size_t i = 0; i < count; ++i) traversal.closest(rays[i], hits[i]);
}

template <typename Lanes, bool kCount>
void any_hits(const KernelScene& scene, BatchCache& cache, const KernelRay* rays, size_t count, uint32_t ray_class,
              uint8_t* occluded, KernelCounters* counters) {
  Traversal<Lanes, kCount> traversal(scene, cache, ray_class, counters);
  for (size_t i = 0; i < count; ++i) occluded[i] = traversal.any(rays[i]) ? 1 : 0;
}

/// The functions of one instruction set.
template <typename Lanes>
constexpr Kernels kernels_of(const char* isa) {
  return {isa,
          [](const KernelScene& scene, BatchCache& cache, const KernelRay* rays, size_t count, uint32_t ray_class,
             KernelHit* hits, KernelCounters* counters) {
            const auto run = counters != nullptr ? closest_hits<Lanes, true> : closest_hits<Lanes, false>;
            run(scene, cache, rays, count, ray_class, hits, counters);
          },
          [](const KernelScene& scene, BatchCache& cache, const KernelRay* rays, size_t count, uint32_t ray_class,
             uint8_t* occluded, KernelCounters* counters) {
            const auto run = counters != nullptr ? any_hits<Lanes, true> : any_hits<Lanes, false>;
            run(scene, cache, rays, count, ray_class, occluded, counters);
          },
          [](const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
            return out.count = Lanes::decode(cluster, first, count, out);
          }};
}

} // namespace
} // namespace packtrace::packed
