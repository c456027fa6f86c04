// Places edge collapses, four edges in SIMD lanes. Compiled per instruction set with the same operations in the same
// order, so results are bit-identical. No functions of headers other than lanes.h may be compiled for AVX2.

#include "compress/bake/lod/simplify/edge_placement.h"
#include "compress/bake/lod/simplify/lanes.h"

namespace packtrace {
namespace {

struct Quadric4 {
  Lanes xx, xy, xz, yy, yz, zz, bx, by, bz, c;
};

struct Vec4 {
  Lanes x, y, z;
};

/// Half the gradient of q at p: A p + b.
[[gnu::always_inline]] inline void slope(const Quadric4& q, const Vec4& p, Vec4& out) {
  out.x = q.xx * p.x + q.xy * p.y + q.xz * p.z + q.bx;
  out.y = q.xy * p.x + q.yy * p.y + q.yz * p.z + q.by;
  out.z = q.xz * p.x + q.yz * p.y + q.zz * p.z + q.bz;
}

/// The value of q at p, clamped to 0: rounding may make it slightly negative.
[[gnu::always_inline]] inline void value(const Quadric4& q, const Vec4& p, Lanes& out) {
  const Lanes zero = {};
  Vec4 s;
  slope(q, p, s);
  const Lanes v = p.x * s.x + p.y * s.y + p.z * s.z + q.bx * p.x + q.by * p.y + q.bz * p.z + q.c;
  out = v > zero ? v : zero;
}

/// Moves p to the minimum of q. Along directions of low curvature, p hardly moves.
[[gnu::always_inline]] inline void minimise(const Quadric4& q, Vec4& p) {
  const Lanes zero = {}, one = zero + 1.0;
  const Lanes trace = q.xx + q.yy + q.zz;
  const Lanes stay = 1e-7 * trace;              // regularises directions of low curvature
  const Lanes safe = trace > zero ? zero : one; // for quadrics that are 0
  // L D L^T = A + stay I
  const Lanes d0 = one / (q.xx + stay + safe), l10 = q.xy * d0, l20 = q.xz * d0;
  const Lanes d1 = one / (q.yy + stay + safe - l10 * q.xy), v = q.yz - l10 * q.xz, l21 = v * d1;
  const Lanes d2 = one / (q.zz + stay + safe - l20 * q.xz - l21 * v);
  Vec4 g;
  slope(q, p, g);
  const Lanes y1 = g.y - l10 * g.x, y2 = g.z - l20 * g.x - l21 * y1;
  const Lanes z = y2 * d2, y = y1 * d1 - l21 * z, x = g.x * d0 - l10 * y - l20 * z;
  p.x = p.x - x, p.y = p.y - y, p.z = p.z - z;
}

[[gnu::always_inline]] inline void to_box(const Lanes& lo, const Lanes& hi, Lanes& x) {
  x = x < lo ? lo : x;
  x = x > hi ? hi : x;
  constexpr double kRound = 6755399441055744.0; // 1.5 * 2^52: adding it rounds to integers
  x = (x + kRound) - kRound;
}

/// Chooses the best of both ends and, if neither end is fixed, the minimum near the edge.
/// @param keep_a, keep_b whether that end must not move
template <typename Mask>
[[gnu::always_inline]] inline void place(const Quadric4& q, const Vec4& a, const Vec4& b, const Mask& keep_a,
                                         const Mask& keep_b, const PlacementRules& rules, Vec4& point, Lanes& cost,
                                         Lanes& along) {
  const Lanes zero = {}, one = zero + 1.0, half = zero + 0.5;
  Lanes at_a, at_b;
  value(q, a, at_a);
  value(q, b, at_b);
  const auto b_best = (~keep_a & (at_b < at_a)) | keep_b;
  cost = b_best ? at_b : at_a;
  along = b_best ? one : zero;
  point.x = b_best ? b.x : a.x, point.y = b_best ? b.y : a.y, point.z = b_best ? b.z : a.z;
  if (rules.ends_only) return;
  const Vec4 d = {b.x - a.x, b.y - a.y, b.z - a.z};
  const Vec4 middle = {half * (a.x + b.x), half * (a.y + b.y), half * (a.z + b.z)};
  const Lanes reach = d.x * d.x + d.y * d.y + d.z * d.z;
  Vec4 p = middle;
  minimise(q, p);
  const Vec4 off = {p.x - middle.x, p.y - middle.y, p.z - middle.z};
  const auto near = off.x * off.x + off.y * off.y + off.z * off.z <= reach;
  p.x = near ? p.x : middle.x, p.y = near ? p.y : middle.y, p.z = near ? p.z : middle.z;
  to_box(zero + rules.lo[0], zero + rules.hi[0], p.x);
  to_box(zero + rules.lo[1], zero + rules.hi[1], p.y);
  to_box(zero + rules.lo[2], zero + rules.hi[2], p.z);
  Lanes at_p;
  value(q, p, at_p);
  const auto better = ~(keep_a | keep_b) & (at_p < cost) & (reach > zero);
  Lanes t = ((p.x - a.x) * d.x + (p.y - a.y) * d.y + (p.z - a.z) * d.z) / (reach > zero ? reach : one);
  t = t < zero ? zero : t;
  t = t > one ? one : t;
  cost = better ? at_p : cost;
  along = better ? t : along;
  point.x = better ? p.x : point.x, point.y = better ? p.y : point.y, point.z = better ? p.z : point.z;
}

/// Row i of a point: doubles 4 i to 4 i + 3. Rows 0 to 2 hold the quadric, row 3 the position and `held`.
[[gnu::always_inline]] inline const Row& row(const CollapsePoint& point, int i) {
  return *reinterpret_cast<const Row*>(reinterpret_cast<const char*>(&point) + sizeof(Row) * static_cast<uint64_t>(i));
}

[[gnu::always_inline]] inline void place_all(const CollapsePoint* points, const PlacementRules& rules,
                                             const EdgeEnds* edges, uint64_t count, EdgePlacement* out) {
  for (uint64_t first = 0; first < count; first += 4) {
    const CollapsePoint *a[4], *b[4];
    for (uint64_t lane = 0; lane < 4; ++lane) {
      const EdgeEnds& e = edges[first + lane < count ? first + lane : count - 1];
      a[lane] = &points[e.a], b[lane] = &points[e.b];
    }
    Lanes sums[3][4];
    for (int i = 0; i < 3; ++i) {
      for (int lane = 0; lane < 4; ++lane) sums[i][lane] = row(*a[lane], i) + row(*b[lane], i);
      transpose(sums[i][0], sums[i][1], sums[i][2], sums[i][3]);
    }
    const Quadric4 q = {sums[0][0], sums[0][1], sums[0][2], sums[0][3], sums[1][0],
                        sums[1][1], sums[1][2], sums[1][3], sums[2][0], sums[2][1]};
    Lanes ax = row(*a[0], 3), ay = row(*a[1], 3), az = row(*a[2], 3), held_a = row(*a[3], 3);
    Lanes bx = row(*b[0], 3), by = row(*b[1], 3), bz = row(*b[2], 3), held_b = row(*b[3], 3);
    transpose(ax, ay, az, held_a);
    transpose(bx, by, bz, held_b);
    // Locked points stay; a border point does not move to an interior one.
    const Lanes zero = {}, locked = zero + kLocked;
    const auto keep_a = (held_a >= locked) | ((held_b < locked) & (held_a > held_b));
    const auto keep_b = ~keep_a & ((held_b >= locked) | (held_b > held_a));
    Vec4 point;
    Lanes cost = zero, along = zero;
    place(q, {ax, ay, az}, {bx, by, bz}, keep_a, keep_b, rules, point, cost, along);
    double alongs[4];
    *reinterpret_cast<Row*>(alongs) = along;
    transpose(point.x, point.y, point.z, cost);
    const Lanes rows[4] = {point.x, point.y, point.z, cost};
    for (uint64_t lane = 0; lane < 4 && first + lane < count; ++lane) {
      *reinterpret_cast<Row*>(out[first + lane].at) = rows[lane];
      out[first + lane].along = alongs[lane];
    }
  }
}

} // namespace
} // namespace packtrace
