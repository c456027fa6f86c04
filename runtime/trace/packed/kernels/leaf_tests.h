#pragma once

#include "runtime/trace/packed/kernels/batch_strips.h"
#include "runtime/trace/packed/kernels/triangle_test.h"

/// Tests the triangles of a batch against the rays that reach its leaf, in one of three arrangements:
///  - test_triangles(), test_one_ray(): one ray against eight triangles, one triangle per SIMD lane.
///  - test_several_rays(): several rays in one register, each against four or eight triangles.
///  - test_rays(): one triangle against one ray per lane.
/// All three perform the same arithmetic, so they return the same bits.
namespace packtrace::packed {
namespace {

inline uint32_t first_bit(uint64_t word) { return static_cast<uint32_t>(__builtin_ctzll(word)); }

/// Returns the triangles of a batch that one ray hits, as a bit mask.
template <typename Lanes, bool kUseResidual, typename Fine>
inline uint32_t test_triangles(const DecodedBatch& batch, const BatchNormals& normals, const RayGroup& group,
                               uint32_t ray, Fine fine, LaneHits<Lanes>& hits, uint64_t& exact_count) {
  const uint32_t axis[3] = {group.axis[0][ray], group.axis[1][ray], group.axis[2][ray]};
  const auto vertex = [&](uint32_t k, uint32_t corner) { return Lanes::load(batch.vertex[axis[k]][corner]); };
  const auto origin = [&](uint32_t k) { return Lanes::set(group.origin[axis[k]][ray]); };
  const auto normal = [&](uint32_t k) { return Lanes::load(normals.normal[axis[k]]); };
  const auto rest = [&](uint32_t k) { return Lanes::set(group.rest[axis[k]][ray]); };
  const RayLanes<Lanes> lanes{
      {Lanes::set(group.shear[0][ray]), Lanes::set(group.shear[1][ray]), Lanes::set(group.shear[2][ray])},
      Lanes::set(group.begin[ray]),
      Lanes::set(group.end[ray])};
  return test_lanes<Lanes, true, kUseResidual>(vertex, origin, normal, rest, lanes, fine, (1u << batch.count) - 1, hits,
                                               exact_count);
}

/// Up to this number of rays, any hits are found ray by ray: eight lanes of one ray are no more work than a wide
/// register that is half empty, and rays of different major axes need no loop over axes.
constexpr uint32_t kFewRays = 3;

/// Whether one ray hits a triangle of a batch, for any hits. Most leaves are visited by a single ray of a group.
template <typename Lanes, typename Fine>
[[gnu::always_inline]] inline bool test_one_ray(const DecodedBatch& batch, const BatchNormals& normals,
                                                const RayGroup& group, uint32_t ray, Fine fine, uint64_t& exact_count) {
  const uint32_t axis[3] = {group.axis[0][ray], group.axis[1][ray], group.axis[2][ray]};
  const TestRay& from = group.tests[ray];
  const auto vertex = [&](uint32_t k, uint32_t corner) { return Lanes::load(batch.vertex[axis[k]][corner]); };
  const auto origin = [&](uint32_t k) { return Lanes::set(from.origin[k]); };
  const auto normal = [&](uint32_t k) { return Lanes::load(normals.normal[axis[k]]); };
  const auto rest = [](uint32_t) { return Lanes::set(0.0f); };
  const RayLanes<Lanes> lanes{{Lanes::set(from.shear[0]), Lanes::set(from.shear[1]), Lanes::set(from.shear[2])},
                              Lanes::set(from.begin),
                              Lanes::set(from.end)};
  LaneHits<Lanes> hits;
  return test_lanes<Lanes, false, false>(vertex, origin, normal, rest, lanes, fine, (1u << batch.count) - 1, hits,
                                         exact_count) != 0;
}

/// The first kTriangles triangles of a batch, repeated until they fill a register. Coordinates are permuted to Woop's
/// axes for rays whose kx is k0.
template <typename WideLanes, uint32_t kTriangles, bool kUseResidual>
struct BatchLanes {
  static constexpr uint32_t kRays = WideLanes::kLanes / kTriangles;
  typename WideLanes::F vertex[3][3], normal[3];

