#pragma once

#include "runtime/trace/packed/ray_group.h"

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

/// Far above the 2^-23 that three roundings need: weights of hits near edges become exact enough, too.
constexpr float kEdgeError = 0x1p-18f;
constexpr float kSmallestEdge = 0x1p-100f; ///< products below may have lost bits to underflow

/// Of one lane each.
template <typename Lanes>
struct LaneHits {
  alignas(64) float t[Lanes::kLanes], u[Lanes::kLanes], v[Lanes::kLanes];
};

/// The lanes whose signs floats do not settle. Returns those of `lanes` that hit at all, with their t, u and v.
/// @param x, y, z of corners, sz: stored lanes
template <typename Lanes>
inline uint32_t test_exactly(uint32_t lanes, const typename Lanes::F (&x)[3], const typename Lanes::F (&y)[3],
                             const typename Lanes::F (&z)[3], typename Lanes::F sz, LaneHits<Lanes>& hits) {
  float stored[10][Lanes::kLanes];
  for (uint32_t corner = 0; corner < 3; ++corner) {
    Lanes::store(stored[corner], x[corner]);
    Lanes::store(stored[3 + corner], y[corner]);
    Lanes::store(stored[6 + corner], z[corner]);
  }
  Lanes::store(stored[9], sz);
  uint32_t hit = 0;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<uint32_t>(__builtin_ctz(lanes));
    const double ax = stored[0][i], ay = stored[3][i], bx = stored[1][i], by = stored[4][i], cx = stored[2][i],
                 cy = stored[5][i];
    const double u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax;
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) continue;
    const double sum = u + v + w;
    if (sum == 0.0) continue;
    hits.t[i] = static_cast<float>((u * double{stored[6][i]} + v * double{stored[7][i]} + w * double{stored[8][i]}) /
                                   sum * double{stored[9][i]});
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

/// The lanes in which a ray hits a triangle, as bits.
/// @param relative (k, corner): the corner's coordinate along Woop's axis k less the origin's
/// @param wanted lanes, as bits
/// @param exact_count counts lanes that took doubles
template <typename Lanes, typename Relative>
inline uint32_t test_lanes(Relative relative, const RayLanes<Lanes>& rays, uint32_t wanted, LaneHits<Lanes>& hits,
                           uint64_t& exact_count) {
  using F = typename Lanes::F;
  const F sx = rays.shear[0], sy = rays.shear[1];
  F x[3], y[3], z[3];
  for (uint32_t corner = 0; corner < 3; ++corner) {
    z[corner] = relative(2, corner);
    x[corner] = Lanes::fnma(sx, z[corner], relative(0, corner));
    y[corner] = Lanes::fnma(sy, z[corner], relative(1, corner));
  }
  const F u1 = Lanes::mul(x[2], y[1]), v1 = Lanes::mul(x[0], y[2]), w1 = Lanes::mul(x[1], y[0]);
  const F u = Lanes::sub(u1, Lanes::mul(y[2], x[1])), v = Lanes::sub(v1, Lanes::mul(y[0], x[2])),
          w = Lanes::sub(w1, Lanes::mul(y[1], x[0]));
  const F least = Lanes::min(Lanes::min(u, v), w), most = Lanes::max(Lanes::max(u, v), w);
  // |p q' - q p'| is off by at most 2^-23 of the larger product, which is at most |p q'| + |result| (1 + 2^-22).
  const F error = Lanes::fma(Lanes::max(Lanes::max(Lanes::abs(u1), Lanes::abs(v1)), Lanes::abs(w1)),
                             Lanes::set(kEdgeError), Lanes::set(kSmallestEdge));
  const F below = Lanes::negate(error);
  const uint32_t maybe = (Lanes::less_equal(below, least) | Lanes::less_equal(most, error)) & wanted;
  if (maybe == 0) return 0;

  uint32_t hit = maybe & (Lanes::less(error, least) | Lanes::less(most, below));
  const F over = Lanes::div(Lanes::set(1.0f), Lanes::add(Lanes::add(u, v), w));
  // From the plane rather than from the weights: what vertices have along an axis that the plane is perpendicular to is
  // then all that counts, which is what ray offsets rely on.
  const F px = relative(0, 0), py = relative(1, 0);
  const F ex = Lanes::sub(relative(0, 1), px), ey = Lanes::sub(relative(1, 1), py), ez = Lanes::sub(z[1], z[0]);
  const F fx = Lanes::sub(relative(0, 2), px), fy = Lanes::sub(relative(1, 2), py), fz = Lanes::sub(z[2], z[0]);
  const F nx = Lanes::sub(Lanes::mul(ey, fz), Lanes::mul(ez, fy)),
          ny = Lanes::sub(Lanes::mul(ez, fx), Lanes::mul(ex, fz)),
          nz = Lanes::sub(Lanes::mul(ex, fy), Lanes::mul(ey, fx));
  const F along = Lanes::fma(sx, nx, Lanes::fma(sy, ny, nz));
  const F depth = Lanes::fma(px, nx, Lanes::fma(py, ny, Lanes::mul(z[0], nz)));
  Lanes::store(hits.t, Lanes::mul(Lanes::div(depth, along), rays.shear[2]));
  Lanes::store(hits.u, Lanes::mul(v, over));
  Lanes::store(hits.v, Lanes::mul(w, over));
  if (const uint32_t unsure = maybe & ~hit; unsure != 0) {
    exact_count += static_cast<uint64_t>(__builtin_popcount(unsure));
    hit |= test_exactly<Lanes>(unsure, x, y, z, rays.shear[2], hits);
  }
  const F t = Lanes::load(hits.t);
  return hit & Lanes::less(rays.begin, t) & Lanes::less_equal(t, rays.end);
}

/// The triangles of a batch that a ray hits, as bits.
template <typename Lanes>
inline uint32_t test_triangles(const DecodedBatch& batch, const RayGroup& group, uint32_t ray, LaneHits<Lanes>& hits,
                               uint64_t& exact_count) {
  const uint32_t axis[3] = {group.axis[0][ray], group.axis[1][ray], group.axis[2][ray]};
  const auto relative = [&](uint32_t k, uint32_t corner) {
    return Lanes::sub(Lanes::load(batch.vertex[axis[k]][corner]), Lanes::set(group.origin[axis[k]][ray]));
  };
  const RayLanes<Lanes> lanes{
      {Lanes::set(group.shear[0][ray]), Lanes::set(group.shear[1][ray]), Lanes::set(group.shear[2][ray])},
      Lanes::set(group.limits[ray][0]),
      Lanes::set(group.tmax(ray))};
  return test_lanes<Lanes>(relative, lanes, (1u << batch.count) - 1, hits, exact_count);
}

} // namespace
} // namespace packtrace::packed
