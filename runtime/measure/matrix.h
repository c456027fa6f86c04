#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/measure/knobs.h"

namespace packtrace {

enum class MatrixMode : uint8_t { kQuick, kDefault, kFull };

/// One combination of options to measure.
struct MeasurePoint {
  std::string id;    ///< unique in its matrix, of letters, digits and "-_."
  std::string label; ///< for people
  std::string group; ///< what it varies (docs/measure.md)
  BakeKnobs bake;
  RenderKnobs render;
};

/// Properties of a scene that determine the points and their values.
struct MatrixScene {
  double diagonal = 1.0; ///< of the bounds, world units
  bool has_uvs = false;  ///< whether a mesh has texture coordinates
};

/// The points of a mode: the default first, then one factor at a time from the default, then a product of positions,
/// normals and codecs. A mode's points contain those of the modes below it, but with its own samples.
/// Points with the same options for bake are adjacent.
/// @param spp samples per pixel of all points that are compared without the denoiser
std::vector<MeasurePoint> make_matrix(MatrixMode mode, const MatrixScene& scene, uint32_t spp);

/// Frame counts at which the denoiser's convergence is measured.
std::vector<uint32_t> convergence_frames(MatrixMode mode);

/// Samples per pixel at which full and quarter resolution are compared; quarter resolution also gets four times as
/// many, which are as many rays.
std::vector<uint32_t> resolution_samples(MatrixMode mode);

/// Screen-space errors at which levels of detail are measured, traced pixels; 0 first.
std::vector<double> lod_errors(MatrixMode mode);

} // namespace packtrace
