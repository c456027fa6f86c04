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

struct BatchHits {
  alignas(32) float t[kBatch], u[kBatch], v[kBatch];
};

/// The lanes whose signs floats do not settle. Returns those of `lanes` that hit at all, with their t, u and v.
inline uint32_t test_exactly(uint32_t lanes, const float (&x)[3][kBatch], const float (&y)[3][kBatch],
                             const float (&z)[3][kBatch], float sz, BatchHits& hits) {
  uint32_t hit = 0;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<uint32_t>(__builtin_ctz(lanes));
    const double ax = x[0][i], ay = y[0][i], bx = x[1][i], by = y[1][i], cx = x[2][i], cy = y[2][i];
    const double u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax;
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) continue;
    const double sum = u + v + w;
    if (sum == 0.0) continue;
    hits.t[i] =
        static_cast<float>((u * double{z[0][i]} + v * double{z[1][i]} + w * double{z[2][i]}) / sum * double{sz});
    hits.u[i] = static_cast<float>(v / sum);
    hits.v[i] = static_cast<float>(w / sum);
    hit |= 1u << i;
  }
  return hit;
}

/// The triangles that the ray hits in (tnear, tmax], as bits.
/// @param exact_count counts triangles that took doubles
template <typename Lanes>
inline uint32_t test_triangles(const DecodedBatch& batch, const RayGroup& group, uint32_t ray, BatchHits& hits,
                               uint64_t& exact_count) {
  using F = typename Lanes::F;
  const auto relative = [&](uint32_t axis, uint32_t corner) {
    return Lanes::sub(Lanes::load(batch.vertex[axis][corner]), Lanes::set(group.origin[axis][ray]));
  };
  const F sx = Lanes::set(group.shear[0][ray]), sy = Lanes::set(group.shear[1][ray]);
  const uint32_t kx = group.axis[0][ray], ky = group.axis[1][ray], kz = group.axis[2][ray];
  F x[3], y[3], z[3];
  for (uint32_t corner = 0; corner < 3; ++corner) {
    z[corner] = relative(kz, corner);
    x[corner] = Lanes::fnma(sx, z[corner], relative(kx, corner));
    y[corner] = Lanes::fnma(sy, z[corner], relative(ky, corner));
  }
  const F u1 = Lanes::mul(x[2], y[1]), v1 = Lanes::mul(x[0], y[2]), w1 = Lanes::mul(x[1], y[0]);
  const F u = Lanes::sub(u1, Lanes::mul(y[2], x[1])), v = Lanes::sub(v1, Lanes::mul(y[0], x[2])),
          w = Lanes::sub(w1, Lanes::mul(y[1], x[0]));
  const F least = Lanes::min(Lanes::min(u, v), w), most = Lanes::max(Lanes::max(u, v), w);
  // |p q' - q p'| is off by at most 2^-23 of the larger product, which is at most |p q'| + |result| (1 + 2^-22).
  const F error = Lanes::fma(Lanes::max(Lanes::max(Lanes::abs(u1), Lanes::abs(v1)), Lanes::abs(w1)),
                             Lanes::set(kEdgeError), Lanes::set(kSmallestEdge));
  const F below = Lanes::negate(error);
  const uint32_t maybe = (Lanes::less_equal(below, least) | Lanes::less_equal(most, error)) & ((1u << batch.count) - 1);
  if (maybe == 0) return 0;

  uint32_t hit = maybe & (Lanes::less(error, least) | Lanes::less(most, below));
  const F over = Lanes::div(Lanes::set(1.0f), Lanes::add(Lanes::add(u, v), w));
  // From the plane rather than from the weights: what vertices have along an axis that the plane is perpendicular to is
  // then all that counts, which is what ray offsets rely on.
  const F px = relative(kx, 0), py = relative(ky, 0);
  const F ex = Lanes::sub(relative(kx, 1), px), ey = Lanes::sub(relative(ky, 1), py), ez = Lanes::sub(z[1], z[0]);
  const F fx = Lanes::sub(relative(kx, 2), px), fy = Lanes::sub(relative(ky, 2), py), fz = Lanes::sub(z[2], z[0]);
  const F nx = Lanes::sub(Lanes::mul(ey, fz), Lanes::mul(ez, fy)),
          ny = Lanes::sub(Lanes::mul(ez, fx), Lanes::mul(ex, fz)),
          nz = Lanes::sub(Lanes::mul(ex, fy), Lanes::mul(ey, fx));
  const F along = Lanes::fma(sx, nx, Lanes::fma(sy, ny, nz));
  const F depth = Lanes::fma(px, nx, Lanes::fma(py, ny, Lanes::mul(z[0], nz)));
  Lanes::store(hits.t, Lanes::mul(Lanes::div(depth, along), Lanes::set(group.shear[2][ray])));
  Lanes::store(hits.u, Lanes::mul(v, over));
  Lanes::store(hits.v, Lanes::mul(w, over));
  if (const uint32_t unsure = maybe & ~hit; unsure != 0) {
    float xs[3][kBatch], ys[3][kBatch], zs[3][kBatch];
    for (uint32_t corner = 0; corner < 3; ++corner) {
      Lanes::store(xs[corner], x[corner]);
      Lanes::store(ys[corner], y[corner]);
      Lanes::store(zs[corner], z[corner]);
    }
    exact_count += static_cast<uint64_t>(__builtin_popcount(unsure));
    hit |= test_exactly(unsure, xs, ys, zs, group.shear[2][ray], hits);
  }
  const F t = Lanes::load(hits.t);
  return hit & Lanes::less(Lanes::set(group.limits[ray][0]), t) & Lanes::less_equal(t, Lanes::set(group.tmax(ray)));
}

} // namespace
} // namespace packtrace::packed
