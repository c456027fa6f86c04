#include "pbrt_import/shapes/quadrics.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "pbrt_import/base/error.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {
namespace {

constexpr double kPi = std::numbers::pi;

[[noreturn]] void fail_quadric(const std::string& problem) { throw Error(ErrorKind::kInput, problem); }

void require(bool condition, const char* problem) {
  if (!condition) fail_quadric(problem);
}

void require_finite(std::initializer_list<float> values) {
  for (const float value : values) require(std::isfinite(value), "a parameter is not finite");
}

void require_float_range(double radius) {
  require(radius <= std::numeric_limits<float>::max(), "the quadric leaves the range of single precision");
}

void require_tolerance(double tolerance) {
  require(tolerance >= 1e-6 && tolerance <= 0.5, "the tessellation tolerance is not within [1e-6, 0.5]");
}

/// Number of segments for which the chords of an arc stay within tolerance x radius: 1 - cos(step / 2) <= tolerance.
uint32_t arc_segments(double angle, double tolerance) {
  const double step = 2.0 * std::acos(1.0 - tolerance);
  return static_cast<uint32_t>(std::max(1.0, std::ceil(angle / step - 1e-9)));
}

/// (cos, sin), exact at multiples of 90 degrees and symmetric about them.
glm::dvec2 direction_at(double degrees) {
  const double quarter = std::round(degrees / 90.0);
  const double rest = (degrees - 90.0 * quarter) * (kPi / 180.0), c = std::cos(rest), s = std::sin(rest);
  switch (static_cast<int>(quarter) % 4) {
  case 0:
    return {c, s};
  case 1:
    return {-s, c};
  case 2:
    return {-c, -s};
  default:
    return {s, -c};
  }
}

/// Directions of the columns of a sweep.
struct Sweep {
  std::vector<glm::dvec2> directions; ///< (cos phi, sin phi), segments + 1 elements
  double step = 0.0;                  ///< radians between consecutive columns

  uint32_t segments() const { return static_cast<uint32_t>(directions.size() - 1); }
};

/// All quadrics with the same phi_max get the same columns, so that their rims meet. The sweep may use half of the
/// tolerance, because the sagittas of rows and columns add up in the middle of a cell. Full sweeps get a multiple of
/// four segments, so that they reach their bounding box.
Sweep make_sweep(float phi_max_degrees, double relative_tolerance) {
  require(std::isfinite(phi_max_degrees), "phimax is not finite");
  require(phi_max_degrees > 0.0f, "phimax leaves nothing to draw");
  const double degrees = std::min(phi_max_degrees, 360.0f), angle = degrees * (kPi / 180.0);
  uint32_t segments = arc_segments(angle, relative_tolerance / 2);
  if (degrees == 360.0) segments = (segments + 3) / 4 * 4;
  Sweep sweep{std::vector<glm::dvec2>(segments + size_t{1}), angle / segments};
  for (uint32_t i = 0; i <= segments; ++i) sweep.directions[i] = direction_at(degrees * i / segments);
  return sweep;
}

/// A point of the swept profile: its position at phi = 0 and the surface normal there.
struct ProfilePoint {
  DVec3 position{0.0};
  DVec3 normal{0.0}; ///< along cross(dp/du, dp/dv), nonzero, any length
  double v = 0.0;

  bool is_pole() const { return position.x == 0.0 && position.y == 0.0; }
};

DVec3 rotated(DVec3 p, glm::dvec2 direction) {
  return {p.x * direction.x - p.y * direction.y, p.x * direction.y + p.y * direction.x, p.z};
}

class SweptMesh {
public:
  SweptMesh(const Sweep& sweep, size_t row_count) : sweep_(sweep) {
    const size_t columns = sweep.segments() + size_t{1};
    mesh_.positions.reserve(columns * row_count);
    mesh_.normals.reserve(columns * row_count);
    mesh_.uvs.reserve(columns * row_count);
    mesh_.triangles.reserve(2 * columns * row_count);
  }

