#include "assets/generator/wind.h"

#include <algorithm>
#include <cmath>

#include "assets/generator/parameter_check.h"
#include "assets/generator/placement.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {
namespace {

/// The largest gusts are followed by shorter, weaker ones that cross their direction.
struct WaveShape {
  double frequency; ///< relative to that of the longest gusts
  double turn_rad;  ///< relative to the wind's direction
  double amplitude;
};
constexpr std::array<WaveShape, kWindWaves> kWaveShapes{
    {{1.0, 0.0, 0.40}, {1.45, 0.75, 0.20}, {1.45, -0.75, 0.16}, {2.2, 0.25, 0.14}, {3.1, -0.35, 0.10}}};

SinCos sin_cos_of_turns(double turns) { return sin_cos(2.0 * kPi * (turns - std::floor(turns))); }

void check_wind(const WindConfig& config, double tile_size) {
  check_parameter("wind strength", config.strength, 0.0, 4.0);
  check_parameter("wind direction", config.direction_rad, -2.0 * kPi, 2.0 * kPi);
  check_parameter("gustiness", config.gustiness, 0.0, 1.0);
  check_parameter("gust length", config.gust_length, tile_size / 64.0, tile_size);
  check_parameter("wind speed", config.speed, 0.001, 1000.0);
  check_parameter("flutter", config.flutter, 0.0, 1.0);
  check_parameter("flutter frequency", config.flutter_hz, 0.0, 100.0);
  check_parameter("wind period", config.period_s, 0.01, 3600.0);
}

int64_t whole_cycles(double cycles) { return std::max(1ll, std::llround(cycles)); }

} // namespace

WindField make_wind_field(const WindConfig& config, double tile_size, uint64_t seed) {
  check_wind(config, tile_size);
  WindField field{config, tile_size, {}, whole_cycles(config.flutter_hz * config.period_s)};
  Random random(seed, 900);
  for (size_t i = 0; i < kWindWaves; ++i) {
    const WaveShape& shape = kWaveShapes[i];
    const double frequency = shape.frequency * tile_size / config.gust_length; // cycles per tile
    const auto [s, c] = sin_cos(config.direction_rad + shape.turn_rad);
    WindWave& wave = field.waves[i];
    wave.cycles_x = std::llround(frequency * c), wave.cycles_z = std::llround(frequency * s);
    if (wave.cycles_x == 0 && wave.cycles_z == 0) wave.cycles_x = c < 0.0 ? -1 : 1;
    const auto x = static_cast<double>(wave.cycles_x), z = static_cast<double>(wave.cycles_z);
    wave.cycles_t = whole_cycles(config.speed * config.period_s * std::sqrt(x * x + z * z) / tile_size);
    wave.amplitude = shape.amplitude;
    wave.offset = random.uniform();
  }
  return field;
}

double wind_strength_at(const WindField& field, double x, double z, double phase) {
  const double p = phase - std::floor(phase);
  double sum = 0.0;
  for (const WindWave& wave : field.waves) {
    const double place =
        (static_cast<double>(wave.cycles_x) * x + static_cast<double>(wave.cycles_z) * z) / field.tile_size;
    sum += wave.amplitude * sin_cos_of_turns(place - static_cast<double>(wave.cycles_t) * p + wave.offset).sin;
  }
  return 1.0 + field.config.gustiness * sum;
}

WindMoment wind_moment(const WindField& field, double phase) {
  const double p = phase - std::floor(phase);
  const auto factors = [p](int64_t cycles) {
    const auto [s, c] = sin_cos_of_turns(static_cast<double>(cycles) * p);
    return Vec2(static_cast<float>(c), static_cast<float>(s));
  };
  WindMoment moment{};
  for (size_t i = 0; i < kWindWaves; ++i) moment.waves[i] = factors(field.waves[i].cycles_t);
  moment.flutter = factors(field.flutter_cycles);
  const auto [s, c] = sin_cos(field.config.direction_rad);
  moment.direction = {static_cast<float>(c), static_cast<float>(s)};
  return moment;
}

} // namespace packtrace::scenegen
