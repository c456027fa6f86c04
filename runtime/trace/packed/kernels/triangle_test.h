#pragma once

#include "runtime/trace/packed/kernels/ray_group.h"

/// Watertight ray/triangle test on SIMD lanes. Source: Woop, Benthin, Wald, "Watertight ray/triangle intersection"
/// (2013); here the signs of edge functions are exact.
///
/// Vertices are translated so that the ray starts at the origin and sheared so that it runs along z. A vertex's sheared
/// x and y depend on the vertex and the ray only, so triangles that share a vertex agree on them. What remains is to
/// decide whether the origin lies in the projected triangle, edges included, and this is decided exactly: the sign of
/// an edge function p x q is taken from floats only if |p x q| is above its rounding error. Otherwise it is evaluated
/// in doubles, in which products of two floats are exact and their difference has the right sign.
///
/// Sheared coordinates are rounded to floats, which moves the corners of a triangle by up to 2^-22 of its distance and
/// size. In trees with fine grids (kFineGrid) this may exceed the thickness of a needle, and a ray that starts
/// just beside one of its edges would hit the triangle on the other side of that edge. There the sign must also exceed
/// the effect of that rounding, and otherwise sheared coordinates are computed in doubles (shear_exactly()).
///
/// Therefore no ray passes through a closed mesh. Proof: move the origin by less than a given distance to a point on no
/// projected edge. There the triangles in front and behind, without those of zero projected area, cover it as the exact
/// plane mesh does. The number of triangles is finite, so one of them covers points arbitrarily near the origin; as
/// triangles are closed, it covers the origin itself. For the same reason triangles of zero projected area may be
/// skipped.
namespace packtrace::packed {
namespace {

/// Relative error bound of edge functions. Two roundings need only 2^-24; the larger bound keeps u and v of hits near
/// edges accurate as well.
constexpr float kEdgeError = 0x1p-18f;
constexpr float kSmallestEdge = 0x1p-100f; ///< smaller products may have lost bits to underflow

/// Hits, one per lane.
template <typename Lanes>
struct LaneHits {
  alignas(64) float t[Lanes::kLanes], u[Lanes::kLanes], v[Lanes::kLanes];
};

/// Sheared corners of a triangle, and the height of corner 0 above the ray's origin along the plane's normal.
struct ShearedCorners {
  double x[3], y[3], z[3], depth;
};

/// Returns a b - c d with its exact sign. Source: see difference_of_products().
inline double exact_difference(double a, double b, double c, double d) {
  const double cd = c * d;
  return __builtin_fma(a, b, -cd) + __builtin_fma(-c, d, cd);
}

/// Tests in doubles the lanes whose signs floats cannot decide. Returns the lanes that hit, as a bit mask, with their
/// t, u and v. Here, too, t comes from the triangle's plane: weights of the corners of a large or thin triangle would
/// move it along the ray by the corners' rounding errors. For rays nearly parallel to the plane, t is clamped to the
/// range of the corners.
/// @param lanes bit mask of the lanes to test
/// @param corners function of a lane that returns its ShearedCorners
/// @param sz Woop's Sz
/// @param along the ray meets the plane at z = depth / along
template <typename Lanes, typename Corners>
inline uint32_t test_exactly(uint32_t lanes, Corners corners, typename Lanes::F sz, typename Lanes::F along,
                             LaneHits<Lanes>& hits) {
  float stored[2][Lanes::kLanes];
  Lanes::store(stored[0], sz);
  Lanes::store(stored[1], along);
  uint32_t hit = 0;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<uint32_t>(__builtin_ctz(lanes));
    const ShearedCorners at_lane = corners(i);
    const auto& [x, y, z, depth] = at_lane;
    const double u = exact_difference(x[2], y[1], y[2], x[1]), v = exact_difference(x[0], y[2], y[0], x[2]),
                 w = exact_difference(x[1], y[0], y[1], x[0]);
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) continue;
    const double sum = u + v + w;
    if (sum == 0.0) continue;
    const double least = __builtin_fmin(z[0], __builtin_fmin(z[1], z[2])),
                 most = __builtin_fmax(z[0], __builtin_fmax(z[1], z[2]));
    double at = stored[1][i] != 0.0f ? depth / stored[1][i] : (u * z[0] + v * z[1] + w * z[2]) / sum;
    at = at < least ? least : at > most ? most : at;
    hits.t[i] = static_cast<float>(at * double{stored[0][i]});
    hits.u[i] = static_cast<float>(v / sum);
    hits.v[i] = static_cast<float>(w / sum);
    hit |= 1u << i;
  }
  return hit;
}