  /// Adds a row of vertices and joins it to the previous row. A pole has one vertex per segment, all at the same
  /// position, each with the normal and u of the middle of its triangle.
  void add_row(const ProfilePoint& point) {
    const bool pole = point.is_pole();
    const auto first = static_cast<uint32_t>(mesh_.positions.size());
    const uint32_t segments = sweep_.segments();
    for (uint32_t i = 0; i < segments + (pole ? 0u : 1u); ++i) {
      // The bisector of two adjacent columns is never zero, because a step is less than half a turn.
      const glm::dvec2 direction =
          pole ? glm::normalize(sweep_.directions[i] + sweep_.directions[i + 1]) : sweep_.directions[i];
      mesh_.positions.emplace_back(rotated(point.position, direction) + 0.0); // turns -0 into 0
      mesh_.normals.emplace_back(glm::normalize(rotated(point.normal, direction)));
      mesh_.uvs.emplace_back(static_cast<float>((i + (pole ? 0.5 : 0.0)) / segments), static_cast<float>(point.v));
    }
    if (first != 0) join(first, pole);
    row_ = first;
    row_is_pole_ = pole;
  }

  Mesh take() {
    if (collapsed_) clean_up_mesh(mesh_, {}); // removes their vertices
    require(!mesh_.triangles.empty(), "the quadric is too thin for single precision");
    return std::move(mesh_);
  }

private:
  void join(uint32_t upper, bool upper_is_pole) {
    for (uint32_t i = 0; i < sweep_.segments(); ++i) {
      const uint32_t a = row_ + i, b = a + 1, c = upper + i + 1, d = upper + i;
      if (row_is_pole_) {
        if (!upper_is_pole) add(a, c, d);
        continue;
      }
      if (upper_is_pole) {
        add(a, b, d);
        continue;
      }
      add(a, b, c);
      add(a, c, d);
    }
  }

  /// Adds a triangle, unless rounding to float made two of its corners coincide.
  void add(uint32_t a, uint32_t b, uint32_t c) {
    const Vec3 p = mesh_.positions[a], q = mesh_.positions[b], r = mesh_.positions[c];
    if (p == q || q == r || r == p)
      collapsed_ = true;
    else
      mesh_.triangles.emplace_back(a, b, c);
  }

  const Sweep& sweep_;
  bool collapsed_ = false;
  Mesh mesh_;
  uint32_t row_ = 0;
  bool row_is_pole_ = false;
};

Mesh sweep_profile(const Sweep& sweep, const std::vector<ProfilePoint>& profile, MemoryReservation* memory) {
  const uint64_t vertices = (sweep.segments() + uint64_t{1}) * profile.size();
  reserve_for_shape(memory, vertices * (2 * sizeof(Vec3) + sizeof(Vec2) + 2 * sizeof(Triangle)));
  SweptMesh swept(sweep, profile.size());
  for (const ProfilePoint& point : profile) swept.add_row(point);
  return swept.take();
}

/// i / n, exact at both ends.
double fraction(uint32_t i, uint32_t n) { return static_cast<double>(i) / n; }

/// Radii from r_begin to r_end for which chords of z = k r^2 between neighbours stay within tolerance. The deviation is
/// |k| step^2 / 4 along z, times the cosine of the chord's slope, which is at least 2 |k| r. For any k there are at
/// most about sqrt(r_end / (2 tolerance)) radii.
std::vector<double> parabola_radii(double r_begin, double r_end, double k, double tolerance) {
  std::vector<double> radii{r_begin};
  while (radii.back() < r_end) {
    const double r = radii.back(), slope = 2.0 * k * r, left = r_end - r;
    const double step = 2.0 * std::sqrt(tolerance / std::abs(k)) * std::pow(1.0 + slope * slope, 0.25);
    radii.push_back(left <= step ? r_end : r + std::min(step, left / 2)); // avoids a sliver at the end
  }
  return radii;
}

} // namespace

