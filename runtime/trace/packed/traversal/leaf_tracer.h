#pragma once

#include "runtime/trace/packed/kernels/batch_decode.h"
#include "runtime/trace/packed/kernels/beam_leaf_tests.h"
#include "runtime/trace/packed/kernels/leaf_tests.h"
#include "runtime/trace/packed/kernels/run_hits.h"

namespace packtrace::packed {
namespace {

/// Tests a group's rays against the triangles of leaves and records their hits.
template <typename Lanes, bool kAny, bool kCount>
class LeafTracer {
protected:
  LeafTracer(const KernelScene& scene, BatchCache& cache, uint32_t ray_class, KernelHit* hits, KernelCounters* counters)
      : scene_(scene), ray_class_(ray_class), hits_(hits), counters_(counters), cache_(cache) {}

  struct Place {
    uint32_t placement, cluster, triangle;
  };

  void trace_leaf(uint32_t placement, uint32_t cluster, uint32_t first, uint32_t count, RayGroup& group,
                  uint64_t rays) {
    if (fine_grid_) [[unlikely]]
      trace_fine_leaf(placement, cluster, first, count, group, rays);
    else
      trace_batches(placement, cluster, first, count, group, rays, FineGrid<false>());
  }

  const KernelScene& scene_;
  const uint32_t ray_class_;
  KernelHit* const hits_;
  KernelCounters* const counters_;
  // State of the current group:
  const uint32_t* numbers_ = nullptr; ///< indices of its rays
  bool is_run_ = false;               ///< whether the rays follow each other, and hits go to run_hits_ first
  uint64_t alive_ = 0;                ///< rays that still look for a hit
  uint64_t nearer_ = 0;               ///< rays whose nearest hit lies in the placement traced last
  bool exact_differences_ = false;    ///< whether vertex differences are exact in floats in the current tree
  bool fine_grid_ = false;            ///< whether coordinates of the current tree exceed kFineGrid
  UnitRays unit_;
  RunHits run_hits_;

private:
  [[gnu::noinline]] void trace_fine_leaf(uint32_t placement, uint32_t cluster, uint32_t first, uint32_t count,
                                         RayGroup& group, uint64_t rays) {
    trace_batches(placement, cluster, first, count, group, rays, FineGrid<true>());
  }

