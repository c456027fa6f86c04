#include "pbrt_import/shapes/nurbs.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/shapes/mesh_cleanup.h"

namespace packtrace {
namespace {

using DVec4 = glm::dvec4;
constexpr uint64_t kMaxNurbsVertices = uint64_t{1} << 24;
constexpr uint32_t kMaxOrder = 32;
constexpr uint32_t kMaxSegmentsPerSpan = 128;

[[noreturn]] void fail_nurbs(const std::string& problem) { throw Error(ErrorKind::kInput, problem); }

[[noreturn]] void fail_too_many() {
  throw Error(ErrorKind::kLimitExceeded,
              "the nurbs surface asks for more than " + std::to_string(kMaxNurbsVertices) + " vertices");
}

std::string two_digits(double value) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::setprecision(2) << value;
  return stream.str();
}

/// The knots of one parameter direction, and the part of its domain that is drawn.
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
    // At the end of the domain, takes the last non-empty span.
    if (upper == last) upper = std::lower_bound(first, last, knots[count]);
    return static_cast<uint32_t>(upper - knots.begin()) - 1;
  }
};

Axis make_axis(const char* name, uint32_t count, uint32_t order, std::span<const float> knots,
               std::optional<float> from, std::optional<float> to) {
  const std::string axis(name);
  if (order < 2 || order > kMaxOrder) fail_nurbs("the order along " + axis + " is not within [2, 32]");
  if (count < order) fail_nurbs("fewer control points along " + axis + " than its order");
  if (knots.size() != uint64_t{count} + order)
    fail_nurbs("the number of " + axis + " knots is not that of the control points plus the order");
  if (!std::all_of(knots.begin(), knots.end(), [](float k) { return std::isfinite(k); }) ||
      !std::is_sorted(knots.begin(), knots.end()))
    fail_nurbs("the " + axis + " knots are not finite and in order");
  Axis result{{knots.begin(), knots.end()}, order, count, 0.0, 0.0};
  const double low = knots[order - 1], high = knots[count];
  result.begin = from.value_or(knots[order - 1]);
  result.end = to.value_or(knots[count]);
  if (!(result.begin >= low && result.end <= high && result.begin < result.end))
    fail_nurbs("the range of " + axis + " is empty or leaves the knots");
  return result;
}

/// A point and its derivative in homogeneous coordinates.
struct Jet {
  DVec4 value{0.0};
  DVec4 derivative{0.0};
};

