#pragma once

#include <array>
#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace::scenegen {

/// Parameters of a wind field. Lengths are in units of the scene.
struct WindConfig {
  double strength = 0.5;      ///< bend that a mean wind causes, as in GrassConfig::droop; [0, 4]
  double direction_rad = 0.3; ///< towards which it blows, from +x towards +z; [-2 pi, 2 pi]
  double gustiness = 0.8;     ///< the strength varies by this fraction, up and down; [0, 1]
  double gust_length = 3.0;   ///< wavelength of the longest gusts; [tile / 64, tile]
  double speed = 3.0;         ///< at which gusts travel, per second; [0.001, 1000]
  double flutter = 0.12;      ///< motion of single blades, as a fraction of the strength; [0, 1]
  double flutter_hz = 2.0;    ///< frequency of that motion; [0, 100]
  double period_s = 1.0;      ///< after which everything repeats; [0.01, 3600]
};

/// A travelling wave of wind. It has whole numbers of cycles, so that it repeats over space and over time.
struct WindWave {
  int64_t cycles_x = 0, cycles_z = 0; ///< per tile
  int64_t cycles_t = 0;               ///< per period
  double amplitude = 0.0;             ///< the sum of all waves' is 1
  double offset = 0.0;                ///< cycles, [0, 1)
};

inline constexpr size_t kWindWaves = 5;

/// Wind over a square tile that repeats without seams. Its strength at (x, z) and phase p, the fraction of the period,
/// is 1 + gustiness * sum_i amplitude_i sin(2 pi (cycles_x x / tile + cycles_z z / tile - cycles_t p + offset)).
struct WindField {
  WindConfig config;
  double tile_size = 1.0;
  std::array<WindWave, kWindWaves> waves;
  int64_t flutter_cycles = 1; ///< per period
};

/// Makes the waves. Their wavelengths, directions and speeds come as close to the parameters as whole numbers of cycles
/// allow, with at least one cycle per period.
/// @param tile_size finite, positive
/// Throws Error(kUsage) if a parameter is out of range.
WindField make_wind_field(const WindConfig& config, double tile_size, uint64_t seed);

/// Strength of the wind at a world position relative to the mean, in [1 - gustiness, 1 + gustiness].
/// @param phase fraction of the period, finite
double wind_strength_at(const WindField& field, double x, double z, double phase);

/// The time factors of a wind field: cosine and sine of 2 pi cycles_t p for each wave, and for the flutter.
/// sin(a - b) = sin a cos b - cos a sin b then gives each wave at each place from two products.
struct WindMoment {
  std::array<Vec2, kWindWaves> waves;
  Vec2 flutter;
  Vec2 direction; ///< unit vector (x, z) towards which the wind blows
};

/// @param phase fraction of the period, finite; whole periods do not count
WindMoment wind_moment(const WindField& field, double phase);

} // namespace packtrace::scenegen
