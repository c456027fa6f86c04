#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "assets/generator/grass.h"
#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

/// A patch of a tile, which the scene instances.
struct GrassVariant {
  uint32_t lod = 0;
  uint32_t column = 0, row = 0; ///< in the tile
  auto operator<=>(const GrassVariant&) const = default;
};

/// "grass_LOD", or "grass_LOD_NUMBER" if a tile has several patches.
std::string grass_name(const GrassConfig& config, const GrassVariant& variant);

/// Writes geometry/NAME_0000.ply and one file per frame after it; frame f is at phase f / frames. LODs that do not move
/// get the first file only. All files have the same triangles; only the first has texture coordinates.
/// @param frames at least 1
/// Returns the first file's name, relative to the folder. Throws Error(kIo) if writing fails.
std::string write_grass_frames(const GrassField& field, const GrassVariant& variant, uint32_t frames,
                               const OutputConfig& output);

/// Writes the file of `bake --distance-levels` for GrassConfig::lod_distances.
/// @param chains names of objects, kGrassLods each
void write_grass_levels(std::string_view file, const GrassConfig& config,
                        std::span<const std::array<std::string, kGrassLods>> chains, const OutputConfig& output);

/// Writes a picture of grass blades over their texture coordinates: from dark to light green to straw along u, with
/// fractions of the latter as given, and from root to tip along v.
/// @param straw [0, 1]
void write_grass_texture(std::string_view file, double straw, const OutputConfig& output);

} // namespace packtrace::scenegen
