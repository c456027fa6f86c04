#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "assets/generator/wind.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/math.h"

namespace packtrace::scenegen {

inline constexpr uint32_t kGrassLods = 5;
inline constexpr uint32_t kBladeVertices = 7;
inline constexpr uint32_t kBladeTriangles = 5; ///< two quads and a tip

/// Parameters of a field of grass, which is a grid of square patches on the xz plane. Lengths are in units of the
/// scene, y is up. A bend b leans the tip of a blade by atan(b) from the vertical, and lower parts less.
struct GrassConfig {
  uint64_t seed = 5;
  uint32_t blades_per_side = 40;     ///< of a patch at LOD 0; [1, 1000]
  double patch_size = 3.0;           ///< [0.001, 10000]
  uint32_t tile_patches = 1;         ///< patches per axis after which blades and wind repeat; [1, 64]
  double height = 0.5;               ///< mean length of a blade; [0.0001, 1000]
  double height_variation = 0.45;    ///< lengths are height * (1 +- this); a quarter of it varies in clumps; [0, 0.9]
  double clump_size = 0.75;          ///< of places with taller and with greener grass; [patch_size / 64, patch_size]
  double width = 0.03;               ///< of a blade at its root; [0.00001, height]
  double droop = 0.7;                ///< largest bend by gravity; blades have 0.2 to 1 of it in any direction; [0, 4]
  double stiffness_variation = 0.45; ///< the wind bends blades by 1 +- this; [0, 0.9]
  WindConfig wind;
  std::array<double, kGrassLods - 1> lod_distances{34, 64, 120, 200};    ///< at which the next LOD begins; ascending
  std::array<double, kGrassLods> lod_blades{1.0, 0.3, 0.12, 0.05, 0.02}; ///< fraction kept; (0, 1], not ascending
  std::array<double, kGrassLods> lod_wind{1.0, 1.0, 0.75, 0.4, 0.0};     ///< scale of the motion; [0, 1], not ascending
};

/// A blade at rest and how the wind moves it: 88 bytes that do not change over time.
struct GrassBlade {
  Vec3 root;                          ///< patch space: x and z in [0, patch_size), y = 0
  float length;                       ///< of the centre line
  Vec2 side;                          ///< (x, z) from the centre line to an edge, at the root
  Vec2 rest;                          ///< bend (x, z) by gravity and the mean wind
  float colour;                       ///< [0, 1], for lookups in a texture
  float flutter;                      ///< largest bend by the blade's own motion
  Vec2 own_phase;                     ///< cosine and sine
  std::array<Vec2, kWindWaves> gusts; ///< bends along the wind, factors of WindMoment::waves
};

static_assert(sizeof(GrassBlade) == 88);

/// A field of grass: the parameters, checked, and the wind.
struct GrassField {
  GrassConfig config;
  WindField wind;
};

/// Throws Error(kUsage) if a parameter is out of range.
GrassField make_grass_field(const GrassConfig& config);

/// LOD for a patch at a distance from the eye, in [0, kGrassLods).
uint32_t grass_lod(const GrassConfig& config, double distance);

/// Blades of a patch at a LOD, at least 1.
uint32_t grass_blade_count(const GrassConfig& config, uint32_t lod);

/// Blades of the patch whose corner lies at (column, row) * patch_size, in patch space, relative to that corner. Blades
/// of a LOD are among those of the LOD below, at the same places, and wider by 1 / sqrt(lod_blades). The wind belongs
/// to the world, so neighbouring patches move together. Patches tile_patches apart are equal.
/// @param lod less than kGrassLods
std::vector<GrassBlade> make_grass_blades(const GrassField& field, int64_t column, int64_t row, uint32_t lod);

/// Triangles of `triangles.size() / kBladeTriangles` blades. They are the same at all times and for all patches. Pairs
/// (a, b, c) (a, c, d) are the quads.
void write_grass_triangles(std::span<Triangle> triangles);

/// Texture coordinates of kBladeVertices vertices per blade: u is the blade's colour, v is 0 at the root and 1 at the
/// tip. They are the same at all times.
void write_grass_uvs(std::span<const GrassBlade> blades, std::span<Vec2> uvs);

/// Positions of kBladeVertices vertices per blade, in patch space: pairs at the root and at two heights, then the tip.
/// Segments of a centre line keep their lengths, no triangle loses its area, and no vertex goes below y = 0.
void write_grass_positions(std::span<const GrassBlade> blades, const WindMoment& moment, std::span<Vec3> positions);

/// Bounds in patch space that hold at all times.
Bounds grass_bounds(std::span<const GrassBlade> blades);

} // namespace packtrace::scenegen