Mesh tessellate_sphere(const SphereParameters& sphere, double relative_tolerance, MemoryReservation* memory) {
  require_tolerance(relative_tolerance);
  require_finite({sphere.radius, sphere.z_min, sphere.z_max});
  const double radius = sphere.radius;
  require(radius > 0.0, "the sphere's radius is not positive");
  const auto [first, second] = std::minmax({double{sphere.z_min}, double{sphere.z_max}});
  const double low = std::clamp(first, -radius, radius), high = std::clamp(second, -radius, radius);
  require(low < high, "zmin and zmax leave nothing of the sphere");
  const double theta_min = std::acos(low / radius), theta_max = std::acos(high / radius); // names as in pbrt
  const Sweep sweep = make_sweep(sphere.phi_max, relative_tolerance);
  uint32_t rows = arc_segments(theta_min - theta_max, relative_tolerance / 2);
  const bool whole = low == -radius && high == radius;
  if (whole) rows += rows % 2; // puts a row at the equator, so that the sphere reaches its bounding box
  std::vector<ProfilePoint> profile(rows + 1);
  for (uint32_t i = 0; i <= rows; ++i) {
    const double v = fraction(i, rows), theta = theta_min + v * (theta_max - theta_min);
    DVec3 position(radius * std::sin(theta), 0.0, radius * std::cos(theta));
    if (i == 0 || i == rows) { // exact at the ends, where other shapes may meet the sphere
      const double z = i == 0 ? low : high;
      position = {std::sqrt((radius - z) * (radius + z)), 0.0, z};
    } else if (whole && 2 * i == rows) {
      position = {radius, 0.0, 0.0};
    }
    profile[i] = {position, position, v};
  }
  return sweep_profile(sweep, profile, memory);
}

Mesh tessellate_cylinder(const CylinderParameters& cylinder, double relative_tolerance, MemoryReservation* memory) {
  require_tolerance(relative_tolerance);
  require_finite({cylinder.radius, cylinder.z_min, cylinder.z_max});
  require(cylinder.radius > 0.0f, "the cylinder's radius is not positive");
  require(cylinder.z_min != cylinder.z_max, "the cylinder has no height");
  const Sweep sweep = make_sweep(cylinder.phi_max, relative_tolerance);
  const auto [low, high] = std::minmax({double{cylinder.z_min}, double{cylinder.z_max}});
  const double radius = cylinder.radius;
  return sweep_profile(sweep, {{{radius, 0, low}, {1, 0, 0}, 0.0}, {{radius, 0, high}, {1, 0, 0}, 1.0}}, memory);
}

Mesh tessellate_disk(const DiskParameters& disk, double relative_tolerance, MemoryReservation* memory) {
  require_tolerance(relative_tolerance);
  require_finite({disk.height, disk.radius, disk.inner_radius});
  require(disk.radius > 0.0f, "the disk's radius is not positive");
  require(disk.inner_radius >= 0.0f && disk.inner_radius < disk.radius,
          "the disk's inner radius is not within [0, radius)");
  const Sweep sweep = make_sweep(disk.phi_max, relative_tolerance);
  const double height = disk.height;
  return sweep_profile(
      sweep, {{{disk.radius, 0, height}, {0, 0, 1}, 0.0}, {{disk.inner_radius, 0, height}, {0, 0, 1}, 1.0}}, memory);
}

Mesh tessellate_cone(const ConeParameters& cone, double relative_tolerance, MemoryReservation* memory) {
  require_tolerance(relative_tolerance);
  require_finite({cone.radius, cone.height});
  require(cone.radius > 0.0f, "the cone's radius is not positive");
  require(cone.height > 0.0f, "the cone's height is not positive");
  const Sweep sweep = make_sweep(cone.phi_max, relative_tolerance);
  const double radius = cone.radius, height = cone.height;
  const DVec3 normal(height, 0.0, radius);
  return sweep_profile(sweep, {{{radius, 0, 0}, normal, 0.0}, {{0, 0, height}, normal, 1.0}}, memory);
}

