#pragma once

#include "runtime/trace/packed/batch_strips.h"
#include "runtime/trace/packed/triangle_test.h"

/// The triangles of a batch against the rays that come to their leaf: one ray and eight triangles in a register, two
/// rays and eight triangles, or a triangle and as many rays as there are lanes. All are the same arithmetic.
namespace packtrace::packed {
namespace {

inline uint32_t first_bit(uint64_t word) { return static_cast<uint32_t>(__builtin_ctzll(word)); }

/// The triangles of a batch that a ray hits, as bits.
template <typename Lanes, bool kWeights, bool kRest>
inline uint32_t test_triangles(const DecodedBatch& batch, const BatchNormals& normals, const RayGroup& group,
                               uint32_t ray, LaneHits<Lanes>& hits, uint64_t& exact_count) {
  const uint32_t axis[3] = {group.axis[0][ray], group.axis[1][ray], group.axis[2][ray]};
  const auto relative = [&](uint32_t k, uint32_t corner) {
    return Lanes::sub(Lanes::load(batch.vertex[axis[k]][corner]), Lanes::set(group.origin[axis[k]][ray]));
  };
  const auto normal = [&](uint32_t k) { return Lanes::load(normals.normal[axis[k]]); };
  const auto rest = [&](uint32_t k) { return Lanes::set(group.rest[axis[k]][ray]); };
  const RayLanes<Lanes> lanes{
      {Lanes::set(group.shear[0][ray]), Lanes::set(group.shear[1][ray]), Lanes::set(group.shear[2][ray])},
      Lanes::set(group.begin[ray]),
      Lanes::set(group.end[ray])};
  return test_lanes<Lanes, kWeights, kRest>(relative, normal, rest, lanes, (1u << batch.count) - 1, hits, exact_count);
}

/// Twice the triangles of a batch, in registers of 16 lanes, with the axes of rays whose k begins with k[0].
template <typename Pair, bool kRest>
struct BatchPairs {
  typename Pair::F vertex[3][3], normal[3];
  uint32_t k[3];

  BatchPairs(const DecodedBatch& batch, const BatchNormals& normals, uint32_t first)
      : k{first, first == 2 ? 0 : first + 1, first == 0 ? 2 : first - 1} {
    for (uint32_t i = 0; i < 3; ++i) {
      normal[i] = Pair::twice(normals.normal[k[i]]);
      for (uint32_t corner = 0; corner < 3; ++corner) vertex[i][corner] = Pair::twice(batch.vertex[k[i]][corner]);
    }
  }