/// Per-lane ray data of a test. Lanes hold either copies of one ray or different rays.
template <typename Lanes>
struct RayLanes {
  typename Lanes::F shear[3], begin, end; ///< hits lie in (begin, end]
};

/// Unnormalised plane normals of a batch's triangles.
struct BatchNormals {
  alignas(64) float normal[3][kBatch]; ///< [axis][triangle]
};

/// Returns a b - c d with a relative error of at most 2^-23. Source: Jeannerod, Louvet, Muller, "Further analysis of
/// Kahan's algorithm for the accurate computation of 2x2 determinants" (2013).
template <typename Lanes>
inline typename Lanes::F difference_of_products(typename Lanes::F a, typename Lanes::F b, typename Lanes::F c,
                                                typename Lanes::F d) {
  const typename Lanes::F cd = Lanes::mul(c, d);
  return Lanes::add(Lanes::fms(a, b, cd), Lanes::fnma(c, d, cd));
}

/// Up to this coordinate, differences of vertices are exact in floats, because vertices are integers.
constexpr float kExactDifferences = 0x1p23f;
/// From this coordinate on, rounding moves sheared corners by half a grid step and more.
constexpr float kFineGrid = 0x1p21f;

/// Whether coordinates of a tree exceed kFineGrid. A type, so that tests in usual trees are compiled without doubles.
template <bool kFine>
struct FineGrid {
  static constexpr bool value = kFine;
};

/// Returns plane normals of triangles whose vertex differences are exact in floats (kExactDifferences). The relative
/// error per component is at most 2^-23. A plain float cross product would tilt a thin triangle's plane by up to 2^-24
/// of its length over its height, and rays that start just above it would hit it far from their origins.
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

/// Computes normals of arbitrary triangles in doubles: vertex differences have up to 31 bits, and the cross product has
/// a rounding error of 2^-53 of its products.
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

/// Returns a function of the lane that reads the ShearedCorners that test_lanes() computed in floats.
template <typename Lanes>
inline auto stored_corners(const typename Lanes::F (&x)[3], const typename Lanes::F (&y)[3],
                           const typename Lanes::F (&z)[3], typename Lanes::F depth,
                           float (&stored)[10][Lanes::kLanes]) {
  for (uint32_t corner = 0; corner < 3; ++corner) {
    Lanes::store(stored[corner], x[corner]);
    Lanes::store(stored[3 + corner], y[corner]);
    Lanes::store(stored[6 + corner], z[corner]);
  }
  Lanes::store(stored[9], depth);
  return [&stored](uint32_t i) {
    return ShearedCorners{{stored[0][i], stored[1][i], stored[2][i]},
                          {stored[3][i], stored[4][i], stored[5][i]},
                          {stored[6][i], stored[7][i], stored[8][i]},
                          stored[9][i]};
  };
}

/// Returns a function of the lane that computes its ShearedCorners in doubles. As in floats, a sheared corner depends
/// on the corner and the ray only.
/// @param vertex, origin, normal, rest as in test_lanes()
template <typename Lanes, bool kUseResidual, typename Vertex, typename Origin, typename Normal, typename Rest>
inline auto shear_exactly(Vertex vertex, Origin origin, Normal normal, Rest rest, const RayLanes<Lanes>& rays,
                          float (&stored)[20][Lanes::kLanes]) {
  for (uint32_t k = 0; k < 3; ++k) {
    for (uint32_t corner = 0; corner < 3; ++corner) Lanes::store(stored[3 * k + corner], vertex(k, corner));
    Lanes::store(stored[9 + k], origin(k));
    Lanes::store(stored[12 + k], normal(k));
    Lanes::store(stored[15 + k], kUseResidual ? rest(k) : Lanes::set(0.0f));
  }
  Lanes::store(stored[18], rays.shear[0]);
  Lanes::store(stored[19], rays.shear[1]);
  return [&stored](uint32_t i) {
    const auto from_origin = [&](uint32_t k, uint32_t corner) {
      return double{stored[3 * k + corner][i]} - stored[9 + k][i];
    };
    ShearedCorners out;
    for (uint32_t corner = 0; corner < 3; ++corner) {
      out.z[corner] = from_origin(2, corner);
      out.x[corner] = from_origin(0, corner) - double{stored[18][i]} * out.z[corner];
      out.y[corner] = from_origin(1, corner) - double{stored[19][i]} * out.z[corner];
    }
    out.depth = 0.0;
    for (uint32_t k = 0; k < 3; ++k) out.depth += (from_origin(k, 0) - stored[15 + k][i]) * stored[12 + k][i];
    return out;
  };
}

