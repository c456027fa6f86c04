// The bodies of triangle_distances() and nearest_triangle(), compiled per instruction set with the same operations in
// the same order, so results are bit-identical. Functions of other headers that are compiled for AVX2 must be inlined
// and local, as those of lanes.h are.

#include "compress/bake/lod/bound/distance_kernel.h"
#include "compress/bake/lod/simplify/lanes.h"

namespace packtrace {
namespace {

/// Updates `least` with the squared distance from a segment that starts at the origin of p. `along` is dot(p, segment)
/// / |segment|^2.
[[gnu::always_inline]] inline void to_segment(const Vector4& p, const Vector4& segment, const Lanes& along,
                                              Lanes& least) {
  const Lanes zero = {}, one = zero + 1.0;
  Lanes t = along > zero ? along : zero;
  t = t < one ? t : one;
  const Vector4 d = {p.x - t * segment.x, p.y - t * segment.y, p.z - t * segment.z};
  Lanes distance2;
  dot(d, d, distance2);
  least = distance2 < least ? distance2 : least;
}

[[gnu::always_inline]] inline void distances_to_block(const double* points, uint64_t point_count,
                                                      const TriangleBlock& block, double* const* out, uint64_t at) {
  const Lanes zero = {}, one = zero + 1.0;
  const Vector4 a = load(block.a), ab = load(block.ab), ac = load(block.ac);
  const Vector4 bc = {ac.x - ab.x, ac.y - ab.y, ac.z - ab.z};
  Lanes d00, d01, d11, dbc;
  dot(ab, ab, d00), dot(ab, ac, d01), dot(ac, ac, d11), dot(bc, bc, dbc);
  const Lanes area2 = d00 * d11 - d01 * d01, flat = 1e-12 * d00 * d11;
  const Lanes over_ab = one / (d00 > zero ? d00 : one), over_ac = one / (d11 > zero ? d11 : one);
  const Lanes over_bc = one / (dbc > zero ? dbc : one), scale = one / (area2 > zero ? area2 : one);
  for (uint64_t i = 0; i < point_count; ++i) {
    const double* point = points + 3 * i;
    const Vector4 ap = {point[0] - a.x, point[1] - a.y, point[2] - a.z};
    const Vector4 bp = {ap.x - ab.x, ap.y - ab.y, ap.z - ab.z};
    Lanes p0, p1, pbc;
    dot(ap, ab, p0), dot(ap, ac, p1), dot(bp, bc, pbc);
    Lanes distance2 = zero + __builtin_inf();
    to_segment(ap, ab, p0 * over_ab, distance2);
    to_segment(ap, ac, p1 * over_ac, distance2);
    to_segment(bp, bc, pbc * over_bc, distance2);
    // Projects p to the plane as a + v (b - a) + w (c - a), scaled by area2. Inside the triangle, that is the nearest
    // point.
    const Lanes v = d11 * p0 - d01 * p1, w = d00 * p1 - d01 * p0;
    const auto inside = (v >= zero) & (w >= zero) & (v + w <= area2) & (area2 > flat);
    const Lanes s = v * scale, t = w * scale;
    const Vector4 d = {ap.x - s * ab.x - t * ac.x, ap.y - s * ab.y - t * ac.y, ap.z - s * ab.z - t * ac.z};
    Lanes plane2;
    dot(d, d, plane2);
    distance2 = inside ? plane2 : distance2;
    Lanes distance;
    square_root(distance2, distance);
    __builtin_memcpy(out[i] + at, &distance, sizeof distance);
  }
}

[[gnu::always_inline]] inline void distances_to(const double* points, uint64_t point_count, const TriangleBlock* blocks,
                                                uint64_t count, double* const* distances) {
  for (uint64_t i = 0; i < count; ++i) distances_to_block(points, point_count, blocks[i], distances, 4 * i);
}

[[gnu::always_inline]] inline double least_of(const double* lanes) {
  double least = lanes[0];
  for (int lane = 1; lane < 4; ++lane) least = lanes[lane] < least ? lanes[lane] : least;
  return least;
}

[[gnu::always_inline]] inline NearestTriangle nearest_of(const double* a, const double* b, const double* c,
                                                         uint64_t count) {
  using Places = int64_t __attribute__((vector_size(32)));
  const Lanes far = Lanes{} + __builtin_inf();
  Lanes nearest_a = far, nearest_b = far, nearest_c = far, best = far;
  Places at = {}, place = {0, 1, 2, 3};
  for (uint64_t i = 0; i < 4 * count; i += 4, place += 4) {
    Lanes from_a, from_b, from_c;
    __builtin_memcpy(&from_a, a + i, sizeof from_a);
    __builtin_memcpy(&from_b, b + i, sizeof from_b);
    __builtin_memcpy(&from_c, c + i, sizeof from_c);
    nearest_a = from_a < nearest_a ? from_a : nearest_a;
    nearest_b = from_b < nearest_b ? from_b : nearest_b;
    nearest_c = from_c < nearest_c ? from_c : nearest_c;
    Lanes largest = from_a > from_b ? from_a : from_b;
    largest = largest > from_c ? largest : from_c;
    const Places less = largest < best;
    best = less ? largest : best;
    at = less ? place : at;
  }
  double bests[4], least[3][4];
  int64_t places[4];
  __builtin_memcpy(bests, &best, sizeof best), __builtin_memcpy(places, &at, sizeof at);
  __builtin_memcpy(least[0], &nearest_a, sizeof best), __builtin_memcpy(least[1], &nearest_b, sizeof best);
  __builtin_memcpy(least[2], &nearest_c, sizeof best);
  int lane = 0;
  for (int i = 1; i < 4; ++i)
    if (bests[i] < bests[lane] || (bests[i] == bests[lane] && places[i] < places[lane])) lane = i;
  NearestTriangle result = {static_cast<uint64_t>(places[lane]), bests[lane], 0.0};
  for (const auto& corner : least) {
    const double l = least_of(corner);
    result.least = l > result.least ? l : result.least;
  }
  return result;
}

} // namespace
} // namespace packtrace
