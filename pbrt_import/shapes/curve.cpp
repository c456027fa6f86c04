#include "pbrt_import/shapes/curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "pbrt_import/base/error.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {
namespace {

using Bezier = std::array<DVec3, 4>;
constexpr uint32_t kSides = 8; // sagitta of a side: 1 - cos(pi / 8) = 7.6% of the radius, within width / 20
constexpr size_t kMaxStations = (size_t{1} << 24) / (kSides + 1);
// Memory of the mesh per station: a row of vertices and two triangles per vertex.
constexpr uint64_t kBytesPerStation = (kSides + 1) * (2 * sizeof(Vec3) + sizeof(Vec2) + 2 * sizeof(Triangle));

[[noreturn]] void fail_curve(const std::string& problem) { throw Error(ErrorKind::kInput, problem); }

Bezier elevated(DVec3 a, DVec3 b, DVec3 c) { return {a, glm::mix(a, b, 2.0 / 3.0), glm::mix(b, c, 1.0 / 3.0), c}; }

/// Converts all segments to cubic Bezier curves.
std::vector<Bezier> segments_of(const CurveParameters& curve) {
  if (curve.degree != 2 && curve.degree != 3) fail_curve("the curve's degree is neither 2 nor 3");
  const size_t degree = curve.degree, count = curve.points.size();
  const bool bezier = curve.basis == CurveBasis::kBezier;
  if (count < degree + 1 || (bezier && (count - 1) % degree != 0))
    fail_curve(std::to_string(count) + " control points do not make curve segments of degree " +
               std::to_string(degree));
  const size_t segment_count = bezier ? (count - 1) / degree : count - degree;
  std::vector<Bezier> segments(segment_count);
  for (size_t s = 0; s < segment_count; ++s) {
    std::array<DVec3, 4> p{};
    const size_t first = bezier ? s * degree : s;
    for (size_t i = 0; i <= degree; ++i) p[i] = DVec3(curve.points[first + i]);
    if (bezier && degree == 3)
      segments[s] = p;
    else if (bezier)
      segments[s] = elevated(p[0], p[1], p[2]);
    else if (degree == 2)
      segments[s] = elevated((p[0] + p[1]) / 2.0, p[1], (p[1] + p[2]) / 2.0);
    else
      segments[s] = {(p[0] + 4.0 * p[1] + p[2]) / 6.0, (2.0 * p[1] + p[2]) / 3.0, (p[1] + 2.0 * p[2]) / 3.0,
                     (p[1] + 4.0 * p[2] + p[3]) / 6.0};
  }
  return segments;
}

/// A cross-section of the curve.
struct Station {
  DVec3 centre{0.0};
  DVec3 tangent{0.0}; ///< unit length
  DVec3 normal{0.0};  ///< unit length; perpendicular to the tangent in tubes
  double width = 0.0;
  double u = 0.0;
};

DVec3 tangent_at(const Bezier& b, double t) {
  const double s = 1.0 - t;
  const DVec3 d = s * s * (b[1] - b[0]) + 2.0 * s * t * (b[2] - b[1]) + t * t * (b[3] - b[2]);
  return glm::dot(d, d) > 0.0 ? d : b[3] - b[0]; // if control points coincide, as in pbrt
}

DVec3 point_at(const Bezier& b, double t) {
  const double s = 1.0 - t;
  return s * s * s * b[0] + 3.0 * s * s * t * b[1] + 3.0 * s * t * t * b[2] + t * t * t * b[3];
}

/// Number of pieces of equal parameter range for which chords stay within tolerance. The second derivative is at most 6
/// times the largest second difference of the control points.
uint32_t piece_count(const Bezier& b, double tolerance) {
  const double bend = std::max(glm::length(b[0] - 2.0 * b[1] + b[2]), glm::length(b[1] - 2.0 * b[2] + b[3]));
  return static_cast<uint32_t>(std::max(1.0, std::ceil(std::sqrt(6.0 * bend / (8.0 * tolerance)))));
}

/// Tolerance of chords: width / 20, as in pbrt, but not finer than the float precision at the control points. With that
/// bound no segment needs more than 7000 pieces.
double centre_tolerance(const CurveParameters& curve) {
  float largest = 0.0f;
  for (const Vec3& p : curve.points) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  constexpr double kRounding = 1.0 / (1 << 23);
  return std::max(double{std::max(curve.width0, curve.width1)} / 20.0, kRounding * largest);
}

/// Spherical interpolation of a ribbon's normals, as in pbrt.
DVec3 slerp(DVec3 a, DVec3 b, double t) {
  const double angle = std::acos(std::clamp(glm::dot(a, b), 0.0, 1.0)), sine = std::sin(angle);
  if (sine < 1e-6) return glm::mix(a, b, t);
  return (std::sin((1.0 - t) * angle) * a + std::sin(t * angle) * b) / sine;
}

DVec3 unit(Vec3 v) {
  const double length = glm::length(DVec3(v));
  if (!(length > 0.0) || !std::isfinite(length)) fail_curve("a curve's normal is zero or not finite");
  return DVec3(v) / length;
}

[[noreturn]] void fail_too_long() {
  throw Error(ErrorKind::kLimitExceeded, "the curve's width asks for more than 2^24 vertices");
}

/// Places stations along the segments wherever a cross-section is needed.
class StationMaker {
public:
  StationMaker(const CurveParameters& curve, std::span<const Bezier> segments, MemoryReservation* memory)
      : curve_(curve), segment_count_(static_cast<double>(segments.size())), tolerance_(centre_tolerance(curve)) {
    uint64_t count = 1;
    for (const Bezier& b : segments) count += piece_count(b, tolerance_);
    if (count > kMaxStations) fail_too_long();
    reserve_for_shape(memory, count * (sizeof(Station) + kBytesPerStation));
    stations_.reserve(count);
    for (size_t s = 0; s < segments.size(); ++s) add_segment(segments[s], s);
  }

