#include "assets/generator/town_terrain.h"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "assets/generator/noise.h"
#include "assets/generator/placement.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

constexpr double kFirstColumnAngle = radians(-62), kLastColumnAngle = radians(112);
constexpr double kBuiltFrom = radians(-24), kBuiltTo = radians(92);

struct Station {
  double inland = 0.0;
  uint32_t level = 0;
};

/// Rings of the ground mesh. At each retaining wall, two stations share a position: its foot and its top.
std::vector<Station> stations() {
  std::vector<Station> result{{-26, 0}, {-14, 0}, {-7, 0}, {-2.5, 0}, {-0.01, 0}};
  for (uint32_t level = 0; level < TownTerrain::kLevels; ++level) {
    const double begin = TownTerrain::level_begin(level), end = TownTerrain::level_begin(level + 1);
    for (const double t : {0.0, 0.22, 0.45, 0.72, 1.0}) result.push_back({mix(begin, end, t), level});
  }
  const double open = TownTerrain::level_begin(TownTerrain::kLevels);
  for (double out = 0.0, step = 2.5; out < 150.0; out += step, step *= 1.09) {
    result.push_back({open + out, TownTerrain::kLevels});
  }
  return result;
}

} // namespace

double TownTerrain::quay_radius(double angle) const { return 35.0 + 4.5 * value_noise({angle * 2.1, 0.3, 0.7}, seed_); }

double TownTerrain::land(double angle, double inland) const {
  const double ragged = angle + 0.05 * value_noise({angle * 9.0, inland * 0.05, 0.0}, seed_ + 1);
  const double recede = radians(8) * smooth_step(10.0, 170.0, inland); // opens the view along the coast
  return smooth_step(radians(-38), radians(-23), ragged - recede);
}

double TownTerrain::built(double angle, double inland) const {
  const double edge = radians(5) * value_noise({inland * 0.11, 2.0, 0.0}, seed_ + 2);
  const double sides = smooth_step(kBuiltFrom - radians(4), kBuiltFrom, angle + edge) *
                       (1.0 - smooth_step(kBuiltTo, kBuiltTo + radians(4), angle));
  const double open = level_begin(kLevels);
  return sides * (1.0 - smooth_step(open, open + 14.0, inland));
}

double TownTerrain::nature(double angle, double inland) const {
  const double radius = quay_radius(angle) + inland;
  const auto [s, c] = sin_cos(angle);
  const DVec3 at(radius * s, 0.0, radius * c);
  const double g = land(angle, inland);
  double height = 62.0 * smooth_step(-12.0, 190.0, inland) - 5.0 * smooth_step(0.0, 22.0, -inland);
  height += 5.5 * fractal_noise(at * 0.03, seed_ + 3, 4) * smooth_step(-4.0, 40.0, inland);
  height += 1.6 * fractal_noise(at * 0.15, seed_ + 4, 3) * smooth_step(-9.0, 6.0, inland);
  height -= 26.0 * smooth_step(165.0, 230.0, inland); // the far side of the ridge
  return mix(-7.0, height, g) + 3.0 * g * (1.0 - g) * value_noise(at * 0.09, seed_ + 5);
}

double TownTerrain::height(double angle, double inland, uint32_t level) const {
  const double natural = nature(angle, inland), weight = built(angle, inland);
  if (inland < 0.0) return mix(natural, -4.0, weight);
  return mix(natural, level_height(std::min(level, kLevels)), weight);
}

double TownTerrain::height(double angle, double inland) const {
  uint32_t level = 0;
  while (level < kLevels && inland >= level_begin(level + 1)) ++level;
  return height(angle, inland, level);
}

DVec3 TownTerrain::place(double angle, double inland, uint32_t level) const {
  const double radius = quay_radius(angle) + inland;
  const auto [s, c] = sin_cos(angle);
  return {radius * s, height(angle, inland, level), radius * c};
}

DVec3 TownTerrain::place(double angle, double inland) const {
  DVec3 result = place(angle, inland, 0);
  result.y = height(angle, inland);
  return result;
}

