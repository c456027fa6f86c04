#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/math.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/image/exr_picture.h"
#include "runtime/layered/layer_roles.h"

namespace packtrace {

/// Conventions of a renderer's layers.
struct LayerConventions {
  /// Depths are distances along the camera's rays, not along its axis. [requires fov_degrees]
  bool ray_distance = false;
  /// Field of view of a perspective camera across the shorter image axis, as in pbrt, in degrees. (0, 180)
  std::optional<double> fov_degrees;
  /// Depths of at least this value are background, and so are 0, infinities and NaN. (0, infinity)
  float far_depth = 1e9f;
  bool inverted_ao = false;      ///< 1 means fully occluded
  bool unsigned_normals = false; ///< components are stored as 0.5 + 0.5 n
  /// Factors from stored motion to pixels (x right, y down) from where the previous picture shows the surface to where
  /// this one does. Unset: (-1, 1) for Blender's layer, else (1, 1).
  std::optional<Vec2> motion_scale;

  /// Throws Error(kUsage) naming the option that is out of range.
  void validate() const;
};

/// Numbers of pixels of a picture.
struct LayerCounts {
  uint64_t surfaces = 0;       ///< with a depth: not background
  uint64_t without_sample = 0; ///< surfaces whose AO is negative or not finite
  uint64_t not_finite_ao = 0;  ///< of these, NaN and infinities
  uint64_t clamped_ao = 0;     ///< surfaces whose AO is above 1 (by more than rounding)
  uint64_t not_finite_depth = 0;
  uint64_t without_normal = 0;    ///< surfaces whose normal is zero or not finite
  uint64_t not_finite_motion = 0; ///< surfaces without history for this reason
  bool negative_depth = false;    ///< all depths are negative, and were negated
};

/// A picture of layers, converted for the denoiser.
struct LayeredPicture {
  PictureChannels channels;
  ExrPicture file; ///< the decoded channels as stored
  GBuffer gbuffer; ///< view_z, normal, albedo, instance, motion_px and previous_z; the other arrays are empty
  AoFrame ao;
  bool has_hit_distance = false;
  LayerCounts counts;
  MemoryReservation memory; ///< for all of it
};

/// Attribute of EXR files that `render` writes: 1 if the layer "ao" is denoised, else 0.
inline constexpr const char* kDenoisedAttribute = "denoised";

/// How a picture is read.
struct LayeredReading {
  NamedLayers layers;
  LayerConventions conventions;
  bool raw_ao = false;      ///< as in find_picture_channels(); files with kDenoisedAttribute set it as well
  bool all_channels = true; ///< decode the channels without a role too, to write them back
};

/// Reads an EXR file with layers of any renderer.
/// @param budget reserves the file, its samples, the converted layers and the denoiser before they are allocated
/// Throws Error(kInput) for files that cannot be read, are damaged or lack a required layer, Error(kUnsupported) for
/// multi-part, deep and subsampled ones, and MemoryError.
LayeredPicture read_layered_picture(const std::filesystem::path& path, const LayeredReading& reading,
                                    const MemoryBudget& budget);

} // namespace packtrace
