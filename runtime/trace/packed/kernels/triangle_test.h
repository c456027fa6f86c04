#pragma once

#include "runtime/trace/packed/kernels/ray_group.h"

/// Eight triangles against a ray: Woop, Benthin, Wald, "Watertight ray/triangle intersection" (2013), with exact signs.
///
/// Vertices move so that the ray starts at the origin and are sheared so that it runs along z: a vertex's x and y
/// depend on the vertex and the ray only, so triangles that share it agree. What is decided then is whether the origin
/// lies in the projected triangle, edges included, and that is decided exactly: the sign of an edge function p x q is
/// taken from floats only where |p x q| is above its rounding error, and else from doubles, in which products of two
/// floats are exact and their difference has the right sign.
///
/// So no ray passes a closed mesh. Move the origin by less than any given distance to a place on no projected edge:
/// there the triangles in front and behind, those that project to nothing left out, cover it as the exact plane mesh
/// does. There are finitely many, so one of them covers places arbitrarily near the origin, and as triangles here are
/// closed it covers the origin itself. That is also why triangles that project to nothing may be skipped.
namespace packtrace::packed {
namespace {

/// Far above the 2^-24 that two roundings need: weights of hits near edges become exact enough, too.
constexpr float kEdgeError = 0x1p-18f;
constexpr float kSmallestEdge = 0x1p-100f; ///< products below may have lost bits to underflow

/// Of one lane each.
template <typename Lanes>
struct LaneHits {
  alignas(64) float t[Lanes::kLanes], u[Lanes::kLanes], v[Lanes::kLanes];
};

/// The lanes whose signs floats do not settle. Returns those of `lanes` that hit at all, with their t, u and v. t is
/// the plane's, as for all other lanes: the weights of a large or thin triangle would move it along the ray by the
/// rounding of the far corners. Where the ray is nearly parallel to the plane, t is kept within the range of the
/// corners.
/// @param x, y, z of corners, sz: lanes
/// @param depth, along: the ray meets the plane at z = depth / along
template <typename Lanes>
inline uint32_t test_exactly(uint32_t lanes, const typename Lanes::F (&x)[3], const typename Lanes::F (&y)[3],
                             const typename Lanes::F (&z)[3], typename Lanes::F sz, typename Lanes::F depth,
                             typename Lanes::F along, LaneHits<Lanes>& hits) {
  float stored[12][Lanes::kLanes];
  for (uint32_t corner = 0; corner < 3; ++corner) {
    Lanes::store(stored[corner], x[corner]);
    Lanes::store(stored[3 + corner], y[corner]);
    Lanes::store(stored[6 + corner], z[corner]);
  }
  Lanes::store(stored[9], sz);
  Lanes::store(stored[10], depth);
  Lanes::store(stored[11], along);
  uint32_t hit = 0;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<uint32_t>(__builtin_ctz(lanes));
    const double ax = stored[0][i], ay = stored[3][i], bx = stored[1][i], by = stored[4][i], cx = stored[2][i],
                 cy = stored[5][i];
    const double u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax;
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) continue;
    const double sum = u + v + w;
    if (sum == 0.0) continue;
    const double az = stored[6][i], bz = stored[7][i], cz = stored[8][i];
    const double least = __builtin_fmin(az, __builtin_fmin(bz, cz)), most = __builtin_fmax(az, __builtin_fmax(bz, cz));
    double at = stored[11][i] != 0.0f ? double{stored[10][i]} / stored[11][i] : (u * az + v * bz + w * cz) / sum;
    at = at < least ? least : at > most ? most : at;
    hits.t[i] = static_cast<float>(at * double{stored[9][i]});
    hits.u[i] = static_cast<float>(v / sum);
    hits.v[i] = static_cast<float>(w / sum);
    hit |= 1u << i;
  }
  return hit;
}

/// What a test needs of rays; lanes are triangles of one ray, or rays.
template <typename Lanes>
struct RayLanes {
  typename Lanes::F shear[3], begin, end; ///< hits lie in (begin, end]
};

/// Of a batch's triangles, as far as no ray matters.
struct BatchNormals {
  alignas(64) float normal[3][kBatch]; ///< [axis][triangle]
};

/// a b - c d with an error of 2^-23 of the result at most. Source: Jeannerod, Louvet, Muller, "Further analysis of
/// Kahan's algorithm for the accurate computation of 2x2 determinants" (2013).
template <typename Lanes>
inline typename Lanes::F difference_of_products(typename Lanes::F a, typename Lanes::F b, typename Lanes::F c,
                                                typename Lanes::F d) {
  const typename Lanes::F cd = Lanes::mul(c, d);
  return Lanes::add(Lanes::fms(a, b, cd), Lanes::fnma(c, d, cd));
}

/// Largest coordinate of a tree whose vertices have exact differences: they are whole numbers.
constexpr float kExactDifferences = 0x1p23f;

/// Normals of triangles whose vertices have exact differences, each component within 2^-23 of its value. Rounding the
/// products would tilt a thin triangle's plane by up to 2^-24 of its length over its height, and rays that start above
/// it would meet it far from where they started.
template <typename Lanes>
inline BatchNormals batch_normals(const DecodedBatch& batch) {
  using F = typename Lanes::F;
  F e[3], f[3];
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const F a = Lanes::load(batch.vertex[axis][0]);
    e[axis] = Lanes::sub(Lanes::load(batch.vertex[axis][1]), a);
    f[axis] = Lanes::sub(Lanes::load(batch.vertex[axis][2]), a);
  }
  BatchNormals out;
  Lanes::store(out.normal[0], difference_of_products<Lanes>(e[1], f[2], e[2], f[1]));
  Lanes::store(out.normal[1], difference_of_products<Lanes>(e[2], f[0], e[0], f[2]));
  Lanes::store(out.normal[2], difference_of_products<Lanes>(e[0], f[1], e[1], f[0]));
  return out;
}