Model TownTerrain::make_ground() const {
  constexpr uint32_t kColumns = 132;
  const std::vector<Station> rings = stations();
  std::vector<DVec3> points;
  for (const Station& ring : rings) {
    for (uint32_t i = 0; i <= kColumns; ++i) {
      points.push_back(
          place(mix(kFirstColumnAngle, kLastColumnAngle, static_cast<double>(i) / kColumns), ring.inland, ring.level));
    }
  }
  const auto material = [&](const Station& ring, double angle, const DVec3& middle, double slope) -> std::string {
    const double patch = fractal_noise(middle * 0.06, seed_ + 6, 3);
    if (built(angle, ring.inland) > 0.55 && ring.inland >= 0.0 && ring.inland < level_begin(kLevels)) {
      return value_noise(middle * 0.7, seed_ + 7) > 0.1 ? "paving_b" : "paving_a";
    }
    if (middle.y < 0.5) return middle.y < -1.0 ? "sand" : "rock_b";
    if (slope < 0.62 + 0.12 * patch) return patch > 0 ? "rock_a" : "rock_b";
    return patch > 0.14 ? "grass_c" : patch > -0.12 ? "grass_b" : "grass_a";
  };
  Model model;
  PatchBuilder patch(model, points);
  for (size_t j = 0; j + 1 < rings.size(); ++j) {
    for (uint32_t i = 0; i < kColumns; ++i) {
      const size_t low = j * (kColumns + 1) + i, high = low + kColumns + 1;
      const DVec3 a = points[low], b = points[high], c = points[high + 1], d = points[low + 1];
      if (std::max({a.y, b.y, c.y, d.y}) < -3.0) continue; // invisible sea bed
      const DVec3 normal = glm::cross(c - a, d - b);
      const double angle = mix(kFirstColumnAngle, kLastColumnAngle, (i + 0.5) / kColumns);
      const double slope = std::abs(normal.y) / std::max(1e-9, glm::length(normal));
      patch.quad(material(rings[j], angle, (a + b + c + d) * 0.25, slope), {low, high, high + 1, low + 1});
    }
  }
  return model;
}

Model TownTerrain::make_sea() const {
  constexpr size_t kColumns = 120;
  constexpr double kFrom = radians(-180);
  std::vector<double> radii;
  for (double radius = 1.5, step = 1.5; radius < 640.0; radius += step) {
    radii.push_back(radius);
    if (radius > 60.0) step *= 1.12;
  }
  const auto point = [&](double radius, size_t column) {
    const auto [s, c] = sin_cos(kFrom + 2.0 * kPi * static_cast<double>(column) / kColumns);
    const DVec3 at(radius * s, 0.0, radius * c);
    const double ripple = 0.07 * fractal_noise(at * 0.35, seed_ + 8, 3) * (1.0 - smooth_step(80.0, 300.0, radius));
    return at + DVec3(0, ripple, 0);
  };
  std::vector<DVec3> points;
  for (const double radius : radii) {
    for (size_t i = 0; i < kColumns; ++i) points.push_back(point(radius, i));
  }
  Model model;
  PatchBuilder patch(model, points);
  for (size_t j = 0; j + 1 < radii.size(); ++j) {
    for (size_t i = 0; i < kColumns; ++i) {
      const double angle = kFrom + 2.0 * kPi * (static_cast<double>(i) + 0.5) / kColumns,
                   radius = (radii[j] + radii[j + 1]) * 0.5;
      const bool coast = angle > kFirstColumnAngle && angle < kLastColumnAngle;
      const double ground = coast ? height(angle, std::min(radius - quay_radius(angle), 200.0)) : -8.0;
      if (ground > 1.2) continue; // under the land
      const size_t low = j * kColumns + i, high = low + kColumns, next = i + 1 < kColumns ? 1 : 1 - kColumns;
      const DVec3 middle = (points[low] + points[high + next]) * 0.5;
      const double depth =
          -ground - 0.6 + 0.9 * fractal_noise(middle * 0.05, seed_ + 9, 3) + 6.0 * smooth_step(45.0, 420.0, radius);
      const double shade = std::clamp(depth / 13.0, 0.0, 0.999) * kSeaShades;
      patch.quad(depth < 0.0 ? "foam" : fmt::format("water_{}", static_cast<int>(shade)),
                 {low, high, high + next, low + next});
    }
  }
  return model;
}

Model TownTerrain::make_mountains() const {
  Model model;
  const auto range = [&](const char* material, double distance, double tallest, uint64_t salt) {
    constexpr uint32_t kColumns = 110, kRows = 7;
    const auto point = [&](uint32_t i, uint32_t j) {
      const auto [s, c] = sin_cos(radians(-95) + radians(190) * i / kColumns);
      const double t = static_cast<double>(j) / kRows, radius = distance + 70.0 * t;
      const DVec3 at(radius * s, 0.0, radius * c);
      const double skyline = tallest * (0.62 + 0.55 * fractal_noise(DVec3(s, c, 0.0) * 4.5, salt, 4));
      const double rough = 0.2 * tallest * fractal_noise(at * 0.03, salt + 1, 3) * t;
      return at + DVec3(0, -3.0 + (skyline + rough) * smooth_step(0.0, 1.0, t), 0);
    };
    std::vector<DVec3> points;
    for (uint32_t j = 0; j <= kRows; ++j) {
      for (uint32_t i = 0; i <= kColumns; ++i) points.push_back(point(i, j));
    }
    PatchBuilder patch(model, points);
    for (size_t j = 0; j < kRows; ++j) {
      for (size_t i = 0; i < kColumns; ++i) {
        const size_t low = j * (kColumns + 1) + i, high = low + kColumns + 1;
        patch.quad(material, {low, high, high + 1, low + 1});
      }
    }
  };
  range("mountain_a", 390.0, 34.0, seed_ + 10);
  range("mountain_b", 540.0, 74.0, seed_ + 11);
  return model;
}

} // namespace packtrace::scenegen
