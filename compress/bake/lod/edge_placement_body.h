// Where an edge collapses to, for one edge (double) or four (Lanes), for each instruction set: same operations in the
// same order, so the same bits. No other header's functions may be compiled for AVX2.

#include "compress/bake/lod/edge_placement.h"

namespace packtrace {
namespace {

using Lanes = double __attribute__((vector_size(32)));

template <typename T>
struct Quadric4 {
  T xx, xy, xz, yy, yz, zz, bx, by, bz, c;
};

template <typename T>
struct Vec4 {
  T x, y, z;
};

template <typename T>
[[gnu::always_inline]] inline void slope(const Quadric4<T>& q, const Vec4<T>& p, Vec4<T>& out) {
  out.x = q.xx * p.x + q.xy * p.y + q.xz * p.z + q.bx;
  out.y = q.xy * p.x + q.yy * p.y + q.yz * p.z + q.by;
  out.z = q.xz * p.x + q.yz * p.y + q.zz * p.z + q.bz;
}

/// Rounding may make it a little negative where it should be 0; never is here.
template <typename T>
[[gnu::always_inline]] inline void value(const Quadric4<T>& q, const Vec4<T>& p, T& out) {
  const T zero = {};
  Vec4<T> s;
  slope(q, p, s);
  const T v = p.x * s.x + p.y * s.y + p.z * s.z + q.bx * p.x + q.by * p.y + q.bz * p.z + q.c;
  out = v > zero ? v : zero;
}

/// Where it is least; along directions in which it hardly changes, close to p, which it replaces.
template <typename T>
[[gnu::always_inline]] inline void minimise(const Quadric4<T>& q, Vec4<T>& p) {
  const T zero = {}, one = zero + 1.0;
  const T trace = q.xx + q.yy + q.zz;
  const T stay = 1e-4 * trace;              // less curved directions are left alone
  const T safe = trace > zero ? zero : one; // there is nothing at all
  // L D L^T = A + stay I
  const T d0 = one / (q.xx + stay + safe), l10 = q.xy * d0, l20 = q.xz * d0;
  const T d1 = one / (q.yy + stay + safe - l10 * q.xy), v = q.yz - l10 * q.xz, l21 = v * d1;
  const T d2 = one / (q.zz + stay + safe - l20 * q.xz - l21 * v);
  Vec4<T> g;
  slope(q, p, g);
  const T y1 = g.y - l10 * g.x, y2 = g.z - l20 * g.x - l21 * y1;
  const T z = y2 * d2, y = y1 * d1 - l21 * z, x = g.x * d0 - l10 * y - l20 * z;
  p.x = p.x - x, p.y = p.y - y, p.z = p.z - z;
}

template <typename T>
[[gnu::always_inline]] inline void to_box(const T& lo, const T& hi, T& x) {
  x = x < lo ? lo : x;
  x = x > hi ? hi : x;
  constexpr double kRound = 6755399441055744.0; // 1.5 * 2^52: adding it rounds to whole numbers
  x = (x + kRound) - kRound;
}

/// The best of both ends and, where the edge may move, the least point near it.
template <typename T>
[[gnu::always_inline]] inline void place(const Quadric4<T>& q, const Vec4<T>& a, const Vec4<T>& b, const T& keep,
                                         const EdgeBatch& box, Vec4<T>& point, T& cost, T& along) {
  const T zero = {}, one = zero + 1.0, half = zero + 0.5;
  T at_a, at_b;
  value(q, a, at_a);
  value(q, b, at_b);
  const auto b_best = ((keep == zero) & (at_b < at_a)) | (keep == zero + 2.0);
  cost = b_best ? at_b : at_a;
  along = b_best ? one : zero;
  point.x = b_best ? b.x : a.x, point.y = b_best ? b.y : a.y, point.z = b_best ? b.z : a.z;
  if (box.ends_only) return;
  const Vec4<T> d = {b.x - a.x, b.y - a.y, b.z - a.z};
  const Vec4<T> middle = {half * (a.x + b.x), half * (a.y + b.y), half * (a.z + b.z)};
  const T reach = d.x * d.x + d.y * d.y + d.z * d.z;
  Vec4<T> p = middle;
  minimise(q, p);
  const Vec4<T> off = {p.x - middle.x, p.y - middle.y, p.z - middle.z};
  const auto near = off.x * off.x + off.y * off.y + off.z * off.z <= reach;
  p.x = near ? p.x : middle.x, p.y = near ? p.y : middle.y, p.z = near ? p.z : middle.z;
  to_box(zero + box.lo[0], zero + box.hi[0], p.x);
  to_box(zero + box.lo[1], zero + box.hi[1], p.y);
  to_box(zero + box.lo[2], zero + box.hi[2], p.z);
  T at_p;
  value(q, p, at_p);
  const auto better = (keep == zero) & (at_p < cost) & (reach > zero);
  T t = ((p.x - a.x) * d.x + (p.y - a.y) * d.y + (p.z - a.z) * d.z) / (reach > zero ? reach : one);
  t = t < zero ? zero : t;
  t = t > one ? one : t;
  cost = better ? at_p : cost;
  along = better ? t : along;
  point.x = better ? p.x : point.x, point.y = better ? p.y : point.y, point.z = better ? p.z : point.z;
}

[[gnu::always_inline]] inline void place_four(EdgeBatch& batch) {
  using Stored = double __attribute__((vector_size(32), may_alias));
  const auto in = [](const double* from) __attribute__((always_inline))->const Stored& {
    return *reinterpret_cast<const Stored*>(from);
  };
  const Quadric4<Lanes> q = {in(batch.quadric[0]), in(batch.quadric[1]), in(batch.quadric[2]), in(batch.quadric[3]),
                             in(batch.quadric[4]), in(batch.quadric[5]), in(batch.quadric[6]), in(batch.quadric[7]),
                             in(batch.quadric[8]), in(batch.quadric[9])};
  const Vec4<Lanes> a = {in(batch.a[0]), in(batch.a[1]), in(batch.a[2])};
  const Vec4<Lanes> b = {in(batch.b[0]), in(batch.b[1]), in(batch.b[2])};
  Vec4<Lanes> point;
  Lanes cost, along;
  const Lanes keep = in(batch.keep);
  place(q, a, b, keep, batch, point, cost, along);
  *reinterpret_cast<Stored*>(batch.point[0]) = point.x;
  *reinterpret_cast<Stored*>(batch.point[1]) = point.y;
  *reinterpret_cast<Stored*>(batch.point[2]) = point.z;
  *reinterpret_cast<Stored*>(batch.cost) = cost;
  *reinterpret_cast<Stored*>(batch.along) = along;
}

} // namespace
} // namespace packtrace
