#pragma once

#include <cstdint>

#include "pbrt_import/scene/shading.h"

namespace packtrace::shading_stream {

// A material's first word: its ShadingBits, and which of its properties follow. A property that does not follow has
// the value of SurfaceShading{}.
inline constexpr uint32_t kHasDiffuse = 1u << 8;
inline constexpr uint32_t kHasSpecular = 1u << 9;
inline constexpr uint32_t kHasTransmission = 1u << 10;
inline constexpr uint32_t kHasEmission = 1u << 11;
inline constexpr uint32_t kHasMetal = 1u << 12;
inline constexpr uint32_t kHasEta = 1u << 13;
inline constexpr uint32_t kHasRoughness = 1u << 14;
inline constexpr uint32_t kHasSigma = 1u << 15;
inline constexpr uint32_t kAllMaterialBits = kAllShadingBits | 0xff00u;

inline constexpr float kMaxEta = 8.0f, kMaxRoughness = 2.0f, kMaxSigma = 90.0f, kMaxMetalIndex = 1e6f;
inline constexpr uint32_t kMaxMapName = 4096; ///< bytes

/// Visits the properties of a material in the order of the stream: visit(bit, value, low, high).
template <class Shading, class Visit>
void for_each_property(Shading& s, const Visit& visit) {
  constexpr float kAny = 3e38f; // any finite float
  visit(kHasDiffuse, s.diffuse, 0.0f, 1.0f);
  visit(kHasSpecular, s.specular, 0.0f, 1.0f);
  visit(kHasTransmission, s.transmission, 0.0f, 1.0f);
  visit(kHasEmission, s.emission, 0.0f, kAny);
  visit(kHasMetal, s.metal_eta, 0.0f, kMaxMetalIndex);
  visit(kHasMetal, s.metal_k, 0.0f, kMaxMetalIndex);
  visit(kHasEta, s.eta, 1.0f, kMaxEta);
  visit(kHasRoughness, s.roughness, 0.0f, kMaxRoughness);
  visit(kHasSigma, s.sigma, 0.0f, kMaxSigma);
}

/// Visits the properties of a light that its kind has, after kind and radiance: visit(value, low, high).
template <class LightT, class Visit>
void for_each_light_property(LightT& light, const Visit& visit) {
  constexpr float kAny = 3e38f, kOne = 1.0f + 1e-5f;
  if (light.kind == LightKind::kPoint || light.kind == LightKind::kSpot) visit(light.position, -kAny, kAny);
  if (light.kind == LightKind::kSpot || light.kind == LightKind::kDistant) visit(light.direction, -kOne, kOne);
  if (light.kind == LightKind::kSpot) visit(light.cos_outer, -1.0f, 1.0f), visit(light.cos_inner, -1.0f, 1.0f);
  if (light.kind == LightKind::kInfinite)
    for (int c = 0; c < 3; ++c) visit(light.world_from_light[c], -kOne, kOne);
}

} // namespace packtrace::shading_stream