  template <typename Fine>
  void trace_batches(uint32_t placement, uint32_t cluster, uint32_t first, uint32_t count, RayGroup& group,
                     uint64_t rays, Fine fine) {
    if constexpr (kCount) ++counters_->leaves, counters_->leaf_rays += count_ones(rays);
    while (count > 0 && rays != 0) {
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
        alive_ &= ~rays_that_hit<Lanes, false>(batch, normals, group, rays, fine, exact);
      } else if (!kAny && !Fine::value && group.beam != nullptr) {
        test_each(batch, normals, place, group, test_beam(batch, normals, place, group, rays), fine);
      } else {
        uint64_t others = test_side_by_side(batch, normals, place, group, rays, fine);
        if constexpr (Lanes::WideLanes::kLanes > kBatch)
          if (count_ones(others) >= kMinPrefilteredRays && group.beam == nullptr)
            others = rays_that_hit<Lanes, !kAny>(batch, normals, group, others, fine, exact);
        test_each(batch, normals, place, group, others, fine);
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

  /// The same for the rays of a beam; registers with at least half as many rays as the batch has triangles are enough.
  [[gnu::noinline]] uint64_t test_beam(const DecodedBatch& batch, const BatchNormals& normals, Place place,
                                       RayGroup& group, uint64_t rays) {
    using WideLanes = typename Lanes::WideLanes;
    const uint32_t begin = place.triangle;
    const bool at_once = is_run_ && group.beam->plain && (scene_.clusters[place.cluster].flags & kMasked) == 0;
    BeamBatch moved;
    move_to_origin<Lanes>(batch, group, first_bit(rays), moved);
    for (uint32_t k0 = 0; k0 < 3; ++k0) {
      const uint64_t same = rays & group.major[k0];
      if (same == 0) continue;
      const uint32_t axis[3] = {k0, k0 == 2 ? 0 : k0 + 1, k0 == 0 ? 2 : k0 - 1};
      BeamHeights heights;
      find_heights<Lanes>(moved, normals, group, first_bit(same), axis, heights);
      for (uint32_t at = 0; at < kGroup; at += WideLanes::kLanes) {
        const uint32_t wanted = lanes_at<WideLanes>(same, at);
        if (wanted == 0 || !prefers_rays_in_lanes(count_ones(wanted), batch.count)) continue;
        rays &= ~(uint64_t{wanted} << at);
        for (uint32_t triangle = 0; triangle < batch.count; ++triangle) {
          LaneHits<WideLanes> hits;
          uint64_t exact = 0;
          uint32_t lanes =
              test_beam_rays<WideLanes>(moved, heights, normals, triangle, group, axis, at, wanted, hits, exact);
          if constexpr (kCount) counters_->exact_triangles += exact;
          if (lanes == 0) continue;
          place.triangle = begin + triangle;
          if (at_once) lanes = take_register<WideLanes>(place, at, lanes, hits, group);
          for (; lanes != 0; lanes &= lanes - 1) {
            const auto lane = static_cast<uint32_t>(__builtin_ctz(lanes));
            take_hit(place, at + lane, hits.t[lane], hits.u[lane], hits.v[lane], group);
          }
        }
      }
    }
    return rays;
  }

  /// Records the hits in the given lanes of a register of a plain beam's rays. Returns the lanes left for take_hit(),
  /// whose t equals the nearest so far.
  template <typename WideLanes>
  uint32_t take_register(const Place& place, uint32_t at, uint32_t lanes, const LaneHits<WideLanes>& hits,
                         RayGroup& group) {
    Beam& beam = *group.beam;
    const auto unit_t = WideLanes::mul(WideLanes::load(hits.t), WideLanes::load(&beam.unit_scale[at]));
    const auto so_far = WideLanes::load(&unit_.tmax[at]);
    const uint32_t nearer = lanes & WideLanes::less(unit_t, so_far);
    const uint32_t equal = lanes & ~nearer & WideLanes::less_equal(unit_t, so_far);
    if (nearer == 0) return equal;
    nearer_ |= uint64_t{nearer} << at;
    beam.stale = true;
    WideLanes::store(&unit_.tmax[at], nearer, unit_t);
    WideLanes::store(&group.end[at], nearer, WideLanes::mul(unit_t, WideLanes::load(&beam.grid_scale[at])));
    WideLanes::store(&run_hits_.u[at], nearer, WideLanes::load(hits.u));
    WideLanes::store(&run_hits_.v[at], nearer, WideLanes::load(hits.v));
    WideLanes::store(&run_hits_.placement[at], nearer, place.placement);
    WideLanes::store(&run_hits_.cluster[at], nearer, place.cluster);
    WideLanes::store(&run_hits_.triangle[at], nearer, place.triangle);
    return equal;
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
      if (unit_t > unit_.tmax[i] || (unit_t == unit_.tmax[i] && !precedes(place, i))) return false;
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
      const KernelHit hit{unit_t, u, v, place.placement, place.cluster, place.triangle};
      if (is_run_)
        run_hits_.set(i, hit);
      else
        hits_[numbers_[i]] = hit;
    }
    return true;
  }

  /// Of two hits with equal t, the one with the smaller numbers counts.
  bool precedes(const Place& place, uint32_t i) const {
    const Place other =
        is_run_ ? Place{run_hits_.placement[i], run_hits_.cluster[i], run_hits_.triangle[i]}
                : Place{hits_[numbers_[i]].placement, hits_[numbers_[i]].cluster, hits_[numbers_[i]].triangle};
    // Every placement number is less than ~0, which means no hit.
    if (other.placement != place.placement) return place.placement < other.placement;
    if (other.cluster != place.cluster) return place.cluster < other.cluster;
    return place.triangle < other.triangle;
  }

  BatchCache& cache_;
};

} // namespace
} // namespace packtrace::packed
