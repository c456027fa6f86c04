#include "pbrt_import/shapes/quadrics.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr uint64_t kMaxVertices = uint64_t{1} << 24;

[[noreturn]] void fail(const std::string& problem) { throw Error(ErrorKind::kInput, problem); }

void require(bool condition, const char* problem) {
  if (!condition) fail(problem);
}

void require_finite(std::initializer_list<float> values) {
  for (const float value : values) require(std::isfinite(value), "a parameter is not finite");
}

void require_tolerance(double tolerance) {
  require(tolerance >= 1e-6 && tolerance <= 0.5, "the tessellation tolerance is not within [1e-6, 0.5]");
}

double sweep_angle(float phi_max_degrees) {
  require(std::isfinite(phi_max_degrees), "phimax is not finite");
  require(phi_max_degrees > 0.0f, "phimax leaves nothing to draw");
  return phi_max_degrees >= 360.0f ? 2.0 * kPi : phi_max_degrees * (kPi / 180.0);
}

/// Segments of an arc so that chords stay within tolerance x radius of it: 1 - cos(step / 2) <= tolerance.
uint32_t arc_segments(double angle, double tolerance) {
  const double step = 2.0 * std::acos(1.0 - tolerance);
  return static_cast<uint32_t>(std::max(1.0, std::ceil(angle / step - 1e-9)));
}

/// The directions of the columns of a sweep.
struct Sweep {
  std::vector<glm::dvec2> directions; ///< (cos phi, sin phi), segments + 1 of them
  double angle = 0.0;                 ///< radians

  uint32_t segments() const { return static_cast<uint32_t>(directions.size() - 1); }
};

/// Full sweeps get a multiple of four segments, so that they reach their bounding box, and end exactly where they
/// begin.
Sweep make_sweep(double angle, double tolerance) {
  uint32_t segments = arc_segments(angle, tolerance);
  const bool full = angle == 2.0 * kPi;
  if (full) segments = (segments + 3) / 4 * 4;
  Sweep sweep{std::vector<glm::dvec2>(segments + 1), angle};
  for (uint32_t i = 0; i <= segments; ++i) {
    const double phi = angle * i / segments;
    sweep.directions[i] = {std::cos(phi), std::sin(phi)};
  }
  if (full) {
    const uint32_t quarter = segments / 4;
    const glm::dvec2 axes[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 0}};
    for (uint32_t i = 0; i <= 4; ++i) sweep.directions[i * quarter] = axes[i];
  }
  return sweep;
}

/// A place on the profile that is swept: where it is at phi = 0, and which way the surface faces there.
struct ProfilePoint {
  DVec3 position{0.0};
  DVec3 normal{0.0}; ///< along cross(dp/du, dp/dv), not zero, any length
  double v = 0.0;

  bool is_pole() const { return position.x == 0.0 && position.y == 0.0; }
};

DVec3 rotated(DVec3 p, glm::dvec2 direction) {
  return {p.x * direction.x - p.y * direction.y, p.x * direction.y + p.y * direction.x, p.z};
}

class SweptMesh {
public:
  SweptMesh(const Sweep& sweep, size_t row_count) : sweep_(sweep) {
    if (uint64_t{row_count} * (sweep.segments() + 1) > kMaxVertices)
      throw Error(ErrorKind::kLimitExceeded,
                  "the tolerance asks for more than " + std::to_string(kMaxVertices) + " vertices in one quadric");
    const size_t columns = sweep.segments() + size_t{1};
    mesh_.positions.reserve(columns * row_count);
    mesh_.normals.reserve(columns * row_count);
    mesh_.uvs.reserve(columns * row_count);
    mesh_.triangles.reserve(2 * columns * row_count);
  }

  /// Adds a row of vertices and joins it to the one before. A pole has one vertex per segment, in the middle of its u:
  /// all at the same place, but each with the normal and u of the triangle that ends there.
  void add_row(const ProfilePoint& point) {
    const bool pole = point.is_pole();
    const auto first = static_cast<uint32_t>(mesh_.positions.size());
    const uint32_t segments = sweep_.segments();
    for (uint32_t i = 0; i < segments + (pole ? 0u : 1u); ++i) {
      // The bisector of two neighbouring columns; never zero, as a sweep step is less than half a turn.
      const glm::dvec2 direction =
          pole ? glm::normalize(sweep_.directions[i] + sweep_.directions[i + 1]) : sweep_.directions[i];
      mesh_.positions.emplace_back(rotated(point.position, direction));
      mesh_.normals.emplace_back(glm::normalize(rotated(point.normal, direction)));
      mesh_.uvs.emplace_back(static_cast<float>((i + (pole ? 0.5 : 0.0)) / segments), static_cast<float>(point.v));
    }
    if (first != 0) join(first, pole);
    row_ = first;
    row_is_pole_ = pole;
  }