  std::vector<Station> take() {
    if (stations_.size() < 2) fail_curve("the curve has no length");
    return std::move(stations_);
  }

private:
  static constexpr double kSmooth = 0.999; // cosine of 2.6 degrees
  // Cosine of 37 degrees, where the outside of a bend loses 5% of the radius.
  static constexpr double kLargestTurn = 0.8;

  void add_segment(const Bezier& b, size_t index) {
    if (glm::dot(tangent_at(b, 0.0), tangent_at(b, 0.0)) == 0.0) return; // pbrt never hits a segment of zero length
    const uint32_t pieces = piece_count(b, tolerance_);
    Station from = station_at(b, index, 0.0);
    // At a corner, this segment starts with its own cross-section after the last one of the previous segment.
    if (stations_.empty() || glm::dot(stations_.back().tangent, from.tangent) < kSmooth) push(from);
    for (uint32_t i = 1; i <= pieces; ++i) {
      const Station to = station_at(b, index, static_cast<double>(i) / pieces);
      add_piece(b, index, from, static_cast<double>(i - 1) / pieces, to, static_cast<double>(i) / pieces);
      from = to;
    }
  }

  /// Splits a piece recursively while it turns too far, down to a size at which it may be a cusp.
  void add_piece(const Bezier& b, size_t index, const Station& from, double t_from, const Station& to, double t_to) {
    constexpr double kShortest = 1e-6; // in units of the segment's parameter
    if (glm::dot(from.tangent, to.tangent) < kLargestTurn && t_to - t_from > kShortest) {
      const double middle = (t_from + t_to) / 2;
      const Station between = station_at(b, index, middle);
      add_piece(b, index, from, t_from, between, middle);
      add_piece(b, index, between, middle, to, t_to);
    } else {
      push(to);
    }
  }

  void push(const Station& station) {
    if (stations_.size() == kMaxStations) fail_too_long();
    stations_.push_back(station);
  }

  Station station_at(const Bezier& b, size_t index, double t) const {
    const double u = (static_cast<double>(index) + t) / segment_count_;
    Station station{point_at(b, t), DVec3(0.0), DVec3(0.0), glm::mix(double{curve_.width0}, double{curve_.width1}, u),
                    u};
    const DVec3 tangent = tangent_at(b, t);
    // The derivative and the chord may both be zero in a closed loop; any direction is then acceptable.
    if (glm::dot(tangent, tangent) > 0.0)
      station.tangent = glm::normalize(tangent);
    else
      station.tangent = stations_.empty() ? glm::normalize(tangent_at(b, 0.0)) : stations_.back().tangent;
    if (curve_.type == CurveType::kRibbon)
      station.normal = slerp(unit(curve_.normals[index]), unit(curve_.normals[index + 1]), t);
    return station;
  }