/// The same of any triangles, in doubles: their differences have up to 31 bits and the products cancel to 2^-53 of
/// themselves.
[[gnu::noinline]] inline void batch_normals_of_large(const DecodedBatch& batch, BatchNormals& out) {
  for (uint32_t i = 0; i < kBatch; ++i) {
    double e[3], f[3];
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double a = batch.vertex[axis][0][i];
      e[axis] = batch.vertex[axis][1][i] - a, f[axis] = batch.vertex[axis][2][i] - a;
    }
    out.normal[0][i] = static_cast<float>(e[1] * f[2] - e[2] * f[1]);
    out.normal[1][i] = static_cast<float>(e[2] * f[0] - e[0] * f[2]);
    out.normal[2][i] = static_cast<float>(e[0] * f[1] - e[1] * f[0]);
  }
}

/// The lanes in which a ray hits a triangle, as bits. Without a branch that often goes either way until one does.
/// @tparam kWeights whether hits are filled; else only which lanes hit is wanted
/// @tparam kRest whether planes are met from origins as they were before they were rounded
/// @param relative (k, corner): the corner's coordinate along Woop's axis k less the origin's
/// @param normal (k): of the triangle's plane, along Woop's axis k
/// @param rest (k): what rounding took from the origin, along Woop's axis k
/// @param wanted lanes, as bits
/// @param exact_count counts lanes that took doubles
template <typename Lanes, bool kWeights, bool kRest, typename Relative, typename Normal, typename Rest>
inline uint32_t test_lanes(Relative relative, Normal normal, Rest rest, const RayLanes<Lanes>& rays, uint32_t wanted,
                           LaneHits<Lanes>& hits, uint64_t& exact_count) {
  using F = typename Lanes::F;
  const F sx = rays.shear[0], sy = rays.shear[1];
  // t comes from the plane rather than from the weights: what vertices have along an axis that the plane is
  // perpendicular to is then all that counts, which is what ray offsets rely on. Where t is wanted, what rounding took
  // from the origin counts, too: along a grazing ray it is many times what it is along the normal.
  F x[3], y[3], z[3], depth = Lanes::set(0.0f);
  for (uint32_t corner = 0; corner < 3; ++corner) {
    const F p = relative(0, corner), q = relative(1, corner);
    z[corner] = relative(2, corner);
    if (corner == 0) depth = Lanes::fma(p, normal(0), Lanes::fma(q, normal(1), Lanes::mul(z[0], normal(2))));
    x[corner] = Lanes::fnma(sx, z[corner], p);
    y[corner] = Lanes::fnma(sy, z[corner], q);
  }
  const F u2 = Lanes::mul(y[2], x[1]), v2 = Lanes::mul(y[0], x[2]), w2 = Lanes::mul(y[1], x[0]);
  const F u = Lanes::fms(x[2], y[1], u2), v = Lanes::fms(x[0], y[2], v2), w = Lanes::fms(x[1], y[0], w2);
  const F least = Lanes::min(Lanes::min(u, v), w), most = Lanes::max(Lanes::max(u, v), w);
  // p q' - q p' is off by at most 2^-24 (|q p'| + |result|), so its sign is right where it is larger than the error.
  const F error =
      Lanes::fma(Lanes::largest(Lanes::largest(u2, v2), w2), Lanes::set(kEdgeError), Lanes::set(kSmallestEdge));
  const F below = Lanes::negate(error);
  const uint32_t inside = (Lanes::less(error, least) | Lanes::less(most, below)) & wanted;
  uint32_t unsure = (Lanes::less_equal(below, least) | Lanes::less_equal(most, error)) & wanted & ~inside;
  if constexpr (kWeights)
    if ((inside | unsure) == 0) return 0;
  if constexpr (kRest)
    depth = Lanes::sub(depth,
                       Lanes::fma(rest(0), normal(0), Lanes::fma(rest(1), normal(1), Lanes::mul(rest(2), normal(2)))));
  const F along = Lanes::fma(sx, normal(0), Lanes::fma(sy, normal(1), normal(2))), zero = Lanes::set(0.0f);
  // Rounding the sheared corners may open a sliver that has no plane, or one that the ray runs along.
  unsure |= inside & Lanes::less_equal(along, zero) & Lanes::less_equal(zero, along);
  F t = Lanes::mul(Lanes::div(depth, along), rays.shear[2]);
  uint32_t hit = inside & ~unsure & Lanes::less(rays.begin, t) & Lanes::less_equal(t, rays.end);
  if constexpr (kWeights) {
    if ((hit | unsure) == 0) return 0;
    const F over = Lanes::div(Lanes::set(1.0f), Lanes::add(Lanes::add(u, v), w));
    Lanes::store(hits.u, Lanes::mul(v, over));
    Lanes::store(hits.v, Lanes::mul(w, over));
    Lanes::store(hits.t, t);
  }
  if (unsure != 0) {
    exact_count += static_cast<uint64_t>(__builtin_popcount(unsure));
    const uint32_t exactly = test_exactly<Lanes>(unsure, x, y, z, rays.shear[2], depth, along, hits);
    t = Lanes::load(hits.t);
    hit |= exactly & Lanes::less(rays.begin, t) & Lanes::less_equal(t, rays.end);
  }
  return hit;
}

} // namespace
} // namespace packtrace::packed
