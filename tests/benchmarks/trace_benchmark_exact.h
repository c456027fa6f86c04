#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Triangle corners in unit space.
using ExactTriangle = std::array<DVec3, 3>;

/// Intersection of a ray and a triangle in quadruple precision. If the vertices are floats, signs of edge functions are
/// exact.
struct ExactHit {
  /// The line hits the triangle or its edges, before or behind the origin; false if parallel to its plane.
  bool hit = false;
  double t = 0.0;      ///< at the plane, in lengths of the direction; 0 if the ray is parallel to the plane
  double height = 0.0; ///< distance from the plane that an error of 1 in t causes
  double aside = 0.0;  ///< largest distance between the ray's line and an edge that it passes outside; 0 for a hit
};
ExactHit exact_hit(const Ray& ray, const ExactTriangle& triangle);

/// 2^-23 of the largest |coordinate| of a ray's origin: the unit of distances from the ray.
double origin_ulp(const Ray& ray);

/// Tolerated error of t: 1e-4 |t| plus a distance of 4 ulp of the ray's origin.
double t_tolerance(const Ray& ray, double t);

/// Counts of one system's answers, classified with the exact hits of the triangles that any system reports.
struct HitVerdicts {
  uint64_t missed = 0; ///< no hit, although a triangle is hit
  /// A triangle missed by more than rounding, or an any-hit answer although no triangle is nearly hit.
  uint64_t wrong = 0;
  uint64_t farther = 0; ///< a triangle behind the nearest one
  uint64_t beside = 0;  ///< a triangle that the ray misses by rounding only: up to 4 ulp
  uint64_t t_off = 0;   ///< the right triangle with a wrong t
  double worst_t = 0.0; ///< largest relative error of t for right triangles
  /// For right triangles: largest distance of the hit from the triangle's plane, in units of origin_ulp().
  double worst_ulps = 0.0;

  uint64_t all() const { return missed + wrong + farther + beside + t_off; }
  void add(const HitVerdicts& other);
};

/// A reported hit.
struct NamedHit {
  uint32_t candidate = 0; ///< index of the exact hit in `candidates`
  double t = 0.0;
};

/// Judges an answer of closest_hits(). Hits within t_tolerance() of the ray's ends are optional.
/// @param candidates exact hits of all reported triangles
void judge_closest(const Ray& ray, std::span<const ExactHit> candidates, const std::optional<NamedHit>& answer,
                   HitVerdicts& out);
/// Judges an answer of any_hits().
void judge_any(const Ray& ray, std::span<const ExactHit> candidates, bool occluded, HitVerdicts& out);

/// Triangles of a baked file, decoded and placed in double precision.
class ExactTriangles {
public:
  ExactTriangles(const BakedFile& file, const UnitSpace& space);
  ExactTriangle operator()(uint32_t instance, uint32_t triangle) const;

private:
  const BakedFile& file_;
  std::vector<DAffine> unit_from_object_;
};

/// One system's answers to a set of rays.
struct SystemHits {
  const RayTracer* tracer;
  std::span<const RayHit> hits; ///< answers of closest_hits(); empty if any_hits() was called
  std::span<const uint8_t> any; ///< answers of any_hits()
  double t_scale = 1.0;         ///< factor from the system's lengths to the rays' space
};

/// Judges all systems. The candidates are the triangles that systems with hits report.
/// @param rays in the space of `triangles`
std::vector<HitVerdicts> judge(std::span<const Ray> rays, const ExactTriangles& triangles,
                               std::span<const SystemHits> systems);

} // namespace packtrace
