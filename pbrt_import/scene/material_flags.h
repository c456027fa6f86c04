#pragma once

#include <cstdint>

namespace packtrace {

/// Bit field of a material, identical in memory and in the baked file (docs/baked_format.md). Undefined bits are 0.
using MaterialFlags = uint32_t;

inline constexpr MaterialFlags kAlphaMask = 1u << 0;       ///< surface is absent for all rays where the mask is 0
inline constexpr MaterialFlags kShadowAlphaMask = 1u << 1; ///< surface is absent for occlusion rays where the mask is 0
inline constexpr MaterialFlags kTransmissive = 1u << 2;    ///< glass-like: seen by the camera, does not occlude
inline constexpr MaterialFlags kMirror = 1u << 3;          ///< specular reflection dominates
inline constexpr MaterialFlags kEmissive = 1u << 4;        ///< carries an area light
inline constexpr MaterialFlags kEmitsBothSides = 1u << 5;  ///< the area light is twosided
inline constexpr MaterialFlags kInvisible = 1u << 6; ///< pbrt "none" material: camera rays pass, occlusion rays hit
inline constexpr MaterialFlags kAbsent = 1u << 7;    ///< constant alpha 0: no ray hits it; not stored in baked files
inline constexpr MaterialFlags kNoShadow = 1u << 8;  ///< constant shadowalpha 0: camera rays hit, occlusion rays pass
inline constexpr MaterialFlags kAlbedoTexture = 1u << 9; ///< albedo is the average of a texture
inline constexpr MaterialFlags kNormalMap = 1u << 10;    ///< the material has a normal or bump map
inline constexpr MaterialFlags kMetal = 1u << 11;        ///< albedo is the reflectance of a metal
inline constexpr MaterialFlags kAllMaterialFlags = (1u << 12) - 1;

/// Whether camera rays can hit the material.
constexpr bool camera_visible(MaterialFlags flags) { return (flags & (kInvisible | kAbsent)) == 0; }
/// Whether occlusion rays can hit the material.
constexpr bool occludes(MaterialFlags flags) { return (flags & (kTransmissive | kAbsent | kNoShadow)) == 0; }
/// Whether hits must be checked against an alpha mask.
constexpr bool needs_mask(MaterialFlags flags) { return (flags & (kAlphaMask | kShadowAlphaMask)) != 0; }

} // namespace packtrace
