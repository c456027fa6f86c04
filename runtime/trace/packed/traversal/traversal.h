#pragma once

#include "runtime/trace/packed/traversal/placement_stream.h"

/// Entry points of the kernels of an instruction set.
namespace packtrace::packed {
namespace {

/// Distance at which rays are prefetched while others are sorted.
constexpr size_t kBytesAhead = 96 * sizeof(KernelRay);

/// Sorts rays by octant into groups of neighbours and traces the groups.
template <typename Lanes, bool kAny, bool kCount>
class Traversal {
public:
  /// @param occluded for any hits: one element per ray; else null
  /// @param hits for nearest hits: one element per ray; else null
  Traversal(const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, uint32_t ray_class,
            uint8_t* occluded, KernelHit* hits, KernelCounters* counters)
      : rays_(rays), occluded_(occluded), hits_(hits), counters_(counters), streams_(memory.stream != nullptr),
        groups_(scene, memory.batches, rays, ray_class, hits, counters),
        stream_(scene, groups_, memory.stream, rays, ray_class, occluded) {}

  void run(size_t count) {
    streams_ = streams_ && count >= kMinStreamRays;
    for (size_t first = 0; first < count; first += kStreamRays) {
      sort(first, first + kStreamRays < count ? first + kStreamRays : count);
      if (streams_) stream_.trace();
    }
  }

private:
  void sort(size_t begin, size_t end) {
    uint32_t numbers[8][kGroup], sizes[8] = {};
    if (kAny || streams_) {
      sort(begin, end, numbers, sizes);
    } else {
      for (size_t first = begin; first < end; first += kGroup)
        if (end - first < kGroup || !trace_run(first))
          sort(first, first + kGroup < end ? first + kGroup : end, numbers, sizes);
    }
    for (uint32_t octant = 0; octant < 8; ++octant)
      if (sizes[octant] > 0) trace(numbers[octant], sizes[octant], octant);
  }

  /// Traces kGroup rays if they are camera rays of one octant; otherwise returns false.
  bool trace_run(size_t first) {
    if constexpr (kAny) return false;
    if (!groups_.trace_run(static_cast<uint32_t>(first))) return false;
    if constexpr (kCount) counters_->rays += kGroup;
    return true;
  }

  [[gnu::always_inline]] void sort(size_t begin, size_t end, uint32_t (&numbers)[8][kGroup], uint32_t (&sizes)[8]) {
    for (size_t i = begin; i < end; ++i) {
      const auto number = static_cast<uint32_t>(i);
      prefetch(rays_ + i, kBytesAhead, sizeof *rays_);
      if constexpr (kCount) ++counters_->rays;
      if constexpr (kAny)
        occluded_[i] = 0;
      else
        hits_[i] = {__builtin_inff(), 0.0f, 0.0f, ~0u, 0, 0};
      if (!(rays_[i].tfar > rays_[i].tnear)) continue;
      const uint32_t octant = octant_of(rays_[i].direction);
      numbers[octant][sizes[octant]++] = number;
      if (sizes[octant] == kGroup) {
        trace(numbers[octant], kGroup, octant);
        sizes[octant] = 0;
      }
    }
  }

  static uint32_t octant_of(const float (&v)[3]) {
    return (__builtin_signbit(v[0]) ? 1u : 0u) | (__builtin_signbit(v[1]) ? 2u : 0u) |
           (__builtin_signbit(v[2]) ? 4u : 0u);
  }

  /// Traces a group, or adds it to the stream.
  void trace(const uint32_t* numbers, uint32_t count, uint32_t octant) {
    if (streams_) return stream_.add(numbers, count, octant);
    groups_.take(numbers, count);
    groups_.trace();
    if constexpr (kAny)
      for (uint32_t i = 0; i < count; ++i) occluded_[numbers[i]] = ((groups_.alive() >> i) & 1u) ^ 1u;
  }

  const KernelRay* const rays_;
  uint8_t* const occluded_;
  KernelHit* const hits_;
  KernelCounters* const counters_;
  bool streams_;
  GroupTraversal<Lanes, kAny, kCount> groups_;
  PlacementStream<Lanes, kAny, kCount> stream_;
};

template <typename Lanes, bool kAny>
void trace(const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, size_t count, uint32_t ray_class,
           uint8_t* occluded, KernelHit* hits, KernelCounters* counters) {
  if (counters != nullptr)
    Traversal<Lanes, kAny, true>(scene, memory, rays, ray_class, occluded, hits, counters).run(count);
  else
    Traversal<Lanes, kAny, false>(scene, memory, rays, ray_class, occluded, hits, counters).run(count);
}

/// Returns the kernels of one instruction set.
template <typename Lanes>
constexpr Kernels kernels_of(const char* isa) {
  return {isa,
          [](const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, size_t count, uint32_t ray_class,
             KernelHit* hits, KernelCounters* counters) {
            trace<Lanes, false>(scene, memory, rays, count, ray_class, nullptr, hits, counters);
          },
          [](const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, size_t count, uint32_t ray_class,
             uint8_t* occluded, KernelCounters* counters) {
            trace<Lanes, true>(scene, memory, rays, count, ray_class, occluded, nullptr, counters);
          },
          [](const TraceCluster& cluster, uint32_t triangle, float(&vertex)[3][3]) {
            decode_triangle(cluster, triangle, vertex);
          },
          [](const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
            return out.count = Lanes::decode(cluster, first, count, out);
          }};
}

} // namespace
} // namespace packtrace::packed
