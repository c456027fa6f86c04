// Adds the planes and angles of triangles to their points, four triangles in SIMD lanes. Compiled per instruction set
// with the same operations in the same order, so results are bit-identical. No functions of headers other than lanes.h
// may be compiled for AVX2.

#include "compress/bake/lod/simplify/lanes.h"
#include "compress/bake/lod/simplify/triangle_planes.h"

namespace packtrace {
namespace {

/// The unit vector from a to b.
[[gnu::always_inline]] inline void unit_side(const Vector4& a, const Vector4& b, Vector4& out) {
  const Vector4 d = {b.x - a.x, b.y - a.y, b.z - a.z};
  Lanes length;
  dot(d, d, length);
  square_root(length, length);
  const Lanes scale = Lanes{} + 1.0;
  const Lanes inverse = scale / length;
  out.x = d.x * inverse, out.y = d.y * inverse, out.z = d.z * inverse;
}

/// The arcsine for 0 <= x <= 0.71; the error is at most 1 %.
[[gnu::always_inline]] inline void small_arcsine(const Lanes& x, Lanes& out) {
  out = x * (1.0 + x * x * (1.0 / 6.0 + x * x * (3.0 / 40.0)));
}

/// What a corner between two sides adds to its point, one row per triangle.
/// @param from, to unit vectors along the sides that start and end at the corner
[[gnu::always_inline]] inline void add_corner(const Vector4& from, const Vector4& to, Lanes* rows) {
  constexpr double kPi = 3.141592653589793;
  const Lanes zero = {};
  Lanes cosine;
  dot(from, to, cosine);
  cosine = -cosine;
  Lanes half_sine = 0.5 - 0.5 * cosine, half_cosine = 0.5 + 0.5 * cosine;
  half_sine = half_sine > zero ? half_sine : zero, half_cosine = half_cosine > zero ? half_cosine : zero;
  square_root(half_sine, half_sine), square_root(half_cosine, half_cosine);
  const auto acute = cosine > zero;
  Lanes arcsine;
  small_arcsine(acute ? half_sine : half_cosine, arcsine);
  const auto open = half_cosine > zero;
  const Lanes tangent = half_sine / half_cosine;
  rows[0] = open ? tangent * (from.x - to.x) : zero;
  rows[1] = open ? tangent * (from.y - to.y) : zero;
  rows[2] = open ? tangent * (from.z - to.z) : zero;
  rows[3] = acute ? 2.0 * arcsine : kPi - 2.0 * arcsine;
  transpose(rows[0], rows[1], rows[2], rows[3]);
}

/// The quadrics of triangles, weighted by area: rows 0 to 2 of CollapsePoint, four triangles each.
[[gnu::always_inline]] inline void plane_rows(const Vector4& normal, const Lanes& area, const Vector4& at,
                                              Lanes (&rows)[3][4]) {
  const Vector4 n = {normal.x / area, normal.y / area, normal.z / area};
  Lanes d;
  dot(n, at, d);
  d = -d;
  const Vector4 w = {area * n.x, area * n.y, area * n.z};
  rows[0][0] = w.x * n.x, rows[0][1] = w.x * n.y, rows[0][2] = w.x * n.z, rows[0][3] = w.y * n.y;
  rows[1][0] = w.y * n.z, rows[1][1] = w.z * n.z, rows[1][2] = w.x * d, rows[1][3] = w.y * d;
  rows[2][0] = w.z * d, rows[2][1] = area * d * d, rows[2][2] = area, rows[2][3] = Lanes{};
  for (auto& row : rows) transpose(row[0], row[1], row[2], row[3]);
}

[[gnu::always_inline]] inline void add_row(double* to, const Lanes& row) { *reinterpret_cast<Row*>(to) += row; }

[[gnu::always_inline]] inline uint64_t add_planes(const PlaneTask& task, uint64_t first, uint64_t count) {
  for (; first < count; first += 4) {
    const uint64_t lanes = count - first < 4 ? count - first : 4;
    const uint32_t* corners[4];
    double at[3][3][4]; // by corner and axis
    for (uint64_t lane = 0; lane < 4; ++lane) {
      const uint64_t triangle = first + (lane < lanes ? lane : lanes - 1);
      corners[lane] = reinterpret_cast<const uint32_t*>(task.corners + task.stride * triangle);
      for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis)
          at[k][axis][lane] = task.points[uint64_t{3} * corners[lane][k] + static_cast<uint64_t>(axis)];
    }
    Vector4 p[3];
    for (int k = 0; k < 3; ++k) p[k] = load(at[k]);
    const Vector4 ab = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z};
    const Vector4 ac = {p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
    const Vector4 normal = {ab.y * ac.z - ac.y * ab.z, ab.z * ac.x - ac.z * ab.x, ab.x * ac.y - ac.x * ab.y};
    Lanes area;
    dot(normal, normal, area);
    square_root(area, area);
    Lanes quadrics[3][4], fans[3][4];
    plane_rows(normal, area, p[0], quadrics);
    Vector4 sides[3];
    for (int k = 0; k < 3; ++k) unit_side(p[k], p[(k + 1) % 3], sides[k]);
    for (int k = 0; k < 3; ++k) add_corner(sides[k], sides[(k + 2) % 3], fans[k]);
    for (uint64_t lane = 0; lane < lanes; ++lane) {
      double* out = task.area_normals + 3 * (first + lane);
      out[0] = normal.x[lane], out[1] = normal.y[lane], out[2] = normal.z[lane];
      if (!(area[lane] > 0.0)) return first + lane;
      for (int k = 0; k < 3; ++k) {
        double* sums = task.sums[corners[lane][k]].quadric;
        for (int row = 0; row < 3; ++row) add_row(sums + 4 * row, quadrics[row][lane]);
        add_row(task.fans[corners[lane][k]].directions, fans[k][lane]);
      }
    }
  }
  return count;
}

} // namespace
} // namespace packtrace
