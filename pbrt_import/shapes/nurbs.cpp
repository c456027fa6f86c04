#include "pbrt_import/shapes/nurbs.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/error.h"
#include "pbrt_import/shapes/mesh_cleanup.h"

namespace packtrace {
namespace {

using DVec4 = glm::dvec4;
constexpr uint64_t kMaxVertices = uint64_t{1} << 24;
constexpr uint32_t kMaxOrder = 32;
constexpr uint32_t kMaxSegmentsPerSpan = 128;

[[noreturn]] void fail(const std::string& problem) { throw Error(ErrorKind::kInput, problem); }

/// The knots of one direction and the part of its domain that is drawn.
struct Axis {
  std::vector<double> knots;
  uint32_t order = 0;
  uint32_t count = 0; ///< control points
  double begin = 0.0;
  double end = 0.0;

  /// The last non-empty span that starts at or before t, as the index of its lower knot.
  uint32_t span_of(double t) const {
    const auto first = knots.begin() + order - 1, last = knots.begin() + count;
    auto upper = std::upper_bound(first, last, t);
    if (upper == last) upper = std::lower_bound(first, last, knots[count]); // t at the end: the span below it
    return static_cast<uint32_t>(upper - knots.begin()) - 1;
  }
};

Axis make_axis(const char* name, uint32_t count, uint32_t order, std::span<const float> knots,
               std::optional<float> from, std::optional<float> to) {
  const std::string axis(name);
  if (order < 2 || order > kMaxOrder) fail("the order along " + axis + " is not within [2, 32]");
  if (count < order) fail("fewer control points along " + axis + " than its order");
  if (knots.size() != uint64_t{count} + order)
    fail("the number of " + axis + " knots is not that of the control points plus the order");
  if (!std::all_of(knots.begin(), knots.end(), [](float k) { return std::isfinite(k); }) ||
      !std::is_sorted(knots.begin(), knots.end()))
    fail("the " + axis + " knots are not finite and in order");
  Axis result{{knots.begin(), knots.end()}, order, count, 0.0, 0.0};
  const double low = knots[order - 1], high = knots[count];
  result.begin = from.value_or(knots[order - 1]);
  result.end = to.value_or(knots[count]);
  if (!(result.begin >= low && result.end <= high && result.begin < result.end))
    fail("the range of " + axis + " is empty or leaves the knots");
  return result;
}

/// A point and its derivative, homogeneous.
struct Jet {
  DVec4 value{0.0};
  DVec4 derivative{0.0};
};

/// de Boor's algorithm in place on the order control points of a span.
Jet de_boor(const Axis& axis, uint32_t span, double t, DVec4* points) {
  const uint32_t degree = axis.order - 1;
  Jet jet;
  for (uint32_t level = 1; level <= degree; ++level) {
    if (level == degree)
      jet.derivative = (points[degree] - points[degree - 1]) * (degree / (axis.knots[span + 1] - axis.knots[span]));
    for (uint32_t i = degree; i >= level; --i) {
      const double low = axis.knots[span - degree + i], high = axis.knots[span + 1 + i - level];
      const double alpha = (t - low) / (high - low); // high > low: the span between them is not empty
      points[i] = (1.0 - alpha) * points[i - 1] + alpha * points[i];
    }
  }
  jet.value = points[degree];
  return jet;
}

struct SurfacePoint {
  DVec3 position{0.0};
  DVec3 normal{0.0}; ///< along cross(dp/du, dp/dv), any length
};

class Surface {
public:
  Surface(const Axis& u, const Axis& v, std::span<const glm::vec4> points) : u_(u), v_(v), points_(points) {}

