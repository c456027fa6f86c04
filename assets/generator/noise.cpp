#include "assets/generator/noise.h"

#include <cmath>

#include "assets/generator/random.h"

namespace packtrace::scenegen {
namespace {

double lattice_value(int64_t x, int64_t y, int64_t z, uint64_t seed) {
  const uint64_t key = static_cast<uint64_t>(x) * 0x8da6b343u + static_cast<uint64_t>(y) * 0xd8163841u +
                       static_cast<uint64_t>(z) * 0xcb1ab31fu;
  return static_cast<double>(hash_bits(key ^ seed) >> 11) * 0x1p-52 - 1.0;
}

double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

} // namespace

double value_noise(DVec3 point, uint64_t seed) {
  const DVec3 cell = glm::floor(point);
  const DVec3 f = point - cell;
  const auto x = static_cast<int64_t>(cell.x), y = static_cast<int64_t>(cell.y), z = static_cast<int64_t>(cell.z);
  const double u = fade(f.x), v = fade(f.y), w = fade(f.z);
  double layer[2];
  for (int64_t k = 0; k < 2; ++k) {
    const double a = glm::mix(lattice_value(x, y, z + k, seed), lattice_value(x + 1, y, z + k, seed), u);
    const double b = glm::mix(lattice_value(x, y + 1, z + k, seed), lattice_value(x + 1, y + 1, z + k, seed), u);
    layer[k] = glm::mix(a, b, v);
  }
  return glm::mix(layer[0], layer[1], w);
}

double fractal_noise(DVec3 point, uint64_t seed, uint32_t octaves) {
  double sum = 0.0, amplitude = 1.0, total = 0.0;
  for (uint32_t i = 0; i < octaves; ++i, amplitude *= 0.5, point *= 2.0) {
    sum += amplitude * value_noise(point + DVec3(17.3 * i), hash_bits(seed + i));
    total += amplitude;
  }
  return total > 0.0 ? sum / total : 0.0;
}

double tiling_noise(glm::dvec2 point, int64_t period, uint64_t seed) {
  const glm::dvec2 cell = glm::floor(point), f = point - cell;
  const auto wrap = [period](double i) { return (static_cast<int64_t>(i) % period + period) % period; };
  const int64_t x0 = wrap(cell.x), x1 = wrap(cell.x + 1.0), y0 = wrap(cell.y), y1 = wrap(cell.y + 1.0);
  const double u = fade(f.x);
  const double low = glm::mix(lattice_value(x0, y0, 0, seed), lattice_value(x1, y0, 0, seed), u);
  const double high = glm::mix(lattice_value(x0, y1, 0, seed), lattice_value(x1, y1, 0, seed), u);
  return glm::mix(low, high, fade(f.y));
}

} // namespace packtrace::scenegen