Mesh tessellate_paraboloid(const ParaboloidParameters& paraboloid, double relative_tolerance,
                           MemoryReservation* memory) {
  require_tolerance(relative_tolerance);
  require_finite({paraboloid.radius, paraboloid.z_min, paraboloid.z_max});
  require(paraboloid.radius > 0.0f, "the paraboloid's radius is not positive");
  const auto [z_min, z_max] = std::minmax({double{paraboloid.z_min}, double{paraboloid.z_max}});
  require(z_max != 0.0, "the paraboloid's larger z is 0: it is a plane without an end");
  const double radius = paraboloid.radius, k = z_max / (radius * radius); // z = k r^2
  const double low = z_max > 0.0 ? std::max(z_min, 0.0) : z_min;          // v still starts at z_min
  require(low < z_max, "zmin and zmax leave nothing of the paraboloid");
  const double r_low = std::sqrt(low / k), largest = std::max(r_low, radius);
  require_float_range(largest);
  const Sweep sweep = make_sweep(paraboloid.phi_max, relative_tolerance);
  std::vector<double> radii = parabola_radii(std::min(r_low, radius), largest, k, relative_tolerance / 2 * largest);
  if (r_low > radius) std::reverse(radii.begin(), radii.end());
  std::vector<ProfilePoint> profile;
  profile.reserve(radii.size());
  for (const double r : radii) {
    const double z = r == r_low ? low : r == radius ? z_max : k * r * r;
    // dp/du is along +y and dp/dv along (1, 0, 2 k r) / (2 k r), which for k < 0 points towards smaller r.
    profile.push_back({{r, 0, z}, {2.0 * std::abs(k) * r, 0.0, k > 0.0 ? -1.0 : 1.0}, (z - z_min) / (z_max - z_min)});
  }
  return sweep_profile(sweep, profile, memory);
}

Mesh tessellate_hyperboloid(const HyperboloidParameters& hyperboloid, double relative_tolerance,
                            MemoryReservation* memory) {
  require_tolerance(relative_tolerance);
  DVec3 p1(hyperboloid.p1), p2(hyperboloid.p2);
  require(is_finite(p1) && is_finite(p2), "a parameter is not finite");
  if (p2.z == 0.0) std::swap(p1, p2); // pbrt's convention, which flips v and the normal
  const glm::dvec2 q1(p1), q2(p2);
  const double radius = std::max(glm::length(q1), glm::length(q2));
  require(p1.z != p2.z, "the hyperboloid's p1 and p2 are at the same height");
  require(radius > 0.0, "the hyperboloid's p1 and p2 are both on the axis");
  require_float_range(radius);
  const Sweep sweep = make_sweep(hyperboloid.phi_max, relative_tolerance);
  const DVec3 along = p2 - p1;
  const auto facing = [&](glm::dvec2 q) { // cross(dp/du, dp/dv) at the point q of the segment
    return DVec3(q.x * along.z, q.y * along.z, -(q.x * along.x + q.y * along.y));
  };
  if (q1.x * q2.y == q1.y * q2.x && glm::dot(q1, q2) <= 0.0) {
    // The segment meets the axis: one or two cones, each with its own normals at the apex.
    const double v = glm::length(q1) / (glm::length(q1) + glm::length(q2));
    const DVec3 apex(0.0, 0.0, p1.z + v * along.z);
    std::vector<ProfilePoint> profile;
    if (v > 0.0) profile.insert(profile.end(), {{p1, facing(q1), 0.0}, {apex, facing(q1), v}});
    if (v < 1.0) profile.insert(profile.end(), {{apex, facing(q2), v}, {p2, facing(q2), 1.0}});
    return sweep_profile(sweep, profile, memory);
  }
  // Cells between two rulings are saddles, whose diagonals deviate by at most a quarter of the relative turn of their
  // ends.
  const auto rows = static_cast<uint32_t>(
      std::max(1.0, std::ceil(sweep.step * glm::length(q2 - q1) / (4.0 * (relative_tolerance / 2) * radius))));
  std::vector<ProfilePoint> profile(rows + 1);
  for (uint32_t i = 0; i <= rows; ++i) {
    const double v = fraction(i, rows);
    const DVec3 p = i == rows ? p2 : p1 + v * along;
    profile[i] = {p, facing(glm::dvec2(p)), v};
  }
  return sweep_profile(sweep, profile, memory);
}

} // namespace packtrace