  const CurveParameters& curve_;
  double segment_count_;
  double tolerance_;
  std::vector<Station> stations_;
};

/// Computes rotation-minimising frames: each normal is the previous one, reflected twice.
void add_rotation_minimizing_frames(std::vector<Station>& stations) {
  const DVec3 t = stations[0].tangent;
  const DVec3 axis = std::abs(t.x) < 0.6 ? DVec3(1, 0, 0) : DVec3(0, 1, 0);
  stations[0].normal = glm::normalize(glm::cross(t, axis));
  for (size_t i = 1; i < stations.size(); ++i) {
    const Station& before = stations[i - 1];
    const auto reflected = [](DVec3 x, DVec3 across) {
      const double square = glm::dot(across, across);
      return square > 0.0 ? x - (2.0 * glm::dot(across, x) / square) * across : x;
    };
    const DVec3 step = stations[i].centre - before.centre;
    const DVec3 normal = reflected(before.normal, step), tangent = reflected(before.tangent, step);
    DVec3 turned = reflected(normal, stations[i].tangent - tangent);
    turned -= glm::dot(turned, stations[i].tangent) * stations[i].tangent; // prevents rounding errors from accumulating
    stations[i].normal = glm::normalize(turned);
  }
}

/// Joins consecutive rows of row_size vertices by triangles, omitting those that collapsed because the width is zero.
void join_rows(Mesh& mesh, uint32_t row_size) {
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
    const Vec3 p = mesh.positions[a], q = mesh.positions[b], r = mesh.positions[c];
    if (p != q && q != r && r != p) mesh.triangles.emplace_back(a, b, c);
  };
  for (uint32_t row = 0; row + row_size < mesh.positions.size(); row += row_size) {
    for (uint32_t i = 0; i + 1 < row_size; ++i) {
      const uint32_t a = row + i, b = a + row_size, c = b + 1, d = a + 1;
      add(a, b, c);
      add(a, c, d);
    }
  }
}

Mesh make_tube(std::vector<Station> stations) {
  add_rotation_minimizing_frames(stations);
  Mesh mesh;
  for (const Station& s : stations) {
    const DVec3 other = glm::cross(s.normal, s.tangent); // such that the surface normal points outwards
    for (uint32_t i = 0; i <= kSides; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i % kSides) / kSides; // the columns of the seam coincide
      const DVec3 out = std::cos(angle) * s.normal + std::sin(angle) * other;
      mesh.positions.emplace_back(s.centre + out * (s.width / 2));
      mesh.normals.emplace_back(out);
      mesh.uvs.emplace_back(s.u, static_cast<double>(i) / kSides);
    }
  }
  join_rows(mesh, kSides + 1);
  return mesh;
}

Mesh make_ribbon(const std::vector<Station>& stations) {
  Mesh mesh;
  for (const Station& s : stations) {
    const DVec3 across = glm::cross(s.normal, s.tangent);
    const double length = glm::length(across);
    if (!(length > 1e-12)) continue; // the normal is parallel to the curve: no ribbon here
    const DVec3 half = across * (s.width / (2.0 * length));
    for (const double v : {0.0, 1.0}) {
      mesh.positions.emplace_back(s.centre + half * (2.0 * v - 1.0));
      mesh.normals.emplace_back(glm::normalize(glm::cross(s.tangent, across)));
      mesh.uvs.emplace_back(s.u, v);
    }
  }
  join_rows(mesh, 2);
  return mesh;
}

} // namespace

Mesh tessellate_curve(const CurveParameters& curve, MemoryReservation* memory) {
  for (const Vec3& p : curve.points)
    if (!is_finite(p)) fail_curve("a control point of the curve is not finite");
  if (!std::isfinite(curve.width0) || !std::isfinite(curve.width1) || curve.width0 < 0.0f || curve.width1 < 0.0f)
    fail_curve("a width of the curve is negative or not finite");
  if (curve.width0 == 0.0f && curve.width1 == 0.0f) fail_curve("the curve has no width");
  const std::vector<Bezier> segments = segments_of(curve);
  const bool ribbon = curve.type == CurveType::kRibbon;
  if (ribbon && curve.normals.size() != segments.size() + 1)
    fail_curve("a ribbon of " + std::to_string(segments.size()) +
               " segments needs one normal more than segments, not " + std::to_string(curve.normals.size()));
  std::vector<Station> stations = StationMaker(curve, segments, memory).take();
  // Vectors double their capacity as they grow.
  reserve_for_shape(memory, stations.size() * (sizeof(Station) + 2 * kBytesPerStation));
  Mesh mesh = ribbon ? make_ribbon(stations) : make_tube(std::move(stations));
  for (const Vec3& p : mesh.positions)
    if (!is_finite(p)) fail_curve("the curve leaves the range of single precision");
  clean_up_mesh(mesh, {}); // removes vertices of omitted triangles
  if (mesh.triangles.empty()) fail_curve("nothing of the curve can be drawn");
  return mesh;
}

} // namespace packtrace
