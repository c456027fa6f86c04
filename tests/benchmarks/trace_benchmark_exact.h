#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Vertices in unit space.
using ExactTriangle = std::array<DVec3, 3>;

/// Where a ray meets a triangle, in quadruple precision: for vertices that are floats, signs of edge functions are
/// exact.
struct ExactHit {
  bool hit = false;    ///< within the triangle, edges included, before or behind the origin; not if along its plane
  double t = 0.0;      ///< of the plane, in lengths of the direction; 0 where the ray runs along it
  double height = 0.0; ///< what an error of 1 in t is off the plane
  double aside = 0.0;  ///< how far the ray's line is from that of the edge that it passes farthest outside; 0: hit
};
ExactHit exact_hit(const Ray& ray, const ExactTriangle& triangle);

/// 2^-23 of the largest coordinate of a ray's origin, in which distances off it are given.
double origin_ulp(const Ray& ray);

/// By how much t may be off before it counts: 1e-4 of it and a way of 4 ulp of the ray's origin.
double t_tolerance(const Ray& ray, double t);

/// What systems said of rays, sorted by what is true of the triangles that any of them names.
struct HitVerdicts {
  uint64_t missed = 0;     ///< no hit, though a triangle is hit
  uint64_t wrong = 0;      ///< a triangle that is not hit, by more than rounding, or any hit where nothing near is hit
  uint64_t farther = 0;    ///< a triangle beyond the nearest one
  uint64_t beside = 0;     ///< a triangle that the ray passes outside by rounding: up to 4 ulp
  uint64_t t_off = 0;      ///< the right triangle, at a t that is off
  double worst_t = 0.0;    ///< relative error of t where the right triangle is named
  double worst_ulps = 0.0; ///< there, how far the hit is off the triangle's plane; ulp as in origin_ulp()

  uint64_t all() const { return missed + wrong + farther + beside + t_off; }
  void add(const HitVerdicts& other);
};

/// An answer to a ray.
struct NamedHit {
  uint32_t candidate = 0; ///< index
  double t = 0.0;
};

/// Judges an answer to closest_hits(). Hits within t_tolerance() of the ray's ends may be found or not.
/// @param candidates exact hits of the triangles that were named
void judge_closest(const Ray& ray, std::span<const ExactHit> candidates, const std::optional<NamedHit>& answer,
                   HitVerdicts& out);
/// The same for any_hits().
void judge_any(const Ray& ray, std::span<const ExactHit> candidates, bool occluded, HitVerdicts& out);

/// Triangles of a baked file as its bits say, placed in doubles.
class ExactTriangles {
public:
  ExactTriangles(const BakedFile& file, const UnitSpace& space);
  ExactTriangle operator()(uint32_t instance, uint32_t triangle) const;

private:
  const BakedFile& file_;
  std::vector<DAffine> unit_from_object_;
};

/// Hits of some rays by one system.
struct SystemHits {
  const RayTracer* tracer;
  std::span<const RayHit> hits; ///< empty: it was asked for any hit
  std::span<const uint8_t> any; ///< then: its answers
  double t_scale = 1.0;         ///< what one of its lengths is in the rays' space
};

/// Verdicts for each system. Candidates are what those with hits name.
/// @param rays in the space of `triangles`
std::vector<HitVerdicts> judge(std::span<const Ray> rays, const ExactTriangles& triangles,
                               std::span<const SystemHits> systems);

} // namespace packtrace
