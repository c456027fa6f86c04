#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/shapes/quadrics.h"

/// What the tests of quadrics share.
namespace packtrace::quadric_test {

inline constexpr double kPi = std::numbers::pi;
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A quadric with properties that are known without the tessellation.
struct Case {
  std::string name;
  std::function<Mesh(double tolerance)> tessellate;
  std::function<double(DVec3)> distance; ///< an upper bound of the distance to the unlimited surface
  std::function<DVec3(double u, double v)> point;
  double radius = 1.0;
  double area = 0.0;
  bool closed = false; ///< without a boundary
  uint32_t boundary_loops = 0;
};

inline double radial(DVec3 p) { return std::hypot(p.x, p.y); }
inline DVec3 around(double r, double phi, double z) { return {r * std::cos(phi), r * std::sin(phi), z}; }
inline double radians(double degrees) { return degrees * kPi / 180.0; }

inline Case sphere(const std::string& name, SphereParameters s, uint32_t loops) {
  const double r = s.radius, low = std::clamp<double>(std::min(s.z_min, s.z_max), -r, r),
               high = std::clamp<double>(std::max(s.z_min, s.z_max), -r, r);
  const double a = std::acos(low / r), b = std::acos(high / r), phi = radians(std::min(s.phi_max, 360.0f));
  return {name,
          [=](double t) { return tessellate_sphere(s, t); },
          [=](DVec3 p) { return std::abs(glm::length(p) - r); },
          [=](double u, double v) {
            const double theta = a + v * (b - a);
            return around(r * std::sin(theta), u * phi, r * std::cos(theta));
          },
          r,
          phi * r * (high - low),
          loops == 0,
          loops};
}

inline Case cylinder(const std::string& name, CylinderParameters c, uint32_t loops) {
  const double r = c.radius, low = std::min(c.z_min, c.z_max), high = std::max(c.z_min, c.z_max);
  const double phi = radians(c.phi_max);
  return {name,
          [=](double t) { return tessellate_cylinder(c, t); },
          [=](DVec3 p) { return std::abs(radial(p) - r); },
          [=](double u, double v) { return around(r, u * phi, low + v * (high - low)); },
          r,
          phi * r * (high - low),
          false,
          loops};
}

inline Case disk(const std::string& name, DiskParameters d, uint32_t loops) {
  const double r = d.radius, inner = d.inner_radius, phi = radians(d.phi_max);
  return {name,
          [=](double t) { return tessellate_disk(d, t); },
          [=](DVec3 p) { return std::max(std::abs(p.z - d.height), inner - radial(p)); },
          [=](double u, double v) { return around(r + v * (inner - r), u * phi, d.height); },
          r,
          phi * (r * r - inner * inner) / 2,
          false,
          loops};
}

inline Case cone(const std::string& name, ConeParameters c, uint32_t loops) {
  const double r = c.radius, h = c.height, phi = radians(c.phi_max);
  return {name,
          [=](double t) { return tessellate_cone(c, t); },
          [=](DVec3 p) { return std::abs(radial(p) - r * (1.0 - p.z / h)); },
          [=](double u, double v) { return around(r * (1.0 - v), u * phi, v * h); },
          r,
          phi * r * std::hypot(r, h) / 2,
          false,
          loops};
}

/// Distance from (r, z) to z = k r^2. The nearest point lies between the vertical and the horizontal projection.
inline double distance_to_parabola(double k, double r, double z) {
  double a = r, b = std::sqrt(std::max(0.0, z / k));
  const auto at = [&](double x) { return std::hypot(x - r, k * x * x - z); };
  for (int i = 0; i < 30; ++i) {
    const double third = (b - a) / 3;
    if (at(a + third) < at(b - third))
      b -= third;
    else
      a += third;
  }
  return std::min({at(a), at(r), at(b)});
}

inline Case paraboloid(const std::string& name, ParaboloidParameters q, double radius, uint32_t loops) {
  const double low = std::min(q.z_min, q.z_max), high = std::max(q.z_min, q.z_max), phi = radians(q.phi_max);
  const double k = high / (double{q.radius} * q.radius);
  const auto primitive = [k](double r) { return std::pow(1.0 + 4.0 * k * k * r * r, 1.5) / (12.0 * k * k); };
  const double first = std::sqrt((high > 0 ? std::max(low, 0.0) : low) / k);
  return {name,
          [=](double t) { return tessellate_paraboloid(q, t); },
          [=](DVec3 p) { return distance_to_parabola(k, radial(p), p.z); },
          [=](double u, double v) {
            const double z = low + v * (high - low);
            return around(std::sqrt(z / k), u * phi, z);
          },
          radius,
          phi * std::abs(primitive(q.radius) - primitive(first)),
          false,
          loops};
}

inline Case hyperboloid(const std::string& name, HyperboloidParameters q, double radius, double area, uint32_t loops) {
  const bool turned = q.p2.z == 0.0f;
  const DVec3 p1(turned ? q.p2 : q.p1), p2(turned ? q.p1 : q.p2);
  const double phi = radians(q.phi_max);
  return {name,
          [=](double t) { return tessellate_hyperboloid(q, t); },
          [=](DVec3 p) { return std::abs(radial(p) - radial(p1 + (p.z - p1.z) / (p2.z - p1.z) * (p2 - p1))); },
          [=](double u, double v) {
            const DVec3 p = p1 + v * (p2 - p1);
            const double c = std::cos(u * phi), s = std::sin(u * phi);
            return DVec3(p.x * c - p.y * s, p.x * s + p.y * c, p.z);
          },
          radius,
          area,
          false,
          loops};
}

inline std::vector<Case> all_cases() {
  return {
      sphere("sphere", {}, 0),
      sphere("sphere of radius 3", {3.0f, -3.0f, 3.0f, 360.0f}, 0),
      sphere("sphere zone", {2.0f, 1.5f, -0.5f, 360.0f}, 2),
      sphere("sphere cap, limits beyond it", {2.0f, 1.0f, 77.0f, 400.0f}, 1),
      sphere("sphere wedge", {1.0f, -1.0f, 1.0f, 75.0f}, 1),
      cylinder("cylinder", {}, 2),
      cylinder("cylinder piece", {0.25f, 7.0f, -2.0f, 200.0f}, 1),
      disk("disk", {}, 1),
      disk("ring", {-3.0f, 4.0f, 1.0f, 360.0f}, 2),
      disk("ring piece", {0.5f, 4.0f, 3.5f, 10.0f}, 1),
      cone("cone", {}, 1),
      cone("flat cone piece", {2.0f, 0.125f, 300.0f}, 1),
      paraboloid("paraboloid", {}, 1.0, 1),
      paraboloid("tall paraboloid", {0.5f, 0.0f, 20.0f, 360.0f}, 0.5, 1),
      paraboloid("paraboloid from below its apex", {1.0f, -2.0f, 1.0f, 360.0f}, 1.0, 1),
      paraboloid("paraboloid ring", {2.0f, 3.0f, 1.0f, 360.0f}, 2.0, 2),
      paraboloid("hanging paraboloid piece", {1.0f, -4.0f, -1.0f, 90.0f}, 2.0, 1),
      hyperboloid("hyperboloid by default: a cone", {}, std::sqrt(2.0), 2 * kPi * std::sqrt(2.0) * std::sqrt(3.0) / 2,
                  1),
      hyperboloid("cylinder as hyperboloid", {{1, 0, -1}, {1, 0, 2}, 360}, 1.0, 2 * kPi * 3, 2),
      hyperboloid("twisted hyperboloid", {{1, -1, -1}, {1, 1, 1}, 360}, std::sqrt(2.0), -1.0, 2),
      hyperboloid("turned hyperboloid", {{2, 1, 3}, {1, 2, 0}, 120}, std::sqrt(5.0), -1.0, 1),
      hyperboloid("double cone", {{-1, 0, -1}, {2, 0, 2}, 360}, 2.0, kPi * std::sqrt(2.0) * (1 + 4), 2),
  };
}

inline DVec3 corner(const Mesh& mesh, const Triangle& t, int k) { return DVec3(mesh.positions[t[k]]); }

inline DVec3 area_vector(const Mesh& mesh, const Triangle& t) {
  return 0.5 * glm::cross(corner(mesh, t, 1) - corner(mesh, t, 0), corner(mesh, t, 2) - corner(mesh, t, 0));
}

template <class F>
std::optional<ErrorKind> error_of(F f) {
  try {
    f();
  } catch (const Error& error) {
    return error.kind();
  }
  return std::nullopt;
}

} // namespace packtrace::quadric_test
