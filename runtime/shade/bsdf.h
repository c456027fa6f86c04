#pragma once

#include <array>
#include <cstdint>

#include "pbrt_import/scene/shading.h"

namespace packtrace {

inline constexpr float kShadePi = 3.14159265358979f;

/// Surfaces with less roughness reflect in one direction only.
inline constexpr float kSmoothAlpha = 1e-3f;

/// Reflectance of an interface of dielectrics for unpolarised light.
/// @param cosine of the angle of incidence, [0, 1]
/// @param eta index of refraction of the far side relative to the near one
/// Source: Fresnel's equations; Physically Based Rendering, 3rd edition, 2016, section 8.2.1.
float fresnel_dielectric(float cosine, float eta);

/// Reflectance of a conductor with the complex index eta + i k. Same source.
float fresnel_conductor(float cosine, float eta, float k);

/// Schlick's approximation. Source: Schlick, An Inexpensive BRDF Model for Physically-based Rendering, 1994.
inline Vec3 fresnel_schlick(Vec3 at_normal, float cosine) {
  const float m = 1.0f - cosine, m2 = m * m;
  return at_normal + (Vec3(1.0f) - at_normal) * (m2 * m2 * m);
}

/// Reflects a unit vector that points away from the surface.
inline Vec3 reflected(Vec3 outgoing, Vec3 normal) { return 2.0f * glm::dot(outgoing, normal) * normal - outgoing; }

/// Refracts a unit vector that points away from the surface; zero for total reflection.
/// @param normal on the side of `outgoing`
/// @param eta index of refraction of the far side relative to the near one
Vec3 refracted(Vec3 outgoing, Vec3 normal, float eta);

/// The GGX (Trowbridge-Reitz) distribution of microfacets with height-correlated shadowing and masking. Vectors are
/// unit vectors in the frame of the surface, whose normal is +z, with z > 0.
/// Source: Heitz, Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, JCGT 2014.
struct Ggx {
  float alpha;

  float density(Vec3 half) const; ///< D
  float lambda(Vec3 v) const;     ///< of Smith's functions
  float masking(Vec3 v) const { return 1.0f / (1.0f + lambda(v)); }
  float shadowing_masking(Vec3 o, Vec3 i) const { return 1.0f / (1.0f + lambda(o) + lambda(i)); }
  /// Samples a microfacet's normal in proportion to its projected area as seen from o.
  /// Source: Heitz, Sampling the GGX Distribution of Visible Normals, JCGT 2018.
  Vec3 visible_normal(Vec3 o, Vec2 u) const;
  /// Density over solid angle of reflected(o, visible_normal()).
  float reflected_density(Vec3 o, Vec3 half) const { return masking(o) * density(half) / (4.0f * o.z); }
};

/// A surface at a hit, ready for shading: the record of its material with the albedo at the hit.
struct ShadedSurface {
  SurfaceShading shading;
  Vec3 diffuse{0.0f};      ///< colour of diffuse reflection before the loss by specular reflection
  Vec3 specular{0.0f};     ///< factor of the Fresnel term, or its value at 0 degrees (kFresnelSchlick)
  Vec3 transmission{0.0f}; ///< factor

  ShadedSurface() = default;
  ShadedSurface(const SurfaceShading& material, Vec3 albedo);

  bool rough() const { return shading.roughness >= kSmoothAlpha; }
  bool reflects() const { return specular != Vec3(0.0f); }
  bool transmits() const { return transmission != Vec3(0.0f); }
  /// Whether light from single directions is reflected, as lights are sampled.
  bool scatters() const { return diffuse != Vec3(0.0f) || (rough() && reflects()); }

  /// Index of refraction of the far side relative to the near one.
  /// @param outer whether the near side is the outer one
  float relative_eta(bool outer) const { return outer ? shading.eta : 1.0f / shading.eta; }
  /// Specular reflectance for an angle of incidence.
  Vec3 reflectance(float cosine, float eta) const;

  /// Diffuse part of the BRDF, times the cosine of i.
  /// @param o, i unit vectors away from the surface, in its frame; z > 0
  /// @param kept fraction of light that specular reflection leaves to the diffuse one
  Vec3 evaluate_diffuse(Vec3 o, Vec3 i, Vec3 kept) const;
  /// Specular part of the BRDF of a rough surface, times the cosine of i; 0 for smooth ones.
  /// @param eta relative_eta()
  Vec3 evaluate_specular(Vec3 o, Vec3 i, float eta) const;
};

/// Fraction of light from a direction that specular reflection returns (directional albedo), by the cosine of the
/// angle: at i / (kCount - 1), linear between. Includes the factor `specular` of a material with an albedo of 1.
class DirectionalAlbedo {
public:
  static constexpr uint32_t kCount = 33;

  DirectionalAlbedo() = default;
  explicit DirectionalAlbedo(const SurfaceShading& material);
  Vec3 at(float cosine) const;

private:
  std::array<Vec3, kCount> values_{};
};

inline float luminance(Vec3 colour) { return 0.2126f * colour.x + 0.7152f * colour.y + 0.0722f * colour.z; }

} // namespace packtrace
