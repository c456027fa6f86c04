#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Bit field of SurfaceShading, identical in memory and in the baked file (docs/shading.md). Undefined bits are 0.
using ShadingBits = uint32_t;

/// How the specular reflection of a surface depends on the angle: the value of the lowest two bits.
inline constexpr ShadingBits kFresnelMask = 3u;
inline constexpr ShadingBits kFresnelNone = 0;       ///< does not depend on it, as pbrt's mirror
inline constexpr ShadingBits kFresnelDielectric = 1; ///< exact, of SurfaceShading::eta
inline constexpr ShadingBits kFresnelConductor = 2;  ///< exact, of metal_eta and metal_k
inline constexpr ShadingBits kFresnelSchlick = 3;    ///< Schlick's approximation: specular is the value at 0 degrees
inline constexpr ShadingBits kThin = 1u << 2;        ///< transmission passes without being refracted
inline constexpr ShadingBits kSpecularTimesAlbedo = 1u << 3; ///< specular is multiplied by the albedo at the hit
inline constexpr ShadingBits kTransmissionTimesAlbedo = 1u << 4;
/// The outer side of the surface, into which an area light emits, is opposite to its geometric normal.
inline constexpr ShadingBits kOuterSideOpposite = 1u << 5;
inline constexpr ShadingBits kAllShadingBits = (1u << 6) - 1;

/// A pbrt material reduced to its shading (docs/shading.md). Colours are linear sRGB, components not negative.
struct SurfaceShading {
  ShadingBits bits = 0;
  float diffuse = 1.0f;    ///< [0,1]: the diffuse colour is this times the albedo at the hit
  Vec3 specular{0.0f};     ///< factor of the Fresnel term; 0: no specular reflection
  Vec3 transmission{0.0f}; ///< 0: opaque
  Vec3 emission{0.0f};     ///< radiance of an area light
  Vec3 metal_eta{1.0f};    ///< complex index of refraction of a conductor
  Vec3 metal_k{0.0f};
  float eta = 1.5f;       ///< index of refraction of a dielectric relative to the outside, [1, 8]
  float roughness = 0.0f; ///< alpha of the GGX distribution, [0, 2]; 0: perfectly smooth
  float sigma = 0.0f;     ///< Oren-Nayar's deviation in degrees, [0, 90]; 0: Lambert

  bool operator==(const SurfaceShading&) const = default;
  ShadingBits fresnel() const { return bits & kFresnelMask; }
  bool emits() const { return emission != Vec3(0.0f); }
  bool transmits() const { return transmission != Vec3(0.0f); }
};

enum class LightKind : uint32_t { kPoint = 0, kSpot = 1, kDistant = 2, kInfinite = 3, kLightKinds = 4 };

inline constexpr uint32_t kNoMap = ~0u;

/// A pbrt LightSource. Area lights are materials with SurfaceShading::emission.
struct Light {
  LightKind kind = LightKind::kPoint;
  /// Point and spot: radiant intensity; distant and infinite: radiance, with a map a factor of it. Not negative.
  Vec3 radiance{1.0f};
  DVec3 position{0.0};              ///< point and spot; relative to Scene::origin
  Vec3 direction{0.0f, 0.0f, 1.0f}; ///< spot: its axis; distant: from the scene to the light; unit length
  float cos_outer = -1.0f;          ///< spot: cosine of the angle from the axis where its light ends
  float cos_inner = 1.0f;           ///< spot: cosine of the angle up to which it is constant, >= cos_outer
  glm::mat3 world_from_light{1.0f}; ///< infinite: orthonormal, may mirror
  uint32_t map = kNoMap;            ///< infinite: index into Scene::environment_maps

  bool operator==(const Light&) const = default;
};

/// Radiance from all directions in latitude and longitude. In light space (x, y, z), the direction at the image's
/// (s, t) in [0,1]^2 has theta = pi t from +z and phi = 2 pi s from +x to +y; row 0 is at t = 0.
struct EnvironmentMap {
  std::string name; ///< file name, for display
  uint32_t width = 0, height = 0;
  std::vector<Vec3> radiance; ///< linear sRGB, finite and not negative
};

/// Largest size at which environment maps are kept; larger images are averaged.
inline constexpr uint32_t kMaxMapWidth = 1024, kMaxMapHeight = 512;

} // namespace packtrace
