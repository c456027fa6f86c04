// The body of triangle_distances(), for each instruction set: same operations in the same order, so the same bits. No
// other header's functions may be compiled for AVX2.

#include "compress/bake/lod/distance_kernel.h"

namespace packtrace {
namespace {

using Lanes = double __attribute__((vector_size(32)));

struct Vector4 {
  Lanes x, y, z;
};

[[gnu::always_inline]] inline void dot(const Vector4& a, const Vector4& b, Lanes& out) {
  out = a.x * b.x + a.y * b.y + a.z * b.z;
}

/// The least of `least` and the squared distance of p, from one end of a segment, from the segment; `along` is p's
/// product with it, length2 its own.
[[gnu::always_inline]] inline void to_segment(const Vector4& p, const Vector4& segment, const Lanes& along,
                                              const Lanes& length2, Lanes& least) {
  const Lanes zero = {}, one = zero + 1.0;
  Lanes t = along / (length2 > zero ? length2 : one);
  t = t > zero ? t : zero;
  t = t < one ? t : one;
  const Vector4 d = {p.x - t * segment.x, p.y - t * segment.y, p.z - t * segment.z};
  Lanes distance2;
  dot(d, d, distance2);
  least = distance2 < least ? distance2 : least;
}

[[gnu::always_inline]] inline void distances_to_block(const double* point, const TriangleBlock& block, double* out) {
  using Stored = double __attribute__((vector_size(32), may_alias));
  const auto in = [](const double* from) __attribute__((always_inline))->const Stored& {
    return *reinterpret_cast<const Stored*>(from);
  };
  const Lanes zero = {};
  const Vector4 ab = {in(block.ab[0]), in(block.ab[1]), in(block.ab[2])};
  const Vector4 ac = {in(block.ac[0]), in(block.ac[1]), in(block.ac[2])};
  const Vector4 ap = {point[0] - in(block.a[0]), point[1] - in(block.a[1]), point[2] - in(block.a[2])};
  const Vector4 bc = {ac.x - ab.x, ac.y - ab.y, ac.z - ab.z}, bp = {ap.x - ab.x, ap.y - ab.y, ap.z - ab.z};
  Lanes d00, d01, d11, p0, p1, dbc, pbc;
  dot(ab, ab, d00), dot(ab, ac, d01), dot(ac, ac, d11);
  dot(ap, ab, p0), dot(ap, ac, p1), dot(bc, bc, dbc), dot(bp, bc, pbc);
  Lanes distance2 = zero + __builtin_inf();
  to_segment(ap, ab, p0, d00, distance2);
  to_segment(ap, ac, p1, d11, distance2);
  to_segment(bp, bc, pbc, dbc, distance2);
  // Over the plane, p = a + v (b - a) + w (c - a): the foot is the nearest point where it lies inside.
  const Lanes area2 = d00 * d11 - d01 * d01, v = d11 * p0 - d01 * p1, w = d00 * p1 - d01 * p0;
  const auto inside = (v >= zero) & (w >= zero) & (v + w <= area2) & (area2 > 1e-12 * d00 * d11);
  const Lanes scale = 1.0 / (area2 > zero ? area2 : zero + 1.0), s = v * scale, t = w * scale;
  const Vector4 d = {ap.x - s * ab.x - t * ac.x, ap.y - s * ab.y - t * ac.y, ap.z - s * ab.z - t * ac.z};
  Lanes plane2;
  dot(d, d, plane2);
  distance2 = inside ? plane2 : distance2;
  for (int lane = 0; lane < 4; ++lane) out[lane] = __builtin_sqrt(distance2[lane]);
}

[[gnu::always_inline]] inline void distances_to(const double* point, const TriangleBlock* blocks, uint64_t count,
                                                double* distances) {
  for (uint64_t i = 0; i < count; ++i) distances_to_block(point, blocks[i], distances + 4 * i);
}

} // namespace
} // namespace packtrace