  Mesh take() { return std::move(mesh_); }

private:
  void join(uint32_t upper, bool upper_is_pole) {
    for (uint32_t i = 0; i < sweep_.segments(); ++i) {
      const uint32_t a = row_ + i, b = a + 1, c = upper + i + 1, d = upper + i;
      if (row_is_pole_) {
        if (!upper_is_pole) mesh_.triangles.emplace_back(a, c, d);
        continue;
      }
      if (upper_is_pole) {
        mesh_.triangles.emplace_back(a, b, d);
        continue;
      }
      mesh_.triangles.emplace_back(a, b, c);
      mesh_.triangles.emplace_back(a, c, d);
    }
  }

  const Sweep& sweep_;
  Mesh mesh_;
  uint32_t row_ = 0;
  bool row_is_pole_ = false;
};

Mesh sweep_profile(const Sweep& sweep, const std::vector<ProfilePoint>& profile) {
  SweptMesh swept(sweep, profile.size());
  for (const ProfilePoint& point : profile) swept.add_row(point);
  return swept.take();
}

/// t = i / n, exact at both ends.
double fraction(uint32_t i, uint32_t n) { return static_cast<double>(i) / n; }

/// Rows for a curve parameter whose own bound says how many segments it needs.
uint32_t profile_segments(double needed) {
  if (!(needed < static_cast<double>(kMaxVertices)))
    throw Error(ErrorKind::kLimitExceeded, "the quadric's shape asks for too many segments");
  return std::max(1u, static_cast<uint32_t>(std::ceil(needed)));
}

} // namespace

Mesh tessellate_sphere(const SphereParameters& sphere, double relative_tolerance) {
  require_tolerance(relative_tolerance);
  require_finite({sphere.radius, sphere.z_min, sphere.z_max});
  const double radius = sphere.radius;
  require(radius > 0.0, "the sphere's radius is not positive");
  const auto [low, high] = std::minmax({double{sphere.z_min}, double{sphere.z_max}});
  const double theta_min = std::acos(std::clamp(low, -radius, radius) / radius); // the larger angle: pbrt's names
  const double theta_max = std::acos(std::clamp(high, -radius, radius) / radius);
  require(theta_min > theta_max, "zmin and zmax leave nothing of the sphere");
  // Each direction may use half of the tolerance: their sagittas add up in the middle of a cell.
  const Sweep sweep = make_sweep(sweep_angle(sphere.phi_max), relative_tolerance / 2);
  uint32_t rows = arc_segments(theta_min - theta_max, relative_tolerance / 2);
  const bool whole = theta_min == kPi && theta_max == 0.0;
  if (whole) rows += rows % 2; // a row at the equator, so that the sphere reaches its bounding box
  std::vector<ProfilePoint> profile(rows + 1);
  for (uint32_t i = 0; i <= rows; ++i) {
    const double v = fraction(i, rows), theta = theta_min + v * (theta_max - theta_min);
    const double z = i == 0 ? std::cos(theta_min) : i == rows ? std::cos(theta_max) : std::cos(theta);
    const bool pole = (i == 0 && theta_min == kPi) || (i == rows && theta_max == 0.0);
    const bool equator = whole && 2 * i == rows;
    const DVec3 normal = pole ? DVec3(0.0, 0.0, z) : equator ? DVec3(1, 0, 0) : DVec3(std::sin(theta), 0.0, z);
    profile[i] = {normal * radius, normal, v};
  }
  return sweep_profile(sweep, profile);
}

Mesh tessellate_cylinder(const CylinderParameters& cylinder, double relative_tolerance) {
  require_tolerance(relative_tolerance);
  require_finite({cylinder.radius, cylinder.z_min, cylinder.z_max});
  require(cylinder.radius > 0.0f, "the cylinder's radius is not positive");
  require(cylinder.z_min != cylinder.z_max, "the cylinder has no height");
  const Sweep sweep = make_sweep(sweep_angle(cylinder.phi_max), relative_tolerance);
  const auto [low, high] = std::minmax({double{cylinder.z_min}, double{cylinder.z_max}});
  const double radius = cylinder.radius;
  return sweep_profile(sweep, {{{radius, 0, low}, {1, 0, 0}, 0.0}, {{radius, 0, high}, {1, 0, 0}, 1.0}});
}

Mesh tessellate_disk(const DiskParameters& disk, double relative_tolerance) {
  require_tolerance(relative_tolerance);
  require_finite({disk.height, disk.radius, disk.inner_radius});
  require(disk.radius > 0.0f, "the disk's radius is not positive");
  require(disk.inner_radius >= 0.0f && disk.inner_radius < disk.radius,
          "the disk's inner radius is not within [0, radius)");
  const Sweep sweep = make_sweep(sweep_angle(disk.phi_max), relative_tolerance);
  const double height = disk.height;
  return sweep_profile(sweep,
                       {{{disk.radius, 0, height}, {0, 0, 1}, 0.0}, {{disk.inner_radius, 0, height}, {0, 0, 1}, 1.0}});
}