  SurfacePoint at(double u, double v) const {
    const uint32_t u_span = u_.span_of(u), v_span = v_.span_of(v);
    DVec4 row[kMaxOrder], column[kMaxOrder], column_u[kMaxOrder];
    for (uint32_t j = 0; j < v_.order; ++j) {
      const size_t first = size_t{v_span + 1 - v_.order + j} * u_.count + (u_span + 1 - u_.order);
      for (uint32_t i = 0; i < u_.order; ++i) row[i] = DVec4(points_[first + i]);
      const Jet jet = de_boor(u_, u_span, u, row);
      column[j] = jet.value;
      column_u[j] = jet.derivative;
    }
    const Jet along_v = de_boor(v_, v_span, v, column);
    const DVec4 du = de_boor(v_, v_span, v, column_u).value;
    const DVec4 p = along_v.value;
    const auto projected = [&](const DVec4& d) { return (DVec3(d) * p.w - DVec3(p) * d.w) / (p.w * p.w); };
    const SurfacePoint point{DVec3(p) / p.w, glm::cross(projected(du), projected(along_v.derivative))};
    if (!is_finite(Vec3(point.position))) fail("a point of the nurbs surface is not finite");
    return point;
  }

private:
  const Axis& u_;
  const Axis& v_;
  std::span<const glm::vec4> points_;
};

/// Knots within the drawn range and its ends, with each span cut into equal segments.
std::vector<double> grid_lines(const Axis& axis, uint32_t segments) {
  std::vector<double> stops{axis.begin};
  for (const double knot : axis.knots)
    if (knot > stops.back() && knot < axis.end) stops.push_back(knot);
  stops.push_back(axis.end);
  std::vector<double> lines{axis.begin};
  for (size_t i = 0; i + 1 < stops.size(); ++i)
    for (uint32_t k = 1; k <= segments; ++k)
      lines.push_back(k == segments ? stops[i + 1] : stops[i] + (stops[i + 1] - stops[i]) * k / segments);
  return lines;
}

/// How far the middles of the grid's edges across `lines` are from the surface, at most.
template <class At>
double worst_middle(const std::vector<double>& lines, const std::vector<double>& others, At at) {
  double worst = 0.0;
  for (const double other : others) {
    DVec3 previous = at(lines[0], other);
    for (size_t i = 1; i < lines.size(); ++i) {
      const DVec3 next = at(lines[i], other), middle = at((lines[i - 1] + lines[i]) / 2, other);
      worst = std::max(worst, glm::distance(middle, (previous + next) / 2.0));
      previous = next;
    }
  }
  return worst;
}

struct Grid {
  std::vector<double> u, v;
};

/// How far the middles of cells are from the diagonals that cut them, at most.
double worst_centre(const Grid& grid, const Surface& surface) {
  double worst = 0.0;
  for (size_t j = 1; j < grid.v.size(); ++j) {
    for (size_t i = 1; i < grid.u.size(); ++i) {
      const DVec3 diagonal =
          (surface.at(grid.u[i - 1], grid.v[j - 1]).position + surface.at(grid.u[i], grid.v[j]).position) / 2.0;
      const double u = (grid.u[i - 1] + grid.u[i]) / 2, v = (grid.v[j - 1] + grid.v[j]) / 2;
      worst = std::max(worst, glm::distance(surface.at(u, v).position, diagonal));
    }
  }
  return worst;
}

Grid refine(const Axis& u, const Axis& v, const Surface& surface, double tolerance) {
  // Four segments to begin with, so that an inflection in the middle of a span does not look straight.
  uint32_t u_segments = u.order > 2 ? 4 : 1, v_segments = v.order > 2 ? 4 : 1;
  while (true) {
    Grid grid{grid_lines(u, u_segments), grid_lines(v, v_segments)};
    if (uint64_t{grid.u.size()} * grid.v.size() > kMaxVertices)
      throw Error(ErrorKind::kLimitExceeded,
                  "the nurbs surface asks for more than " + std::to_string(kMaxVertices) + " vertices");
    bool refine_u =
        worst_middle(grid.u, grid.v, [&](double x, double y) { return surface.at(x, y).position; }) > tolerance / 2;
    bool refine_v =
        worst_middle(grid.v, grid.u, [&](double y, double x) { return surface.at(x, y).position; }) > tolerance / 2;
    // Cells may also be twisted while their edges are straight.
    if (!refine_u && !refine_v) refine_u = refine_v = worst_centre(grid, surface) > tolerance;
    refine_u = refine_u && u_segments < kMaxSegmentsPerSpan;
    refine_v = refine_v && v_segments < kMaxSegmentsPerSpan;
    if (!refine_u && !refine_v) return grid;
    u_segments *= refine_u ? 2 : 1;
    v_segments *= refine_v ? 2 : 1;
  }
}

Mesh mesh_of(const Grid& grid, const Surface& surface) {
  Mesh mesh;
  const size_t count = grid.u.size() * grid.v.size();
  mesh.positions.reserve(count);
  mesh.normals.reserve(count);
  mesh.uvs.reserve(count);
  for (const double v : grid.v) {
    for (const double u : grid.u) {
      const SurfacePoint point = surface.at(u, v);
      const double length = glm::length(point.normal);
      mesh.positions.emplace_back(point.position);
      mesh.normals.emplace_back(length > 0.0 && std::isfinite(length) ? point.normal / length : DVec3(0.0));
      mesh.uvs.emplace_back(u, v);
    }
  }
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
    const Vec3 p = mesh.positions[a], q = mesh.positions[b], r = mesh.positions[c];
    if (p != q && q != r && r != p) mesh.triangles.emplace_back(a, b, c);
  };
  const auto width = static_cast<uint32_t>(grid.u.size()), height = static_cast<uint32_t>(grid.v.size());
  for (uint32_t y = 0; y + 1 < height; ++y) {
    for (uint32_t x = 0; x + 1 < width; ++x) {
      const uint32_t a = y * width + x, b = a + 1, c = b + width, d = a + width;
      add(a, b, c);
      add(a, c, d);
    }
  }
  drop_bad_triangles(mesh, {}); // normals at poles come from the faces around
  return mesh;
}

} // namespace

Mesh tessellate_nurbs(const NurbsParameters& nurbs, double relative_tolerance) {
  if (!(relative_tolerance >= 1e-6 && relative_tolerance <= 0.5))
    fail("the tessellation tolerance is not within [1e-6, 0.5]");
  const Axis u = make_axis("u", nurbs.nu, nurbs.u_order, nurbs.u_knots, nurbs.u0, nurbs.u1);
  const Axis v = make_axis("v", nurbs.nv, nurbs.v_order, nurbs.v_knots, nurbs.v0, nurbs.v1);
  if (uint64_t{nurbs.nu} * nurbs.nv != nurbs.control_points.size())
    fail("the nurbs surface has " + std::to_string(nurbs.control_points.size()) +
         " control points for nu x nv = " + std::to_string(uint64_t{nurbs.nu} * nurbs.nv));
  Bounds bounds;
  for (const glm::vec4& p : nurbs.control_points) {
    if (!is_finite(Vec3(p)) || !std::isfinite(p.w) || p.w == 0.0f)
      fail("a control point is not finite or has weight 0");
    bounds.extend(DVec3(p) / double{p.w});
  }
  const Surface surface(u, v, nurbs.control_points);
  return mesh_of(refine(u, v, surface, relative_tolerance * bounds.diagonal() / 2), surface);
}

} // namespace packtrace
