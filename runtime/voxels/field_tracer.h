#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "compress/format/voxels/distance_field.h"

namespace packtrace {

/// Where a ray meets the surface of a distance field.
struct FieldHit {
  double t;
  glm::vec3 normal; ///< unit, not along the ray: the field's gradient; its opposite if the ray begins inside
};

/// Traces rays through a distance field in its sample units: sample (i, j, k) lies at (i, j, k).
class FieldTracer {
public:
  /// @param field must outlive the tracer
  /// @param has_sign whether distances inside are negative
  FieldTracer(const DistanceField& field, bool has_sign) : field_(&field), has_sign_(has_sign) {}

  /// Sphere tracing: advances by a safe distance until the distance is below kSurface, or
  /// kUnsignedSurface without signs, where interpolated distances do not reach 0 between samples.
  /// Source: Hart, "Sphere Tracing", 1996.
  /// The steps are floats from where the ray enters the field, however far its origin is.
  /// @param direction of unit length
  std::optional<FieldHit> first_hit(glm::dvec3 origin, glm::dvec3 direction, double t_min, double t_max) const;

  /// Ambient occlusion from five taps along the normal, which compare the distance to the surface with the way there.
  /// Source: Evans, "Fast Approximations for Global Illumination on Dynamic Scenes", 2006.
  /// @return visibility, 0..1
  float tap_visibility(glm::vec3 p, glm::vec3 normal, float radius) const;

  /// Ambient occlusion from six cones about the normal, cosine-weighted: each is as open as the narrowest place along
  /// it, compared with its own width there.
  /// @return visibility, 0..1
  float cone_visibility(glm::vec3 p, glm::vec3 normal, float radius) const;

  /// The gradient of the distance, unit length; zero where it is flat.
  glm::vec3 gradient(glm::vec3 p) const;
  /// Distance without sign if the field has none.
  float distance(glm::vec3 p) const { return field_->distance(p); }

  static constexpr float kSurface = 0.05f, kUnsignedSurface = 0.6f; ///< voxels

private:
  const DistanceField* field_;
  bool has_sign_;
};

} // namespace packtrace
