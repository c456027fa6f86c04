#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/scene/math.h"
#include "runtime/image/image.h"

namespace packtrace {

// False-colour pictures of data. All functions return three channels of display values in [0,1]. The sRGB transfer is
// already applied where needed, so write them with PngTransfer::kRaw. Spans must have size.pixels() entries. `missing`
// is the display colour of pixels without a value.

/// Ambient occlusion as grey, sRGB-encoded, so that decoding the picture as sRGB returns the AO values. Negative values
/// (kInvalidAo) are missing.
Image ao_preview(ImageSize size, std::span<const float> ao, Vec3 missing = Vec3(0));

/// Depth with near pixels bright and far pixels dark. The scale is logarithmic between the 1st and the 99th percentile
/// of the positive finite depths, so that a few distant pixels do not compress the range. All other values (0) are
/// missing.
Image depth_preview(ImageSize size, std::span<const float> depth, Vec3 missing = Vec3(0));

/// The depth range that depth_preview() maps to colours: its two percentiles. Both are 0 without any valid depth.
struct DepthRange {
  float nearest = 0.0f, farthest = 0.0f;
};
DepthRange depth_preview_range(std::span<const float> depth);

/// Colour of depth_preview() at t in [0,1], interpolating the logarithm of depth from nearest (0) to farthest (1).
Vec3 depth_preview_color(float t);

/// Unit normals as 0.5 + 0.5 n; zero vectors are missing.
Image normal_preview(ImageSize size, std::span<const Vec3> normals, Vec3 missing = Vec3(0));

/// A colour per id (id_color()), the same in every picture; kNoInstance is missing.
Image id_preview(ImageSize size, std::span<const uint32_t> ids, Vec3 missing = Vec3(0));

/// A hue per LOD level (level_color()), darkened where `shade` is low, with a slightly different brightness per
/// cluster. Pixels with a negative shade are missing.
/// @param shade usually AO, linear [0,1]
Image level_preview(ImageSize size, std::span<const uint32_t> levels, std::span<const uint32_t> clusters,
                    std::span<const float> shade, Vec3 missing = Vec3(0));

/// Error magnitudes from black (0) over red and yellow to white (at or above `white`). Negative values and NaN count
/// as 0.
/// @param white error shown as white, in (0, infinity)
Image heat_map(ImageSize size, std::span<const float> errors, float white = 1.0f);

/// Magnitudes from dark (0) to bright (at or above `bright`), in the colours of scalar_color().
/// @param bright in (0, infinity)
Image scalar_preview(ImageSize size, std::span<const float> values, float bright);

/// Vectors in the image plane (x right, y down): the hue is their direction (direction_color()), and they are brightest
/// from the length `bright` on. Vectors that are not finite count as 0.
Image vector_preview(ImageSize size, std::span<const Vec2> vectors, float bright);

/// The 99th percentile of the positive finite values, as the upper end of a scale; 1 if there are none.
float scale_end(std::span<const float> values);

/// Display colour of a magnitude in [0,1], with monotone lightness.
Vec3 scalar_color(float t);
/// Display colour of a direction: turns clockwise from the right, in [0,1].
Vec3 direction_color(float turns);

/// Display colour of a value in [0,1] for depth pictures and heat maps.
Vec3 depth_color(float t);
Vec3 heat_color(float t);
/// Display colour of a LOD level: 0 grey, then red, orange, yellow, green, teal, blue, violet, and pink for levels from
/// 8 on.
Vec3 level_color(uint32_t level);
/// Display colour of an id: consecutive ids get distant hues; lightness has three steps.
Vec3 id_color(uint32_t id);

} // namespace packtrace
