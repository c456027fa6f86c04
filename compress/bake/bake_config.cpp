#include "compress/bake/bake_config.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "compress/format/deformation/deformation_format.h"
#include "pbrt_import/base/error.h"

namespace packtrace {

namespace {

constexpr double kMaxFlatDegrees = 0.1; // cap on NormalLimits::flat_degrees if an encoding or error is requested

void require(bool ok, const char* what, const char* range) {
  if (!ok) throw Error(ErrorKind::kUsage, std::string(what) + " out of range: " + range);
}

void validate_precision(PrecisionKind kind, double precision) {
  constexpr const char* kWhat = "precision";
  switch (kind) {
  case PrecisionKind::kEdgeFraction:
  case PrecisionKind::kPicture:
    return require(precision >= 1e-9 && precision <= 1.0, kWhat, "a fraction of the median edge must be 1e-9 .. 1");
  case PrecisionKind::kDiagonalFraction:
    return require(precision >= 1e-12 && precision <= 0.1, kWhat, "a fraction of the diagonal must be 1e-12 .. 0.1");
  case PrecisionKind::kAbsolute:
    return require(precision >= std::numeric_limits<float>::denorm_min() &&
                       precision <= std::numeric_limits<float>::max(),
                   kWhat, "an absolute precision must be a positive float");
  case PrecisionKind::kPositionBits:
    return require(precision >= 1.0 && precision <= 40.0 && precision == std::floor(precision), kWhat,
                   "position bits must be a whole number 1 .. 40");
  }
  throw Error(ErrorKind::kUsage, "unknown kind of precision");
}

} // namespace

void BakeConfig::validate() const {
  validate_precision(precision_kind, precision);
  require(purpose < baked::kPurposeCount, "purpose", "ao or shading");
  if (normal_error_degrees)
    require(*normal_error_degrees >= 0.0025 && *normal_error_degrees <= 10.0, "normal error",
            "degrees must be 0.0025 .. 10");
  if (textures && purpose != baked::kShading)
    throw Error(ErrorKind::kUsage, "textures are for shading; for ambient occlusion nothing looks at them");
  require(min_texture_psnr_db >= 10.0 && min_texture_psnr_db <= 100.0, "texture PSNR", "dB must be 10 .. 100");
  require(lod_levels >= 1 && lod_levels < baked::kMaxLodLevels, "levels of detail", "1 .. 31");
  require(sequence_group >= 1 && sequence_group <= baked::kMaxGroupFrames, "frames per group", "1 .. 64");
  for (const MeshSequence& sequence : sequences)
    require(sequence.frames_per_second > 0.0 && std::isfinite(sequence.frames_per_second), "frames per second",
            "a positive number");
  for (const LevelChain& chain : level_chains) {
    require(chain.objects.size() >= 2 && chain.objects.size() <= baked::kMaxChainLevels, "levels by distance",
            "2 .. 8 objects");
    require(chain.distances.size() + 1 == chain.objects.size(), "levels by distance", "one distance less than objects");
    double nearer = 0.0;
    for (const double distance : chain.distances) {
      require(distance > nearer && std::isfinite(distance), "levels by distance", "ascending positive distances");
      nearer = distance;
    }
  }
}

NormalLimits BakeConfig::normal_limits(double step_per_edge) const {
  const auto stated = [](double error) { return NormalLimits{error, std::min(kMaxFlatDegrees, error)}; };
  if (normals) return stated(format_of(*normals).max_error_degrees);
  if (normal_error_degrees) return stated(*normal_error_degrees);
  const double tilt = std::atan(step_per_edge) / std::atan(kDefaultEdgeFraction);
  const double error = kDefaultNormalError * std::max(tilt, 1.0);
  return {error, error};
}

} // namespace packtrace