  /// The lanes in which two rays hit, eight each.
  uint32_t test(const RayGroup& group, uint32_t a, uint32_t b, uint32_t wanted, uint64_t& exact_count) const {
    const typename Pair::F origin[3] = {Pair::two(group.origin[k[0]], a, b), Pair::two(group.origin[k[1]], a, b),
                                        Pair::two(group.origin[k[2]], a, b)};
    const RayLanes<Pair> lanes{
        {Pair::two(group.shear[0], a, b), Pair::two(group.shear[1], a, b), Pair::two(group.shear[2], a, b)},
        Pair::two(group.begin, a, b),
        Pair::two(group.end, a, b)};
    LaneHits<Pair> hits;
    return test_lanes<Pair, false, kRest>(
        [&](uint32_t i, uint32_t corner) { return Pair::sub(vertex[i][corner], origin[i]); },
        [&](uint32_t i) { return normal[i]; }, [&](uint32_t i) { return Pair::two(group.rest[k[i]], a, b); }, lanes,
        wanted, hits, exact_count);
  }
};

/// The lanes of a register that begins with bit `first` of a word.
template <typename Wide>
inline uint32_t lanes_at(uint64_t rays, uint32_t first) {
  return static_cast<uint32_t>(rays >> first) & ((1u << Wide::kLanes) - 1);
}

/// The rays from lane `at` on that hit one triangle of a batch, as bits from 0 on.
/// @param axis Woop's k, of all that are wanted
template <typename Wide, bool kWeights, bool kRest>
inline uint32_t test_rays(const DecodedBatch& batch, const BatchNormals& normals, uint32_t triangle,
                          const RayGroup& group, const uint32_t (&axis)[3], uint32_t at, uint32_t wanted,
                          LaneHits<Wide>& hits, uint64_t& exact_count) {
  const auto relative = [&](uint32_t k, uint32_t corner) {
    return Wide::sub(Wide::set(batch.vertex[axis[k]][corner][triangle]), Wide::load(&group.origin[axis[k]][at]));
  };
  const auto normal = [&](uint32_t k) { return Wide::set(normals.normal[axis[k]][triangle]); };
  const auto rest = [&](uint32_t k) { return Wide::load(&group.rest[axis[k]][at]); };
  const RayLanes<Wide> lanes{
      {Wide::load(&group.shear[0][at]), Wide::load(&group.shear[1][at]), Wide::load(&group.shear[2][at])},
      Wide::load(&group.begin[at]),
      Wide::load(&group.end[at])};
  return test_lanes<Wide, kWeights, kRest>(relative, normal, rest, lanes, wanted, hits, exact_count);
}

/// Whether two rays fill a register.
template <typename Lanes>
constexpr bool kPairs = Lanes::Wide::kLanes == 2 * kBatch;

/// Rays of nearest hits that come to a leaf, of which those that hit are better found first.
constexpr uint32_t kLeastTestedTwice = 4;

/// Woop's axes of the rays in some lanes. False where they differ.
template <typename Wide>
inline bool same_axes(const RayGroup& group, uint32_t at, uint32_t wanted, uint32_t (&axis)[3]) {
  const uint32_t first = at + static_cast<uint32_t>(__builtin_ctz(wanted));
  for (uint32_t k = 0; k < 3; ++k) axis[k] = group.axis[k][first];
  return (Wide::equal(&group.axis[2][at], axis[2]) & wanted) == wanted;
}

/// Of `rays`, as bits, those that hit a triangle of a batch; nothing depends on what came of one of them.
/// @param exact counts lanes that took doubles
template <typename Lanes, bool kRest>
inline uint64_t rays_that_hit(const DecodedBatch& batch, const BatchNormals& normals, const RayGroup& group,
                              uint64_t rays, uint64_t& exact) {
  using Wide = typename Lanes::Wide;
  uint64_t hit = 0;
  for (uint32_t at = 0; at < kGroup; at += Wide::kLanes) {
    const uint32_t wanted = lanes_at<Wide>(rays, at);
    uint32_t axis[3];
    if (count_ones(wanted) < batch.count || !same_axes<Wide>(group, at, wanted, axis)) continue;
    rays &= ~(uint64_t{wanted} << at);
    LaneHits<Wide> hits;
    for (uint32_t triangle = 0; triangle < batch.count; ++triangle)
      hit |= uint64_t{test_rays<Wide, false, kRest>(batch, normals, triangle, group, axis, at, wanted, hits, exact)}
             << at;
  }
  if constexpr (kPairs<Lanes>) {
    const uint32_t wanted = ((1u << batch.count) - 1) * 0x101u;
    for (uint32_t k = 0; k < 3; ++k) {
      uint64_t m = rays & group.major[k];
      if ((m & (m - 1)) == 0) continue; // no two
      const BatchPairs<Wide, kRest> pairs(batch, normals, k);
      do {
        const uint64_t rest = m & (m - 1);
        const uint32_t lanes = pairs.test(group, first_bit(m), first_bit(rest), wanted, exact);
        hit |= (lanes & 0xffu) != 0 ? m & (0 - m) : 0;
        hit |= (lanes >> 8) != 0 ? rest & (0 - rest) : 0;
        m = rest & (rest - 1);
      } while ((m & (m - 1)) != 0);
      rays = (rays & ~group.major[k]) | m;
    }
  }
  LaneHits<Lanes> hits;
  for (uint64_t m = rays; m != 0; m &= m - 1) {
    const uint32_t lanes = test_triangles<Lanes, false, kRest>(batch, normals, group, first_bit(m), hits, exact);
    hit |= lanes != 0 ? m & (0 - m) : 0;
  }
  return hit;
}

} // namespace
} // namespace packtrace::packed
