#include "runtime/voxels/field_tracer.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/scene/math.h"
#include "runtime/ao/hemisphere.h"

namespace packtrace {

namespace {

/// The normal of a hit, which does not point along the ray.
glm::vec3 facing(glm::vec3 gradient, glm::vec3 way, bool from_inside) {
  const float along = glm::dot(gradient, way);
  if (gradient == glm::vec3(0.0f)) return -way; // deep inside, where all stored distances are equal
  if (!(along > 0.0f)) return gradient;
  if (from_inside) return -gradient;
  // Where a ray grazes, interpolated distances may have begun to rise. The opposite normal would lead inside.
  const glm::vec3 across = gradient - along * way;
  const float length = glm::length(across);
  return length > 1e-3f ? across / length : -way;
}

} // namespace

glm::vec3 FieldTracer::gradient(glm::vec3 p) const {
  constexpr float kStep = 0.5f;
  glm::vec3 g;
  for (int a = 0; a < 3; ++a) {
    glm::vec3 step(0.0f);
    step[a] = kStep;
    g[a] = field_->distance(p + step) - field_->distance(p - step);
  }
  const float length = glm::length(g);
  return length > 0.0f ? g / length : g;
}

std::optional<FieldHit> FieldTracer::first_hit(glm::dvec3 origin, glm::dvec3 direction, double t_min,
                                               double t_max) const {
  double enter = t_min, leave = t_max;
  for (int a = 0; a < 3; ++a) {
    const double last = field_->size()[static_cast<size_t>(a)] - 1.0;
    if (direction[a] == 0.0) {
      if (!(origin[a] >= 0.0 && origin[a] <= last)) return std::nullopt;
      continue;
    }
    const double x = -origin[a] / direction[a], y = (last - origin[a]) / direction[a];
    enter = std::max(enter, std::min(x, y)), leave = std::min(leave, std::max(x, y));
  }
  const glm::vec3 start(origin + enter * direction), way(direction);
  if (!(enter <= leave) || !is_finite(start)) return std::nullopt;
  const auto length = static_cast<float>(leave - enter);
  // Interpolated distances may exceed the true ones a little: shorter steps do not pass through thin things.
  constexpr float kCaution = 0.85f, kMinStep = 0.02f;
  const float surface = has_sign_ ? kSurface : kUnsignedSurface;
  for (float t = 0.0f; t <= length;) {
    const glm::vec3 p = start + t * way;
    const float signed_distance = field_->distance(p),
                distance = has_sign_ ? signed_distance : std::abs(signed_distance);
    if (distance < surface) {
      const bool from_inside = has_sign_ && t == 0.0f && signed_distance < 0.0f;
      return FieldHit{enter + double{t}, facing(gradient(p), way, from_inside)};
    }
    // Without signs a step must not end close to the surface, where the gradient would mix both of its sides.
    t += std::max(kCaution * (has_sign_ ? distance : distance - surface), kMinStep);
  }
  return std::nullopt;
}

float FieldTracer::tap_visibility(glm::vec3 p, glm::vec3 normal, float radius) const {
  float missing = 0.0f, weights = 0.0f;
  for (int tap = 1; tap <= 5; ++tap) {
    const float height = radius * static_cast<float>(tap) / 5.0f, weight = std::exp2(-static_cast<float>(tap));
    // Distances beyond the band are only lower bounds.
    const float reach = std::min(height, static_cast<float>(voxels::kFieldBand) - 1.0f);
    missing += weight * std::clamp(1.0f - std::abs(field_->distance(p + normal * height)) / reach, 0.0f, 1.0f);
    weights += weight;
  }
  return 1.0f - missing / weights;
}

float FieldTracer::cone_visibility(glm::vec3 p, glm::vec3 normal, float radius) const {
  // One cone along the normal and five around it share the hemisphere. The outer ones just touch an even surface.
  constexpr float kTangent = 0.5f, kKnown = static_cast<float>(voxels::kFieldBand) - 1.0f;
  const glm::vec3 size(field_->size()[0], field_->size()[1], field_->size()[2]);
  radius = std::min(radius, glm::length(size)); // nothing is known beyond
  float sum = 0.0f, weights = 0.0f;
  for (int cone = 0; cone < 6; ++cone) {
    const float angle = 1.2566371f * static_cast<float>(cone), sine = cone == 0 ? 0.0f : 0.8660254f;
    const glm::vec3 local(sine * std::cos(angle), sine * std::sin(angle), cone == 0 ? 1.0f : 0.5f);
    const glm::vec3 way = turned_to(normal, local);
    float open = 1.0f;
    for (float t = 1.0f; t < radius;) {
      const float distance = field_->distance(p + way * t), width = std::min(kTangent * t, kKnown);
      if (distance < width) open = std::min(open, std::clamp(0.5f + 0.5f * distance / width, 0.0f, 1.0f));
      if (open <= 0.0f) break;
      t += std::max(std::abs(distance), 0.5f);
    }
    sum += local.z * open, weights += local.z;
  }
  return sum / weights;
}

} // namespace packtrace