  BatchLanes(const DecodedBatch& batch, const BatchNormals& normals, uint32_t k0) {
    const uint32_t k[3] = {k0, k0 == 2 ? 0 : k0 + 1, k0 == 0 ? 2 : k0 - 1};
    for (uint32_t i = 0; i < 3; ++i) {
      normal[i] = WideLanes::template repeat<kTriangles>(normals.normal[k[i]]);
      for (uint32_t corner = 0; corner < 3; ++corner)
        vertex[i][corner] = WideLanes::template repeat<kTriangles>(batch.vertex[k[i]][corner]);
    }
  }

  /// Tests kRays rays against the triangles and returns the lanes with a hit, as a bit mask. Ray i has the lanes from
  /// kTriangles i on.
  /// @param wanted bit mask of the lanes that hold a triangle
  template <typename Fine>
  uint32_t test(const TestRay* const (&rays)[kRays], const TestResidual* const (&rests)[kRays], Fine fine,
                uint32_t wanted, uint64_t& exact_count) const {
    typename WideLanes::F origin[4], shear[4],
        rest[4]; // The fourth elements hold the rays' begin, their end and no value.
    if constexpr (kUseResidual) WideLanes::template spread<kTriangles, 0>(rests, rest);
    WideLanes::template spread<kTriangles, 0>(rays, origin);
    WideLanes::template spread<kTriangles, 4>(rays, shear);
    const RayLanes<WideLanes> lanes{{shear[0], shear[1], shear[2]}, origin[3], shear[3]};
    LaneHits<WideLanes> hits;
    return test_lanes<WideLanes, false, kUseResidual>(
        [&](uint32_t i, uint32_t corner) { return vertex[i][corner]; }, [&](uint32_t i) { return origin[i]; },
        [&](uint32_t i) { return normal[i]; }, [&](uint32_t i) { return rest[i]; }, lanes, fine, wanted, hits,
        exact_count);
  }
};

/// Returns the rays of the bit mask `rays` that hit a triangle of a batch of at most kTriangles triangles. If the last
/// register is not full, its last ray is repeated.
template <typename WideLanes, uint32_t kTriangles, bool kUseResidual, typename Fine>
inline uint64_t test_several_rays(const DecodedBatch& batch, const BatchNormals& normals, const RayGroup& group,
                                  uint64_t rays, Fine fine, uint64_t& exact) {
  using Triangles = BatchLanes<WideLanes, kTriangles, kUseResidual>;
  constexpr uint32_t kRays = Triangles::kRays;
  static_assert(WideLanes::kLanes == 16);
  constexpr uint32_t kFirstLanes = kTriangles == 8 ? 0x0101u : 0x1111u;
  const uint32_t wanted = ((1u << batch.count) - 1) * kFirstLanes;
  uint64_t hit = 0;
  for (uint32_t k = 0; k < 3; ++k) {
    uint64_t m = rays & group.major[k];
    if (m == 0) continue;
    const Triangles triangles(batch, normals, k);
    do {
      uint32_t number[kRays];
      const TestRay* few[kRays];
      const TestResidual* rests[kRays];
      for (uint64_t i = 0, last = 0; i < kRays; ++i, m &= m - 1) {
        last = m | (last & (0 - uint64_t{m == 0})); // Branch-free, because a branch would often be mispredicted.
        number[i] = first_bit(last);
        few[i] = &group.tests[number[i]], rests[i] = &group.rests[number[i]];
      }
      const uint32_t lanes = triangles.test(few, rests, fine, wanted, exact);
      for (uint32_t i = 0; i < kRays; ++i)
        hit |= uint64_t{((lanes >> (kTriangles * i)) & ((1u << kTriangles) - 1)) != 0} << number[i];
    } while (m != 0);
  }
  return hit;
}

/// Tests the rays at `at`, `at` + 1, ... of a group, one per lane, against one triangle of a batch. Returns the lanes
/// with a hit, as a bit mask.
/// @param axis Woop's (kx, ky, kz), which all wanted rays share
template <typename WideLanes, bool kUseResidual, typename Fine>
inline uint32_t test_rays(const DecodedBatch& batch, const BatchNormals& normals, uint32_t triangle,
                          const RayGroup& group, const uint32_t (&axis)[3], uint32_t at, Fine fine, uint32_t wanted,
                          LaneHits<WideLanes>& hits, uint64_t& exact_count) {
  const auto vertex = [&](uint32_t k, uint32_t corner) {
    return WideLanes::set(batch.vertex[axis[k]][corner][triangle]);
  };
  const auto origin = [&](uint32_t k) { return WideLanes::load(&group.origin[axis[k]][at]); };
  const auto normal = [&](uint32_t k) { return WideLanes::set(normals.normal[axis[k]][triangle]); };
  const auto rest = [&](uint32_t k) { return WideLanes::load(&group.rest[axis[k]][at]); };
  const RayLanes<WideLanes> lanes{{WideLanes::load(&group.shear[0][at]), WideLanes::load(&group.shear[1][at]),
                                   WideLanes::load(&group.shear[2][at])},
                                  WideLanes::load(&group.begin[at]),
                                  WideLanes::load(&group.end[at])};
  return test_lanes<WideLanes, true, kUseResidual>(vertex, origin, normal, rest, lanes, fine, wanted, hits,
                                                   exact_count);
}

/// Minimum number of rays for which a leaf test that needs t, u and v first finds the rays that hit (rays_that_hit())
/// and then computes the hits of those rays alone.
constexpr uint32_t kMinPrefilteredRays = 4;

/// Reads Woop's (kx, ky, kz) of the wanted rays. Returns false if they differ between rays.
template <typename WideLanes>
inline bool same_axes(const RayGroup& group, uint32_t at, uint32_t wanted, uint32_t (&axis)[3]) {
  const uint32_t first = at + static_cast<uint32_t>(__builtin_ctz(wanted));
  for (uint32_t k = 0; k < 3; ++k) axis[k] = group.axis[k][first];
  return (WideLanes::equal(&group.axis[2][at], axis[2]) & wanted) == wanted;
}

/// Returns the rays of the bit mask `rays` that hit a triangle of a batch. The test of one ray does not depend on the
/// result of another.
/// @param fine as in test_lanes()
/// @param exact incremented by the number of lanes that were evaluated in doubles
template <typename Lanes, bool kUseResidual, typename Fine>
inline uint64_t rays_that_hit(const DecodedBatch& batch, const BatchNormals& normals, const RayGroup& group,
                              uint64_t rays, Fine fine, uint64_t& exact) {
  using WideLanes = typename Lanes::WideLanes;
  constexpr bool kWide = WideLanes::kLanes > Lanes::kLanes; // whether a register holds several rays
  static_assert(kWide || !kUseResidual, "only wide registers filter nearest hits");
  if constexpr (!kUseResidual)
    if (!kWide || count_ones(rays) <= kFewRays) {
      uint64_t hit = 0;
      for (; rays != 0; rays &= rays - 1) {
        const uint32_t ray = first_bit(rays);
        hit |= uint64_t{test_one_ray<Lanes>(batch, normals, group, ray, fine, exact)} << ray;
      }
      return hit;
    }
  if constexpr (kWide)
    return batch.count <= 4 ? test_several_rays<WideLanes, 4, kUseResidual>(batch, normals, group, rays, fine, exact)
                            : test_several_rays<WideLanes, 8, kUseResidual>(batch, normals, group, rays, fine, exact);
}

} // namespace
} // namespace packtrace::packed