/// de Boor's algorithm, in place on the `order` control points of a span.
Jet de_boor(const Axis& axis, uint32_t span, double t, DVec4* points) {
  const uint32_t degree = axis.order - 1;
  Jet jet;
  for (uint32_t level = 1; level <= degree; ++level) {
    if (level == degree)
      jet.derivative = (points[degree] - points[degree - 1]) * (degree / (axis.knots[span + 1] - axis.knots[span]));
    for (uint32_t i = degree; i >= level; --i) {
      const double low = axis.knots[span - degree + i], high = axis.knots[span + 1 + i - level];
      const double alpha = (t - low) / (high - low); // high > low, since the span is not empty
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
  Surface(const Axis& u, const Axis& v, std::span<const glm::vec4> points) : u_(u), v_(v), points_(points) {
    weight_is_positive_ = row(v.begin).weight(u.begin) > 0.0;
  }

  /// The curve of the surface along u at a fixed v, whose control points are computed once.
  class Row {
  public:
    Row(const Surface& surface, double v) : surface_(surface), jets_(surface.u_.count) {
      const Axis& axis = surface.v_;
      const uint32_t span = axis.span_of(v);
      DVec4 column[kMaxOrder];
      for (uint32_t i = 0; i < surface.u_.count; ++i) {
        for (uint32_t j = 0; j < axis.order; ++j)
          column[j] = DVec4(surface.points_[size_t{span + 1 - axis.order + j} * surface.u_.count + i]);
        jets_[i] = de_boor(axis, span, v, column);
      }
    }

    double weight(double u) const { return curve(u, &Jet::value).value.w; }

    SurfacePoint at(double u) const {
      const Jet along_u = curve(u, &Jet::value);
      const DVec4 p = along_u.value, dv = curve(u, &Jet::derivative).value;
      const DVec3 position = projected(p);
      const auto slope = [&](const DVec4& d) { return (DVec3(d) * p.w - DVec3(p) * d.w) / (p.w * p.w); };
      return {position, glm::cross(slope(along_u.derivative), slope(dv))};
    }

    std::vector<DVec3> positions(std::span<const double> us) const {
      std::vector<DVec3> result;
      result.reserve(us.size());
      for (const double u : us) result.push_back(projected(curve(u, &Jet::value).value));
      return result;
    }

  private:
    DVec3 projected(const DVec4& p) const {
      if ((p.w > 0.0) != surface_.weight_is_positive_) fail_nurbs("the nurbs surface runs through infinity");
      const DVec3 position = DVec3(p) / p.w;
      if (!is_finite(Vec3(position))) fail_nurbs("a point of the nurbs surface is not finite");
      return position;
    }

    Jet curve(double u, DVec4 Jet::* which) const {
      const Axis& axis = surface_.u_;
      const uint32_t span = axis.span_of(u), first = span + 1 - axis.order;
      DVec4 points[kMaxOrder];
      for (uint32_t i = 0; i < axis.order; ++i) points[i] = jets_[first + i].*which;
      return de_boor(axis, span, u, points);
    }

    const Surface& surface_;
    std::vector<Jet> jets_; ///< control points of the curve, and their derivatives along v
  };

  Row row(double v) const { return Row(*this, v); }

private:
  const Axis& u_;
  const Axis& v_;
  std::span<const glm::vec4> points_;
  bool weight_is_positive_ = true; ///< sign of the weight on the whole surface
};

/// The knots within the drawn range and the ends of the range, with each span divided into equal segments.
std::vector<double> grid_lines(const Axis& axis, uint32_t segments) {
  std::vector<double> stops{axis.begin};
  for (const double knot : axis.knots)
    if (knot > stops.back() && knot < axis.end) stops.push_back(knot);
  stops.push_back(axis.end);
  if ((stops.size() - 1) * segments > kMaxNurbsVertices) fail_too_many();
  std::vector<double> lines{axis.begin};
  lines.reserve((stops.size() - 1) * segments + 1);
  for (size_t i = 0; i + 1 < stops.size(); ++i)
    for (uint32_t k = 1; k <= segments; ++k)
      lines.push_back(k == segments ? stops[i + 1] : stops[i] + (stops[i + 1] - stops[i]) * k / segments);
  return lines;
}

/// Number of grid lines.
/// @param doubled whether each segment is halved
uint64_t line_count(const std::vector<double>& lines, bool doubled) {
  return doubled ? 2 * uint64_t{lines.size()} - 1 : lines.size();
}

struct Grid {
  std::vector<double> u, v;

  uint64_t vertex_count() const { return uint64_t{u.size()} * v.size(); }
};

/// The n lines and the midpoints between them, 2 n - 1 in total.
std::vector<double> with_middles(const std::vector<double>& lines) {
  std::vector<double> result{lines[0]};
  for (size_t i = 1; i < lines.size(); ++i) result.insert(result.end(), {(lines[i - 1] + lines[i]) / 2, lines[i]});
  return result;
}

/// Largest measured distances between the surface and the triangles of a grid.
struct Deviation {
  double along_u = 0.0; ///< at the midpoints of edges along u
  double along_v = 0.0;
  double centre = 0.0; ///< at the midpoints of cells, from the diagonal that splits the cell
  double size = 0.0;   ///< half the diagonal of the surface's bounds

  /// The relative tolerance that the grid meets.
  double tolerance() const { return size > 0.0 ? std::max({2 * along_u, 2 * along_v, centre}) / size : 0.0; }
};

Deviation measure(const Grid& grid, const Surface& surface, const CheckCancelledFn& check_cancelled) {
  const std::vector<double> us = with_middles(grid.u);
  Deviation worst;
  Bounds bounds;
  std::vector<DVec3> low;
  for (size_t j = 0; j < grid.v.size(); ++j) {
    if (check_cancelled) check_cancelled();
    std::vector<DVec3> high = surface.row(grid.v[j]).positions(us);
    for (const DVec3& p : high) bounds.extend(p);
    for (size_t i = 2; i < us.size(); i += 2)
      worst.along_u = std::max(worst.along_u, glm::distance(high[i - 1], (high[i - 2] + high[i]) / 2.0));
    if (j > 0) {
      const std::vector<DVec3> middle = surface.row((grid.v[j - 1] + grid.v[j]) / 2).positions(us);
      for (size_t i = 0; i < us.size(); i += 2)
        worst.along_v = std::max(worst.along_v, glm::distance(middle[i], (low[i] + high[i]) / 2.0));
      for (size_t i = 2; i < us.size(); i += 2)
        worst.centre = std::max(worst.centre, glm::distance(middle[i - 1], (low[i - 2] + high[i]) / 2.0));
    }
    low = std::move(high);
  }
  worst.size = bounds.diagonal() / 2;
  return worst;
}

/// Reserves the memory of the grid's mesh.
void reserve_mesh(MemoryReservation* memory, const Grid& grid) {
  const uint64_t triangle_bytes = 2 * 2 * sizeof(Triangle); // the vector of triangles doubles its capacity as it grows
  reserve_for_shape(memory, grid.vertex_count() * (2 * sizeof(Vec3) + sizeof(Vec2) + triangle_bytes));
}

Grid refine(const Axis& u, const Axis& v, const Surface& surface, double relative_tolerance, const ReportFn& report,
            const CheckCancelledFn& check_cancelled, MemoryReservation* memory) {
  // Starts with four segments, so that an inflection in the middle of a span does not look straight.
  uint32_t u_segments = u.order > 2 ? 4 : 1, v_segments = v.order > 2 ? 4 : 1;
  Grid grid{grid_lines(u, u_segments), grid_lines(v, v_segments)};
  if (grid.vertex_count() > kMaxNurbsVertices) fail_too_many();
  while (true) {
    reserve_mesh(memory, grid); // before it is measured, which takes longer
    const Deviation deviation = measure(grid, surface, check_cancelled);
    if (deviation.tolerance() <= relative_tolerance) return grid;
    const double most = relative_tolerance * deviation.size / 2;
    bool refine_u = deviation.along_u > most, refine_v = deviation.along_v > most;
    if (!refine_u && !refine_v) refine_u = refine_v = true; // cells can be twisted although their edges are straight
    refine_u = refine_u && u_segments < kMaxSegmentsPerSpan;
    refine_v = refine_v && v_segments < kMaxSegmentsPerSpan;
    u_segments *= refine_u ? 2 : 1;
    v_segments *= refine_v ? 2 : 1;
    const bool too_many = line_count(grid.u, refine_u) * line_count(grid.v, refine_v) > kMaxNurbsVertices;
    Grid finer;
    if (!too_many) finer = {grid_lines(u, u_segments), grid_lines(v, v_segments)};
    if (too_many || finer.vertex_count() == grid.vertex_count()) {
      if (report)
        report(Severity::kWarning, 0,
               "the surface is followed to within " + two_digits(deviation.tolerance()) +
                   " of its size only, not the tolerance of " + two_digits(relative_tolerance));
      return grid;
    }
    grid = std::move(finer);
  }
}

Mesh mesh_of(const Grid& grid, const Surface& surface, const CheckCancelledFn& check_cancelled) {
  Mesh mesh;
  const size_t count = grid.vertex_count();
  mesh.positions.reserve(count);
  mesh.normals.reserve(count);
  mesh.uvs.reserve(count);
  for (const double v : grid.v) {
    if (check_cancelled) check_cancelled();
    const Surface::Row row = surface.row(v);
    for (const double u : grid.u) {
      const SurfacePoint point = row.at(u);
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
  clean_up_mesh(mesh, {}); // recomputes normals at poles from the faces around them
  return mesh;
}

} // namespace

Mesh tessellate_nurbs(const NurbsParameters& nurbs, double relative_tolerance, const ReportFn& report,
                      const CheckCancelledFn& check_cancelled, MemoryReservation* memory) {
  if (!(relative_tolerance >= 1e-6 && relative_tolerance <= 0.5))
    fail_nurbs("the tessellation tolerance is not within [1e-6, 0.5]");
  const Axis u = make_axis("u", nurbs.nu, nurbs.u_order, nurbs.u_knots, nurbs.u0, nurbs.u1);
  const Axis v = make_axis("v", nurbs.nv, nurbs.v_order, nurbs.v_knots, nurbs.v0, nurbs.v1);
  if (uint64_t{nurbs.nu} * nurbs.nv != nurbs.control_points.size())
    fail_nurbs("the nurbs surface has " + std::to_string(nurbs.control_points.size()) +
               " control points for nu x nv = " + std::to_string(uint64_t{nurbs.nu} * nurbs.nv));
  for (const glm::vec4& p : nurbs.control_points)
    if (!is_finite(Vec3(p)) || !std::isfinite(p.w)) fail_nurbs("a control point is not finite");
  const Surface surface(u, v, nurbs.control_points);
  const Grid grid = refine(u, v, surface, relative_tolerance, report, check_cancelled, memory);
  return mesh_of(grid, surface, check_cancelled);
}

} // namespace packtrace