Mesh tessellate_cone(const ConeParameters& cone, double relative_tolerance) {
  require_tolerance(relative_tolerance);
  require_finite({cone.radius, cone.height});
  require(cone.radius > 0.0f, "the cone's radius is not positive");
  require(cone.height > 0.0f, "the cone's height is not positive");
  const Sweep sweep = make_sweep(sweep_angle(cone.phi_max), relative_tolerance);
  const double radius = cone.radius, height = cone.height;
  const DVec3 normal(height, 0.0, radius);
  return sweep_profile(sweep, {{{radius, 0, 0}, normal, 0.0}, {{0, 0, height}, normal, 1.0}});
}

Mesh tessellate_paraboloid(const ParaboloidParameters& paraboloid, double relative_tolerance) {
  require_tolerance(relative_tolerance);
  require_finite({paraboloid.radius, paraboloid.z_min, paraboloid.z_max});
  require(paraboloid.radius > 0.0f, "the paraboloid's radius is not positive");
  const auto [z_min, z_max] = std::minmax({double{paraboloid.z_min}, double{paraboloid.z_max}});
  require(z_max != 0.0, "the paraboloid's larger z is 0: it is a plane without an end");
  const double radius = paraboloid.radius, k = z_max / (radius * radius); // z = k r^2
  const double low = z_max > 0.0 ? std::max(z_min, 0.0) : z_min;          // v still counts from z_min
  require(low < z_max, "zmin and zmax leave nothing of the paraboloid");
  const double r_low = std::sqrt(low / k), r_high = radius;
  const Sweep sweep = make_sweep(sweep_angle(paraboloid.phi_max), relative_tolerance / 2);
  // Steps of equal r: a chord's sagitta along z is |k| step^2 / 4.
  const double largest = std::max(r_low, r_high);
  const double step = std::sqrt(4.0 * (relative_tolerance / 2) * largest / std::abs(k));
  const uint32_t rows = profile_segments(std::abs(r_high - r_low) / step);
  std::vector<ProfilePoint> profile(rows + 1);
  for (uint32_t i = 0; i <= rows; ++i) {
    const double r = i == rows ? r_high : r_low + fraction(i, rows) * (r_high - r_low);
    const double z = i == 0 ? low : i == rows ? z_max : k * r * r;
    // dp/du is along +y and dp/dv along (1, 0, 2 k r) / (2 k r), which for k < 0 points towards smaller r.
    profile[i] = {{r, 0, z}, {2.0 * std::abs(k) * r, 0.0, k > 0.0 ? -1.0 : 1.0}, (z - z_min) / (z_max - z_min)};
  }
  return sweep_profile(sweep, profile);
}

Mesh tessellate_hyperboloid(const HyperboloidParameters& hyperboloid, double relative_tolerance) {
  require_tolerance(relative_tolerance);
  DVec3 p1(hyperboloid.p1), p2(hyperboloid.p2);
  require(is_finite(p1) && is_finite(p2), "a parameter is not finite");
  if (p2.z == 0.0) std::swap(p1, p2); // pbrt's convention; it turns v and the normal over
  const glm::dvec2 q1(p1), q2(p2);
  const double radius = std::max(glm::length(q1), glm::length(q2));
  require(p1.z != p2.z, "the hyperboloid's p1 and p2 are at the same height");
  require(radius > 0.0, "the hyperboloid's p1 and p2 are both on the axis");
  const Sweep sweep = make_sweep(sweep_angle(hyperboloid.phi_max), relative_tolerance / 2);
  const DVec3 along = p2 - p1;
  const auto facing = [&](glm::dvec2 q) { // cross(dp/du, dp/dv) where the segment is at q
    return DVec3(q.x * along.z, q.y * along.z, -(q.x * along.x + q.y * along.y));
  };
  if (q1.x * q2.y == q1.y * q2.x && glm::dot(q1, q2) <= 0.0) {
    // The segment meets the axis: one cone or two, each with its own normals at the apex.
    const double v = glm::length(q1) / (glm::length(q1) + glm::length(q2));
    const DVec3 apex(0.0, 0.0, p1.z + v * along.z);
    std::vector<ProfilePoint> profile;
    if (v > 0.0) profile.insert(profile.end(), {{p1, facing(q1), 0.0}, {apex, facing(q1), v}});
    if (v < 1.0) profile.insert(profile.end(), {{apex, facing(q2), v}, {p2, facing(q2), 1.0}});
    return sweep_profile(sweep, profile);
  }
  // Cells between two rulings are saddles: a diagonal leaves them by at most a quarter of their ends' relative turn.
  const double step = sweep.angle / sweep.segments();
  const uint32_t rows = profile_segments(step * glm::length(q2 - q1) / (4.0 * (relative_tolerance / 2) * radius));
  std::vector<ProfilePoint> profile(rows + 1);
  for (uint32_t i = 0; i <= rows; ++i) {
    const double v = fraction(i, rows);
    const DVec3 p = i == rows ? p2 : p1 + v * along;
    profile[i] = {p, facing(glm::dvec2(p)), v};
  }
  return sweep_profile(sweep, profile);
}

} // namespace packtrace