/// Returns a bound of the error of edge functions p x q that comes from rounding the sheared corners to floats. Each
/// coordinate has an error of at most 4.1 u R, where u = 2^-24 and R is the largest coordinate of a corner relative to
/// the origin; sheared coordinates are at most X. So p x q changes by at most 16.4 u R X + 34 u^2 R^2.
/// @param relative as in test_lanes()
template <typename Lanes, typename Relative>
inline typename Lanes::F shear_error(Relative relative, const typename Lanes::F (&x)[3],
                                     const typename Lanes::F (&y)[3]) {
  using F = typename Lanes::F;
  F reach = Lanes::set(0.0f), sheared = Lanes::set(0.0f);
  for (uint32_t corner = 0; corner < 3; ++corner) {
    for (uint32_t k = 0; k < 3; ++k) reach = Lanes::largest(reach, relative(k, corner));
    sheared = Lanes::max(sheared, Lanes::largest(x[corner], y[corner]));
  }
  return Lanes::mul(reach, Lanes::fma(sheared, Lanes::set(0x1p-19f), Lanes::mul(reach, Lanes::set(0x1p-40f))));
}

/// Returns the lanes in which rounding may decide on which side of the plane a ray starts, as a bit mask.
/// @param relative, normal as in test_lanes()
template <typename Lanes, typename Relative, typename Normal>
inline uint32_t starts_near_plane(Relative relative, Normal normal, typename Lanes::F depth) {
  typename Lanes::F size = Lanes::set(0.0f);
  for (uint32_t k = 0; k < 3; ++k) size = Lanes::add(size, Lanes::abs(Lanes::mul(relative(k, 0), normal(k))));
  return Lanes::less_equal(Lanes::abs(depth), Lanes::mul(size, Lanes::set(0x1p-20f)));
}

/// Returns the lanes in which a ray hits a triangle, as a bit mask. Avoids unpredictable branches until a lane hits.
/// @tparam kWeights whether hits are filled in; otherwise only the lanes are computed
/// @param relative function of (k, corner) that returns the corner's coordinate along Woop's axis k, less the origin's
/// @param height function that returns height_along()
/// @param residual function that returns a height less residual_along()
/// @param normal function of k that returns the plane normal's component along Woop's axis k
/// @param exact function of (lanes, x, y, z, depth, along) that calls test_exactly() and returns its result
/// @tparam Fine FineGrid<true> if the tree's grid is so fine that sheared corners need doubles near edges, else
/// FineGrid<false>
/// @param wanted bit mask of the lanes to test
/// @param exact_count incremented by the number of lanes that were evaluated in doubles
template <typename Lanes, bool kWeights, typename Relative, typename Height, typename Residual, typename Normal,
          typename Exact, typename Fine>
