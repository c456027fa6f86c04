// The body of overlay_kernel(), compiled per instruction set with the same operations in the same order, so results are
// bit-identical. Uses only inlined functions of this translation unit: no other header's functions may be compiled for
// AVX2.
// NOLINTBEGIN(llvm-header-guard)

#include "compress/bake/lod/bound/overlay_kernel.h"

namespace packtrace {
namespace {

using Lanes = double __attribute__((vector_size(32)));
using Mask = int64_t __attribute__((vector_size(32)));
using LanesIn = double __attribute__((vector_size(32), may_alias)); // as stored in memory

constexpr double kOnLine = 1e-9; // barycentric tolerance; smaller distances from a line count as 0
constexpr double kTiny = 1e-12;  // fraction of the triangle's area; smaller pieces are dropped

/// Four segments clipped to three half-planes, as parameter ranges [lo, hi].
struct Span4 {
  Lanes lo, hi;
};

/// @param d0, d1 signed distances of the ends from the line, inside positive
[[gnu::always_inline]] inline void clip(Span4& span, const Lanes& d0, const Lanes& d1) {
  const Lanes zero = {}, none = zero + 2.0;
  const Mask out0 = d0 < zero, out1 = d1 < zero;
  const Lanes at = d0 / (d0 - d1); // used only if the signs differ
  const Lanes lo = out1 ? none : at;
  span.lo = (out0 & (lo > span.lo)) ? lo : span.lo;
  span.hi = (out1 & ~out0 & (at < span.hi)) ? at : span.hi;
}

struct Corner4 {
  Lanes l0, l1, l2, height;
};

/// Adds one side's contribution to the area of the piece, and its ends to the maximum height.
/// @param counts whether the side contributes to the area
[[gnu::always_inline]] inline void add_side(const Span4& span, const Mask& counts, const Lanes& x, const Lanes& y,
                                            const Lanes& h, const Lanes& dx, const Lanes& dy, const Lanes& dh,
                                            Lanes& area, Lanes& height) {
  const Lanes zero = {};
  const Mask valid = span.lo <= span.hi;
  const Lanes x0 = x + span.lo * dx, y0 = y + span.lo * dy, h0 = h + span.lo * dh;
  const Lanes x1 = x + span.hi * dx, y1 = y + span.hi * dy, h1 = h + span.hi * dh;
  area += (valid & counts) ? x0 * y1 - y0 * x1 : zero;
  Lanes a0 = h0 < zero ? -h0 : h0, a1 = h1 < zero ? -h1 : h1;
  a0 = a0 > a1 ? a0 : a1;
  height = (valid & (a0 > height)) ? a0 : height;
}

/// Clips the side from p to q of a surface triangle to the overlaid triangle.
/// @param inner set to whether the side crosses its interior
[[gnu::always_inline]] inline void surface_side(const Corner4& p, const Corner4& q, Lanes& area, Lanes& height,
                                                Mask& inner) {
  const Lanes zero = {};
  Span4 span = {zero, zero + 1.0};
  clip(span, p.l0, q.l0);
  clip(span, p.l1, q.l1);
  clip(span, p.l2, q.l2);
  // A side on one of the lines does not count for the area: the overlaid triangle's own side does.
  const Mask on =
      ((p.l0 == zero) & (q.l0 == zero)) | ((p.l1 == zero) & (q.l1 == zero)) | ((p.l2 == zero) & (q.l2 == zero));
  const Lanes d1 = q.l1 - p.l1, d2 = q.l2 - p.l2;
  add_side(span, ~on, p.l1, p.l2, p.height, d1, d2, q.height - p.height, area, height);
  inner = ~on & ((span.hi - span.lo) * ((d1 < zero ? -d1 : d1) + (d2 < zero ? -d2 : d2)) > zero + kOnLine);
}

/// Signed distances of the overlaid triangle's corners from p -> q, 0 if on it: (0, 0), (1, 0), (0, 1) in l1, l2.
struct Sides4 {
  Lanes at0, at1, at2;
};
[[gnu::always_inline]] inline void sides_of(const Corner4& p, const Corner4& q, const Lanes& tolerance, Sides4& out) {
  const Lanes zero = {}, at0 = q.l2 * p.l1 - q.l1 * p.l2;
  const Lanes at1 = at0 - (q.l2 - p.l2), at2 = at0 + (q.l1 - p.l1);
  out.at0 = ((at0 < tolerance) & (at0 > -tolerance)) ? zero : at0;
  out.at1 = ((at1 < tolerance) & (at1 > -tolerance)) ? zero : at1;
  out.at2 = ((at2 < tolerance) & (at2 > -tolerance)) ? zero : at2;
}

/// Overlaps four surface triangles with the overlaid triangle.
[[gnu::always_inline]] inline void meet(const Corner4& a, const Corner4& b, const Corner4& c, Lanes& area,
                                        Lanes& height, Lanes& facing, Mask& inner) {
  const Lanes zero = {}, one = zero + 1.0;
  const Mask all = zero == zero; // NOLINT(misc-redundant-expression): sets all lanes
  facing = (b.l1 - a.l1) * (c.l2 - a.l2) - (b.l2 - a.l2) * (c.l1 - a.l1);
  area = height = zero;
  Mask inner_ab, inner_bc, inner_ca;
  surface_side(a, b, area, height, inner_ab);
  surface_side(b, c, area, height, inner_bc);
  surface_side(c, a, area, height, inner_ca);
  inner = (inner_ab & 1) | (inner_bc & 2) | (inner_ca & 4);

  const Lanes tolerance = kOnLine + 1e-14 * (facing < zero ? -facing : facing);
  Sides4 ab, bc, ca;
  sides_of(a, b, tolerance, ab);
  sides_of(b, c, tolerance, bc);
  sides_of(c, a, tolerance, ca);
  const Lanes scale = one / facing;
  const Lanes h0 = (bc.at0 * a.height + ca.at0 * b.height + ab.at0 * c.height) * scale;
  const Lanes h1 = (bc.at1 * a.height + ca.at1 * b.height + ab.at1 * c.height) * scale;
  const Lanes h2 = (bc.at2 * a.height + ca.at2 * b.height + ab.at2 * c.height) * scale;
  Span4 span = {zero, one};
  clip(span, ab.at0, ab.at1), clip(span, bc.at0, bc.at1), clip(span, ca.at0, ca.at1);
  add_side(span, all, zero, zero, h0, one, zero, h1 - h0, area, height);
  span = {zero, one};
  clip(span, ab.at1, ab.at2), clip(span, bc.at1, bc.at2), clip(span, ca.at1, ca.at2);
  add_side(span, all, one, zero, h1, -one, one, h2 - h1, area, height);
  span = {zero, one};
  clip(span, ab.at2, ab.at0), clip(span, bc.at2, bc.at0), clip(span, ca.at2, ca.at0);
  add_side(span, all, zero, one, h2, zero, -one, h0 - h2, area, height);
}

[[gnu::always_inline]] inline void load(const OverlayPoint* const* from, Corner4& out) {
  const auto at = [&](int i) __attribute__((always_inline)) -> const LanesIn& {
    return *reinterpret_cast<const LanesIn*>(from[i]);
  };
  const Lanes v0 = at(0), v1 = at(1), v2 = at(2), v3 = at(3);
  const Lanes a = __builtin_shufflevector(v0, v1, 0, 4, 2, 6), b = __builtin_shufflevector(v0, v1, 1, 5, 3, 7);
  const Lanes c = __builtin_shufflevector(v2, v3, 0, 4, 2, 6), d = __builtin_shufflevector(v2, v3, 1, 5, 3, 7);
  out.l0 = __builtin_shufflevector(a, c, 0, 1, 4, 5), out.l1 = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  out.l2 = __builtin_shufflevector(a, c, 2, 3, 6, 7), out.height = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/// Projects a point unless this task has done so, and returns its `outside` bits.
[[gnu::always_inline]] inline uint32_t outside_of(const OverlayTask& task, uint32_t point) {
  if (task.stamps[point] == task.stamp) return task.outside[point];
  const double* p = task.points + uint64_t{3} * point;
  Lanes l = *reinterpret_cast<const LanesIn*>(&task.from_x) * (p[0] - task.origin[0]) +
            *reinterpret_cast<const LanesIn*>(&task.from_y) * (p[1] - task.origin[1]) +
            *reinterpret_cast<const LanesIn*>(&task.from_z) * (p[2] - task.origin[2]);
  l += Lanes{1.0, 0.0, 0.0, 0.0};
  const Lanes zero = {};
  l = ((l < zero + kOnLine) & (l > zero - kOnLine)) ? zero : l;
  *reinterpret_cast<LanesIn*>(&task.projected[point]) = l;
  const Mask bits = (l <= zero) & Mask{1, 2, 4, 0};
  const auto outside = static_cast<uint32_t>(bits[0] | bits[1] | bits[2]);
  task.stamps[point] = task.stamp;
  return task.outside[point] = outside;
}

[[gnu::always_inline]] inline uint32_t lay_over(const OverlayTask& task, const uint32_t* candidates, uint32_t count,
                                                OverlayPiece* pieces, OverlayCover* cover) {
  const OverlayPoint* corners[3][4];
  uint32_t waiting[4];
  uint32_t filled = 0, found = 0;
  double sum = 0.0, most = 0.0;
  *cover = {};
  for (uint32_t i = 0; i < count || filled > 0;) {
    if (i < count) {
      const uint32_t* p = task.corners + uint64_t{3} * candidates[i];
      const uint32_t outside = outside_of(task, p[0]) & outside_of(task, p[1]) & outside_of(task, p[2]);
      if (outside == 0) {
        for (int k = 0; k < 3; ++k) corners[k][filled] = &task.projected[p[k]];
        waiting[filled++] = candidates[i];
      }
      ++i;
      if (filled < 4 && (i < count || filled == 0)) continue;
    }
    for (uint32_t lane = filled; lane < 4; ++lane)
      for (int k = 0; k < 3; ++k) corners[k][lane] = corners[k][0];
    Corner4 a, b, c;
    load(corners[0], a), load(corners[1], b), load(corners[2], c);
    Lanes area, height, facing;
    Mask inner;
    meet(a, b, c, area, height, facing, inner);
    for (uint32_t lane = 0; lane < filled; ++lane)
      if (facing[lane] > 0.0 && area[lane] > kTiny) {
        if (area[lane] > most) most = area[lane], cover->largest = found;
        pieces[found++] = {waiting[lane], static_cast<uint32_t>(inner[lane]), height[lane]};
        sum += area[lane];
      }
    filled = 0;
    if (sum >= task.enough) break;
  }
  cover->count = sum;
  return found;
}

} // namespace
} // namespace packtrace
// NOLINTEND(llvm-header-guard)
