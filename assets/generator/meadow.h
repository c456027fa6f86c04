#pragma once

#include <cstdint>

#include "assets/generator/grass.h"
#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct MeadowConfig {
  uint64_t seed = 5;
  uint32_t patches = 3200;         ///< placed, nearest first; [1, 5000]
  uint32_t blades = 1444;          ///< of a patch at LOD 0, a square number; [1, 1000000]
  uint32_t tile = 1;               ///< patches per axis until blades and wind repeat; [1, 16]
  uint32_t frames = 12;            ///< after which all motion repeats; [1, 10000]
  double frames_per_second = 12.0; ///< [1, 240]
  double wind = 1.0;               ///< scale of the wind's strength; [0, 4]
};

/// The grass of a meadow. Throws Error(kUsage) if config is out of range.
GrassConfig meadow_grass(const MeadowConfig& config);

/// Writes a meadow with a lane, a windmill and birds: FOLDER/meadow.pbrt. Grass is instances of one patch per LOD (and
/// place in the tile), whose frames are geometry/grass_LOD_0000.ply and so on. The windmill and the birds move from
/// time 0 to frames / frames_per_second. Throws Error(kUsage) if config is out of range, Error(kIo) if writing fails.
SceneTotals generate_meadow(const MeadowConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