[[gnu::always_inline]] inline uint32_t test_relative(Relative relative, Height height, Residual residual, Normal normal,
                                                     Exact exact, const RayLanes<Lanes>& rays, Fine, uint32_t wanted,
                                                     LaneHits<Lanes>& hits, uint64_t& exact_count) {
  using F = typename Lanes::F;
  const F sx = rays.shear[0], sy = rays.shear[1];
  F x[3], y[3], z[3];
  for (uint32_t corner = 0; corner < 3; ++corner) {
    z[corner] = relative(2, corner);
    x[corner] = Lanes::fnma(sx, z[corner], relative(0, corner));
    y[corner] = Lanes::fnma(sy, z[corner], relative(1, corner));
  }
  const F u2 = Lanes::mul(y[2], x[1]), v2 = Lanes::mul(y[0], x[2]), w2 = Lanes::mul(y[1], x[0]);
  const F u = Lanes::fms(x[2], y[1], u2), v = Lanes::fms(x[0], y[2], v2), w = Lanes::fms(x[1], y[0], w2);
  const F least = Lanes::min(Lanes::min(u, v), w), most = Lanes::max(Lanes::max(u, v), w);
  // p q' - q p' has an error of at most 2^-24 (|q p'| + |result|), so its sign is right where its magnitude is above
  // that error.
  F error = Lanes::fma(Lanes::largest(Lanes::largest(u2, v2), w2), Lanes::set(kEdgeError), Lanes::set(kSmallestEdge));
  if constexpr (Fine::value) error = Lanes::add(error, shear_error<Lanes>(relative, x, y));
  const F below = Lanes::negate(error);
  const uint32_t inside = (Lanes::less(error, least) | Lanes::less(most, below)) & wanted;
  uint32_t unsure = (Lanes::less_equal(below, least) | Lanes::less_equal(most, error)) & wanted & ~inside;
  if constexpr (kWeights)
    if ((inside | unsure) == 0) return 0;
  const F depth = residual(height());
  const F along = Lanes::fma(sx, normal(0), Lanes::fma(sy, normal(1), normal(2))), zero = Lanes::set(0.0f);
  // Rounding the sheared corners may give area to a sliver that has no plane or whose plane contains the ray's
  // direction.
  unsure |= inside & Lanes::less_equal(along, zero) & Lanes::less_equal(zero, along);
  if constexpr (Fine::value) unsure |= inside & starts_near_plane<Lanes>(relative, normal, depth);
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
    const uint32_t found = exact(unsure, x, y, z, depth, along);
    t = Lanes::load(hits.t);
    hit |= found & Lanes::less(rays.begin, t) & Lanes::less_equal(t, rays.end);
  }
  return hit;
}

/// Returns the height of a triangle's corner 0 above the ray's origin along the plane's normal, without the origin's
/// rounding error. t comes from the plane rather than from the weights. On a plane perpendicular to an axis, only the
/// coordinates along that axis then contribute, which ray offsets rely on.
template <typename Lanes, typename Relative, typename Normal>
inline typename Lanes::F height_along(Relative relative, Normal normal) {
  return Lanes::fma(relative(0, 0), normal(0),
                    Lanes::fma(relative(1, 0), normal(1), Lanes::mul(relative(2, 0), normal(2))));
}

/// Returns the part of height_along() that comes from rounding the origin. Nearest hits subtract it, because grazing
/// rays magnify it many times.
template <typename Lanes, typename Rest, typename Normal>
inline typename Lanes::F residual_along(Rest rest, Normal normal) {
  return Lanes::fma(rest(0), normal(0), Lanes::fma(rest(1), normal(1), Lanes::mul(rest(2), normal(2))));
}

/// Does the same as test_relative().
/// @tparam kUseResidual whether t counts from the origin before it was rounded to floats
/// @param vertex function of (k, corner) that returns the corner's coordinate along Woop's axis k
/// @param origin function of k that returns the origin's coordinate along Woop's axis k
/// @param rest function of k that returns the origin's rounding error (exact minus rounded) along Woop's axis k
template <typename Lanes, bool kWeights, bool kUseResidual, typename Vertex, typename Origin, typename Normal,
          typename Rest, typename Fine>
inline uint32_t test_lanes(Vertex vertex, Origin origin, Normal normal, Rest rest, const RayLanes<Lanes>& rays,
                           Fine fine, uint32_t wanted, LaneHits<Lanes>& hits, uint64_t& exact_count) {
  using F = typename Lanes::F;
  const auto relative = [&](uint32_t k, uint32_t corner) { return Lanes::sub(vertex(k, corner), origin(k)); };
  const auto residual = [&](F height) {
    if constexpr (!kUseResidual) return height;
    return Lanes::sub(height, residual_along<Lanes>(rest, normal));
  };
  const auto exact = [&](uint32_t lanes, const F(&x)[3], const F(&y)[3], const F(&z)[3], F depth, F along) {
    if constexpr (Fine::value) {
      float stored[20][Lanes::kLanes];
      const auto corners = shear_exactly<Lanes, kUseResidual>(vertex, origin, normal, rest, rays, stored);
      return test_exactly<Lanes>(lanes, corners, rays.shear[2], along, hits);
    } else {
      float stored[10][Lanes::kLanes];
      return test_exactly<Lanes>(lanes, stored_corners<Lanes>(x, y, z, depth, stored), rays.shear[2], along, hits);
    }
  };
  return test_relative<Lanes, kWeights>(
      relative, [&] { return height_along<Lanes>(relative, normal); }, residual, normal, exact, rays, fine, wanted,
      hits, exact_count);
}

} // namespace
} // namespace packtrace::packed
