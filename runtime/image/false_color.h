#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/scene/math.h"
#include "runtime/image/image.h"

namespace packtrace {

// Pictures of data for people. All return three channels of display values in [0,1], with the sRGB transfer already
// applied where there is any: write them with PngTransfer::kRaw. Spans have size.pixels() entries, else the behaviour
// is undefined. `missing` is the display colour of pixels without a value.

/// Ambient occlusion as grey light, so that decoding the picture as sRGB gives the values back. Negative values
/// (kInvalidAo) are missing.
Image ao_preview(ImageSize size, std::span<const float> ao, Vec3 missing = Vec3(0));

/// Depth, near bright and far dark: logarithmic between the 1st and the 99th percentile of the positive finite depths,
/// so that a single far pixel does not darken the rest. Other depths (0) are missing.
Image depth_preview(ImageSize size, std::span<const float> depth, Vec3 missing = Vec3(0));

/// The depths between which depth_preview() tells colours apart: its percentiles. Both are 0 where there is no depth.
struct DepthRange {
  float nearest = 0.0f, farthest = 0.0f;
};
DepthRange depth_preview_range(std::span<const float> depth);

/// The colour of depth_preview() at t of the way between the logarithms of the nearest and the farthest depth.
Vec3 depth_preview_color(float t);

/// Directions as 0.5 + 0.5 n; zero vectors are missing.
Image normal_preview(ImageSize size, std::span<const Vec3> normals, Vec3 missing = Vec3(0));

/// One colour per id, the same in every picture; kNoInstance is missing.
Image id_preview(ImageSize size, std::span<const uint32_t> ids, Vec3 missing = Vec3(0));

/// One hue per level of detail (level_color()), darker where `shade` is low, and a little for every other cluster.
/// Pixels with a negative shade are missing.
Image level_preview(ImageSize size, std::span<const uint32_t> levels, std::span<const uint32_t> clusters,
                    std::span<const float> shade, Vec3 missing = Vec3(0));

/// Errors from black (0) over red and yellow to white (`white` and more). Negative and NaN count as 0.
/// @param white in (0, infinity)
Image heat_map(ImageSize size, std::span<const float> errors, float white = 1.0f);

/// Display colours of the maps above for one value in [0,1].
Vec3 depth_color(float t);
Vec3 heat_color(float t);
/// Display colour of a level of detail: grey for 0, then red, orange, yellow, green, teal, blue, violet, and pink for
/// all from 8 on.
Vec3 level_color(uint32_t level);
/// Display colour of an id: hues far apart for neighbouring ids, lightness in three steps.
Vec3 id_color(uint32_t id);

} // namespace packtrace
