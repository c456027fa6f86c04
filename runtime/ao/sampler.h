#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

enum class SamplerKind : uint8_t {
  kSpaceTimeNet, ///< stratified jointly over neighbouring pixels and over time; the default
  kPixelSobol,   ///< Owen-scrambled Sobol sequence over time, independent per pixel
  kMultiJitter,  ///< blocks of pixels share one of 83 multi-jittered sets of 64 points
  kLattice,      ///< a rank-1 lattice over the pixels, shifted by the R2 sequence over time
  kIndependent,  ///< independent random numbers from a hash
};

/// Number of multi-jittered sets and of points in each.
inline constexpr uint32_t kSetCount = 83, kSetPoints = 64;

/// Whether the samples of a pixel are stratified, so that their mean errs less than that of independent samples.
constexpr bool is_stratified(SamplerKind kind) { return kind != SamplerKind::kIndependent; }

/// Generates sample points in the unit square per pixel and sample number. The sampler has no state: sample n of a
/// pixel does not depend on how samples are split into frames, so 32 frames of 1 sample equal one frame of 32 samples.
/// docs/ambient_occlusion.md compares the kinds.
class PixelSampler {
public:
  /// @param block_side kMultiJitter: side of the block of pixels that share a set, 1..8; others ignore it
  PixelSampler(SamplerKind kind, uint64_t seed, uint32_t block_side = 8);

  /// The pixel's part of a sample point; compute it once per pixel.
  struct Pixel {
    uint32_t x = 0, y = 0;           ///< binary digits of a point, bit 0 first; kMultiJitter: number in the block, 0
    uint32_t seed_x = 0, seed_y = 0; ///< seeds of both coordinates
  };
  Pixel pixel(uint32_t x_px, uint32_t y_px) const;

  /// @param sample number in the pixel's sequence
  /// @return both coordinates in [0, 1)
  Vec2 point(const Pixel& pixel, uint32_t sample) const;

  /// Pixels as arrays, for points().
  struct Pixels {
    std::vector<uint32_t> x, y, seed_x, seed_y;
    void resize(size_t count) { x.resize(count), y.resize(count), seed_x.resize(count), seed_y.resize(count); }
  };
  /// Writes pixel(x_px[i], y_px[i]) for all i < count into the first elements of `out`, which has at least as many.
  void pixels(const uint32_t* x_px, const uint32_t* y_px, size_t count, Pixels& out) const;
  /// Writes point(pixel i, samples[i]) for all i < count.
  void points(const Pixels& pixels, const uint32_t* samples, size_t count, float* x, float* y) const;

private:
  SamplerKind kind_;
  uint32_t seed_;
  uint32_t block_side_;
};

} // namespace packtrace
