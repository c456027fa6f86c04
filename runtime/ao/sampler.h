#pragma once

#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace {

enum class SamplerKind : uint8_t {
  kSpaceTimeNet, ///< stratified over neighbouring pixels and over time at once; the default
  kPixelSobol,   ///< Owen-scrambled Sobol over time, every pixel on its own
  kIndependent,  ///< hashed random numbers
};

/// Why kSpaceTimeNet is the default: RMSE of AO on a synthetic scene (64 x 64 pixels, a sphere and a wall, 12 seeds),
/// of one pixel or after a 7 x 7 box filter:
///
///                  1 sample, box   4 frames, box   16 frames, box   32 frames, box   32 frames, pixel
///   kSpaceTimeNet      .0341           .0145           .0059            .0039            .0314
///   kPixelSobol        .0565           .0212           .0076            .0046            .0313
///   kIndependent       .0563           .0268           .0137            .0095            .0649
///
/// Points in the unit square for every pixel and sample number, without state: sample n of a pixel is the same
/// however samples are split into frames, so 32 frames of 1 sample are one frame of 32.
class PixelSampler {
public:
  PixelSampler(SamplerKind kind, uint64_t seed);

  /// What a pixel contributes; compute once per pixel.
  struct Pixel {
    uint32_t x = 0, y = 0;           ///< digits, least significant bit first
    uint32_t seed_x = 0, seed_y = 0; ///< of the scrambles
  };
  Pixel pixel(uint32_t x_px, uint32_t y_px) const;

  /// What a sample number contributes; compute once per sample.
  struct Number {
    uint32_t x = 0, y = 0; ///< digits, least significant bit first
    uint32_t seed = 0;     ///< changes every 65,536 samples
  };
  Number number(uint64_t sample) const;

  /// @return both coordinates in [0, 1)
  static Vec2 point(const Pixel& pixel, const Number& number);

private:
  SamplerKind kind_;
  uint32_t seed_;
};

/// The unit vector about +z that a point of the unit square maps to; uniform points give a cosine-weighted hemisphere.
/// Source: Shirley, Chiu, "A low distortion map between disk and square" (1997), and Malley's projection.
Vec3 cosine_direction(Vec2 point);

} // namespace packtrace
