#include "tests/benchmarks/trace_benchmark_exact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

namespace packtrace {
namespace {

__extension__ using Quad = __float128;
using QuadVector = std::array<Quad, 3>;

constexpr double kUlp = 0x1p-23;

QuadVector operator-(const QuadVector& a, const QuadVector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
QuadVector cross(const QuadVector& a, const QuadVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Quad dot(const QuadVector& a, const QuadVector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
QuadVector quad(DVec3 v) { return {v.x, v.y, v.z}; }
double length(const QuadVector& v) { return std::sqrt(static_cast<double>(dot(v, v))); }

/// Smallest t of the candidates that are hit in (begin, end); infinity if there is none.
double nearest(std::span<const ExactHit> candidates, double begin, double end) {
  double least = std::numeric_limits<double>::infinity();
  for (const ExactHit& candidate : candidates)
    if (candidate.hit && candidate.t > begin && candidate.t < end) least = std::min(least, candidate.t);
  return least;
}

/// Largest distance from a triangle that counts as rounding, in ulp at the ray's position there.
constexpr double kAsideUlps = 4.0;
bool nearly_hit(const Ray& ray, const ExactHit& hit) {
  const DVec3 place = glm::abs(DVec3(ray.origin) + DVec3(ray.direction) * hit.t);
  const double ulp = std::max(origin_ulp(ray), kUlp * std::max({place.x, place.y, place.z}));
  return hit.hit || hit.aside <= kAsideUlps * ulp;
}

/// The ray's end, moved by the tolerance of t.
double moved_end(const Ray& ray, double sign) {
  return std::isinf(ray.tfar) ? double{ray.tfar} : ray.tfar + sign * t_tolerance(ray, ray.tfar);
}

/// Smallest t of hits that every system must find.
double nearest_required_hit(const Ray& ray, std::span<const ExactHit> candidates) {
  return nearest(candidates, ray.tnear + t_tolerance(ray, ray.tnear), moved_end(ray, -1.0));
}

/// Whether a system may report a hit.
bool possibly(const Ray& ray, std::span<const ExactHit> candidates) {
  const double begin = ray.tnear - t_tolerance(ray, ray.tnear), end = moved_end(ray, 1.0);
  return std::any_of(candidates.begin(), candidates.end(), [&](const ExactHit& candidate) {
    return candidate.t > begin && candidate.t < end && nearly_hit(ray, candidate);
  });
}

/// The distinct triangles that systems report for one ray.
class Candidates {
public:
  Candidates(const Ray& ray, const ExactTriangles& triangles) : ray_(ray), triangles_(triangles) {}

  uint32_t add(uint32_t instance, uint32_t triangle) {
    for (uint32_t i = 0; i < names_.size(); ++i)
      if (names_[i] == std::array{instance, triangle}) return i;
    names_.push_back({instance, triangle});
    hits_.push_back(exact_hit(ray_, triangles_(instance, triangle)));
    return static_cast<uint32_t>(names_.size()) - 1;
  }
  std::span<const ExactHit> hits() const { return hits_; }

private:
  const Ray& ray_;
  const ExactTriangles& triangles_;
  std::vector<std::array<uint32_t, 2>> names_;
  std::vector<ExactHit> hits_;
};

} // namespace

ExactHit exact_hit(const Ray& ray, const ExactTriangle& triangle) {
  const QuadVector origin = quad(DVec3(ray.origin)), d = quad(DVec3(ray.direction));
  const QuadVector a = quad(triangle[0]) - origin, b = quad(triangle[1]) - origin, c = quad(triangle[2]) - origin;
  const QuadVector normal = cross(b - a, c - a);
  const Quad along = dot(d, normal);
  ExactHit out;
  out.aside = std::numeric_limits<double>::infinity();
  if (along == 0) return out;
  out.t = static_cast<double>(dot(a, normal) / along);
  out.height = std::abs(static_cast<double>(along)) / length(normal);
  // Distances outside each edge, oriented by the side from which the ray passes through the plane.
  const Quad sign = along < 0 ? 1 : -1;
  out.aside = 0.0;
  out.hit = true;
  const std::array<const QuadVector*, 4> corners{&a, &b, &c, &a};
  for (size_t i = 0; i < 3; ++i) {
    const Quad outside = sign * dot(d, cross(*corners[i], *corners[i + 1]));
    if (!(outside > 0)) continue;
    out.hit = false;
    const double distance = static_cast<double>(outside) / length(cross(d, *corners[i + 1] - *corners[i]));
    out.aside = std::max(out.aside, distance); // infinite if the ray is parallel to the edge
  }
  return out;
}

double origin_ulp(const Ray& ray) {
  return kUlp * double{std::max({std::abs(ray.origin.x), std::abs(ray.origin.y), std::abs(ray.origin.z)})};
}

double t_tolerance(const Ray& ray, double t) {
  constexpr double kTolerance = 1e-4, kUlps = 4.0;
  return kTolerance * std::abs(t) + kUlps * origin_ulp(ray) / glm::length(DVec3(ray.direction));
}

void HitVerdicts::add(const HitVerdicts& other) {
  missed += other.missed, wrong += other.wrong, farther += other.farther, beside += other.beside, t_off += other.t_off;
  worst_t = std::max(worst_t, other.worst_t), worst_ulps = std::max(worst_ulps, other.worst_ulps);
}

void judge_closest(const Ray& ray, std::span<const ExactHit> candidates, const std::optional<NamedHit>& answer,
                   HitVerdicts& out) {
  const double sure = nearest_required_hit(ray, candidates);
  if (!answer) {
    out.missed += std::isfinite(sure);
    return;
  }
  const ExactHit& named = candidates[answer->candidate];
  if (!nearly_hit(ray, named)) {
    ++out.wrong;
    return;
  }
  if (named.t > sure + t_tolerance(ray, sure)) {
    ++out.farther;
    return;
  }
  if (!named.hit) {
    ++out.beside;
    return;
  }
  const double error = std::abs(answer->t - named.t);
  out.t_off += !(error <= t_tolerance(ray, named.t));
  if (named.t != 0.0) out.worst_t = std::max(out.worst_t, error / std::abs(named.t));
  out.worst_ulps = std::max(out.worst_ulps, error * named.height / origin_ulp(ray));
}

void judge_any(const Ray& ray, std::span<const ExactHit> candidates, bool occluded, HitVerdicts& out) {
  if (!occluded)
    out.missed += std::isfinite(nearest_required_hit(ray, candidates));
  else
    out.wrong += !possibly(ray, candidates);
}

ExactTriangles::ExactTriangles(const BakedFile& file, const UnitSpace& space) : file_(file) {
  for (uint32_t i = 0; i < file.instances().size(); ++i)
    unit_from_object_.push_back(compose(space.unit_from_outer(), DAffine(file.world_from_object(i))));
}

ExactTriangle ExactTriangles::operator()(uint32_t instance, uint32_t triangle) const {
  const uint32_t geometry = file_.instances()[instance].geometry;
  const ClusterView cluster = file_.cluster(geometry, file_.cluster_of_triangle(geometry, triangle));
  const Triangle t = cluster.triangle(triangle - cluster.record().first_triangle);
  const auto vertex = [&](uint32_t v) {
    return transform_point(unit_from_object_[instance], DVec3(cluster.position(v)));
  };
  return {vertex(t.x), vertex(t.y), vertex(t.z)};
}

std::vector<HitVerdicts> judge(std::span<const Ray> rays, const ExactTriangles& triangles,
                               std::span<const SystemHits> systems) {
  using Verdicts = std::vector<HitVerdicts>;
  const auto judge_run = [&](const tbb::blocked_range<size_t>& range, Verdicts verdicts) {
    std::vector<std::optional<NamedHit>> answers(systems.size());
    for (size_t i = range.begin(); i < range.end(); ++i) {
      if (!(rays[i].tnear <= rays[i].tfar)) continue; // gap
      Candidates candidates(rays[i], triangles);
      for (size_t s = 0; s < systems.size(); ++s) {
        answers[s].reset();
        if (systems[s].hits.empty() || !systems[s].hits[i].valid()) continue;
        const RayHit& hit = systems[s].hits[i];
        const HitSurface surface = systems[s].tracer->resolve(hit);
        answers[s] =
            NamedHit{candidates.add(surface.placement->instance, surface.triangle), double{hit.t} * systems[s].t_scale};
      }
      for (size_t s = 0; s < systems.size(); ++s) {
        if (!systems[s].any.empty())
          judge_any(rays[i], candidates.hits(), systems[s].any[i] != 0, verdicts[s]);
        else
          judge_closest(rays[i], candidates.hits(), answers[s], verdicts[s]);
      }
    }
    return verdicts;
  };
  const auto join = [](Verdicts a, const Verdicts& b) {
    for (size_t s = 0; s < a.size(); ++s) a[s].add(b[s]);
    return a;
  };
  return tbb::parallel_reduce(tbb::blocked_range<size_t>(0, rays.size(), 4096), Verdicts(systems.size()), judge_run,
                              join);
}

} // namespace packtrace
