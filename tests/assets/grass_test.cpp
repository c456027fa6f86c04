#include "assets/generator/grass.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<Vec3> positions_at(const GrassField& field, const std::vector<GrassBlade>& blades, double phase) {
  std::vector<Vec3> positions(blades.size() * kBladeVertices);
  write_grass_positions(blades, wind_moment(field.wind, phase), positions);
  return positions;
}

/// Middle of the ring of a blade: 0 to 2 are pairs of vertices, 3 is the tip.
glm::dvec3 ring(std::span<const Vec3> blade, size_t i) {
  return i == 3 ? glm::dvec3(blade[6]) : 0.5 * (glm::dvec3(blade[2 * i]) + glm::dvec3(blade[2 * i + 1]));
}

double length_of(std::span<const Vec3> blade) {
  double sum = 0.0;
  for (size_t i = 0; i < 3; ++i) sum += glm::length(ring(blade, i + 1) - ring(blade, i));
  return sum;
}

GrassConfig small_grass() {
  GrassConfig config;
  config.blades_per_side = 20;
  return config;
}

TEST(Grass, TrianglesUseAllVerticesOfEachBladeAndNoOthers) {
  std::vector<Triangle> triangles(3 * kBladeTriangles);
  write_grass_triangles(triangles);
  for (uint32_t blade = 0; blade < 3; ++blade) {
    std::set<uint32_t> used;
    for (uint32_t t = 0; t < kBladeTriangles; ++t)
      for (int k = 0; k < 3; ++k) used.insert(triangles[blade * kBladeTriangles + t][k]);
    EXPECT_EQ(used.size(), kBladeVertices);
    EXPECT_EQ(*used.begin(), blade * kBladeVertices);
    EXPECT_EQ(*used.rbegin(), (blade + 1) * kBladeVertices - 1);
  }
}

TEST(Grass, BladesKeepTheirLengthsInAnyWind) {
  GrassConfig config = small_grass();
  for (const double strength : {0.0, 0.4, 4.0}) {
    config.wind.strength = strength;
    const GrassField field = make_grass_field(config);
    const auto blades = make_grass_blades(field, 0, 0, 0);
    for (int i = 0; i < 9; ++i) {
      const auto positions = positions_at(field, blades, i / 9.0);
      for (size_t b = 0; b < blades.size(); ++b) {
        const double length = blades[b].length;
        EXPECT_NEAR(length_of(std::span(positions).subspan(b * kBladeVertices, kBladeVertices)), length,
                    1e-6 * (length + config.patch_size));
      }
    }
  }
}

TEST(Grass, TrianglesKeepAreaAndStayAboveTheGroundWithinTheBounds) {
  GrassConfig config = small_grass();
  config.wind.strength = 4.0;
  config.stiffness_variation = config.height_variation = 0.9;
  config.droop = 4.0;
  const GrassField field = make_grass_field(config);
  const auto blades = make_grass_blades(field, 3, -2, 0);
  const Bounds bounds = grass_bounds(blades);
  std::vector<Triangle> triangles(blades.size() * kBladeTriangles);
  write_grass_triangles(triangles);
  for (int i = 0; i < 16; ++i) {
    const auto positions = positions_at(field, blades, i / 16.0);
    for (const Vec3& p : positions) {
      EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
      EXPECT_GE(p.y, 0.0f);
      EXPECT_TRUE(glm::all(glm::greaterThanEqual(glm::dvec3(p), bounds.lo)) &&
                  glm::all(glm::lessThanEqual(glm::dvec3(p), bounds.hi)));
    }
    for (const Triangle& t : triangles) {
      const glm::dvec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
      EXPECT_GT(glm::length(glm::cross(b - a, c - a)), 1e-9);
    }
  }
}

TEST(Grass, WindMovesTipsButNotRoots) {
  const GrassField field = make_grass_field(small_grass());
  const auto blades = make_grass_blades(field, 0, 0, 0);
  const auto a = positions_at(field, blades, 0.0), b = positions_at(field, blades, 0.37);
  double moved = 0.0;
  for (size_t v = 0; v < a.size(); ++v) {
    if (v % kBladeVertices < 2)
      EXPECT_EQ(a[v], b[v]);
    else
      moved = std::max(moved, static_cast<double>(glm::length(a[v] - b[v])));
  }
  EXPECT_GT(moved, 0.1 * field.config.height);
}

TEST(Grass, TheLoopClosesExactly) {
  for (const double period : {0.25, 1.0, 7.3}) {
    GrassConfig config = small_grass();
    config.wind.period_s = period;
    const GrassField field = make_grass_field(config);
    const auto blades = make_grass_blades(field, 0, 0, 0);
    EXPECT_EQ(positions_at(field, blades, 0.0), positions_at(field, blades, 1.0));
    EXPECT_EQ(positions_at(field, blades, 0.25), positions_at(field, blades, 3.25));
    EXPECT_NE(positions_at(field, blades, 0.0), positions_at(field, blades, 0.5));
  }
}

TEST(Grass, AStepAcrossTheLoopsEndIsNotLargerThanOthers) {
  const GrassField field = make_grass_field(small_grass());
  const auto blades = make_grass_blades(field, 0, 0, 0);
  constexpr int kFrames = 24;
  double inside = 0.0, across = 0.0;
  auto before = positions_at(field, blades, 0.0);
  for (int f = 1; f <= kFrames; ++f) {
    const auto now = positions_at(field, blades, f / static_cast<double>(kFrames));
    for (size_t v = 0; v < now.size(); ++v) {
      double& largest = f == kFrames ? across : inside;
      largest = std::max(largest, static_cast<double>(glm::length(now[v] - before[v])));
    }
    before = now;
  }
  EXPECT_GT(across, 0.0);
  EXPECT_LE(across, inside);
}

TEST(Grass, WindIsOneFieldOverAllPatches) {
  GrassConfig config = small_grass();
  config.tile_patches = 3;
  config.wind.gust_length = 4.0;
  const GrassField field = make_grass_field(config);
  const double tile = config.patch_size * config.tile_patches;
  for (int i = 0; i < 40; ++i) {
    const double z = 0.37 * i, phase = i / 40.0;
    for (const double seam : {config.patch_size, 2.0 * config.patch_size, tile, 2.0 * tile}) {
      EXPECT_NEAR(wind_strength_at(field.wind, seam - 1e-7, z, phase),
                  wind_strength_at(field.wind, seam + 1e-7, z, phase), 1e-5);
      EXPECT_NEAR(wind_strength_at(field.wind, 0.4, z, phase), wind_strength_at(field.wind, 0.4 + tile, z, phase),
                  1e-12);
      EXPECT_NEAR(wind_strength_at(field.wind, z, 0.4, phase), wind_strength_at(field.wind, z, 0.4 - tile, phase),
                  1e-12);
    }
  }
}

TEST(Grass, GustsTravelDownwindAtTheirSpeedAndLength) {
  WindConfig config;
  config.period_s = 20.0;
  constexpr double kTile = 48.0;
  for (const double direction : {-2.5, -1.0, 0.0, 0.9, 3.0}) {
    config.direction_rad = direction;
    const WindField field = make_wind_field(config, kTile, 1);
    double amplitudes = 0.0;
    for (const WindWave& wave : field.waves) {
      const glm::dvec2 per_unit(static_cast<double>(wave.cycles_x) / kTile, static_cast<double>(wave.cycles_z) / kTile);
      const double frequency = glm::length(per_unit);
      EXPECT_GT(glm::dot(per_unit, glm::dvec2(std::cos(direction), std::sin(direction))), 0.6 * frequency);
      EXPECT_NEAR(static_cast<double>(wave.cycles_t) / config.period_s / frequency, config.speed, 0.05 * config.speed);
      EXPECT_LE(1.0 / frequency, 1.05 * config.gust_length);
      amplitudes += wave.amplitude;
    }
    EXPECT_NEAR(amplitudes, 1.0, 1e-12);
    const double x = static_cast<double>(field.waves[0].cycles_x), z = static_cast<double>(field.waves[0].cycles_z);
    EXPECT_NEAR(kTile / std::sqrt(x * x + z * z), config.gust_length, 0.05 * config.gust_length);
  }
}

/// Bends of blades that differ in nothing but their places show the wind at these places, in every patch: so the wind
/// is the same on both sides of a seam.
TEST(Grass, BladesOfAllPatchesBendAsTheWindAtTheirPlacesSays) {
  GrassConfig config = small_grass();
  config.tile_patches = 2;
  config.wind.gust_length = 6.0;
  config.height_variation = config.stiffness_variation = config.droop = config.wind.flutter = 0.0;
  const GrassField field = make_grass_field(config);
  const double c = std::cos(config.wind.direction_rad), s = std::sin(config.wind.direction_rad);
  double least = 1e9, most = -1e9;
  for (const auto& [column, row] : {std::pair{0, 0}, std::pair{1, 0}, std::pair{-1, 4}, std::pair{2, -3}}) {
    const auto blades = make_grass_blades(field, column, row, 0);
    const auto positions = positions_at(field, blades, 0.3);
    for (size_t b = 0; b < blades.size(); ++b) {
      const std::span<const Vec3> blade = std::span(positions).subspan(b * kBladeVertices, kBladeVertices);
      const glm::dvec3 last = ring(blade, 3) - ring(blade, 2);
      const double strength = wind_strength_at(field.wind, blades[b].root.x + column * config.patch_size,
                                               blades[b].root.z + row * config.patch_size, 0.3);
      EXPECT_NEAR((last.x * c + last.z * s) / last.y, config.wind.strength * strength, 1e-4);
      EXPECT_NEAR((last.z * c - last.x * s) / last.y, 0.0, 1e-4);
      least = std::min(least, strength), most = std::max(most, strength);
    }
  }
  EXPECT_GT(most - least, 0.5) << "the wind varies over the patches";
}

TEST(Grass, PatchesATileApartAreEqualAndOthersAreNot) {
  GrassConfig config = small_grass();
  config.tile_patches = 2;
  const GrassField field = make_grass_field(config);
  const auto at = [&](int64_t column, int64_t row) {
    return positions_at(field, make_grass_blades(field, column, row, 0), 0.2);
  };
  EXPECT_EQ(at(0, 1), at(2, -1));
  EXPECT_EQ(at(-1, 0), at(1, 4));
  EXPECT_NE(at(0, 0), at(1, 0));
  EXPECT_NE(at(0, 0), at(0, 1));
}

TEST(Grass, CoarserLodsHaveFewerWiderBladesOfTheFinerOnesThatMoveLess) {
  const GrassField field = make_grass_field(small_grass());
  auto finer = make_grass_blades(field, 0, 0, 0);
  ASSERT_EQ(finer.size(), 400u);
  double finer_motion = 1e9;
  for (uint32_t lod = 0; lod < kGrassLods; ++lod) {
    const auto blades = make_grass_blades(field, 0, 0, lod);
    EXPECT_EQ(blades.size(), grass_blade_count(field.config, lod));
    std::map<std::pair<float, float>, const GrassBlade*> at;
    for (const GrassBlade& blade : finer) at[{blade.root.x, blade.root.z}] = &blade;
    double motion = 0.0;
    for (const GrassBlade& blade : blades) {
      const auto same = at.find({blade.root.x, blade.root.z});
      ASSERT_NE(same, at.end());
      EXPECT_EQ(same->second->length, blade.length);
      EXPECT_EQ(same->second->rest, blade.rest) << "a change of the LOD must not move a blade in a steady wind";
      EXPECT_GE(glm::length(blade.side), glm::length(same->second->side));
      motion = std::max(motion, static_cast<double>(blade.flutter));
      for (const Vec2& gust : blade.gusts) motion = std::max(motion, static_cast<double>(glm::length(gust)));
    }
    EXPECT_LE(motion, finer_motion);
    EXPECT_EQ(motion > 0.0, field.config.lod_wind[lod] > 0.0);
    finer = blades, finer_motion = motion;
  }
  EXPECT_EQ(finer.size(), 8u);
}

TEST(Grass, LodFollowsTheDistance) {
  const GrassConfig config;
  for (const auto& [distance, lod] : {std::pair{0.0, 0u}, std::pair{33.9, 0u}, std::pair{34.0, 1u}, std::pair{64.0, 2u},
                                      std::pair{119.0, 2u}, std::pair{199.0, 3u}, std::pair{200.0, 4u}})
    EXPECT_EQ(grass_lod(config, distance), lod) << distance;
}

TEST(Grass, ParametersOutOfRangeAreRejected) {
  using Change = std::function<void(GrassConfig&)>;
  const Change changes[] = {[](GrassConfig& c) { c.blades_per_side = 0; },
                            [](GrassConfig& c) { c.blades_per_side = 1001; },
                            [](GrassConfig& c) { c.patch_size = 0.0; },
                            [](GrassConfig& c) { c.patch_size = kNan; },
                            [](GrassConfig& c) { c.tile_patches = 65; },
                            [](GrassConfig& c) { c.height = 0.0; },
                            [](GrassConfig& c) { c.height_variation = 0.91; },
                            [](GrassConfig& c) { c.clump_size = 3.1; },
                            [](GrassConfig& c) { c.width = 0.6; },
                            [](GrassConfig& c) { c.droop = -0.1; },
                            [](GrassConfig& c) { c.stiffness_variation = 1.0; },
                            [](GrassConfig& c) { c.wind.strength = 4.1; },
                            [](GrassConfig& c) { c.wind.direction_rad = kNan; },
                            [](GrassConfig& c) { c.wind.gustiness = 1.1; },
                            [](GrassConfig& c) { c.wind.gust_length = 3.1; },
                            [](GrassConfig& c) { c.wind.speed = 0.0; },
                            [](GrassConfig& c) { c.wind.flutter = -1.0; },
                            [](GrassConfig& c) { c.wind.flutter_hz = 101.0; },
                            [](GrassConfig& c) { c.wind.period_s = 0.0; },
                            [](GrassConfig& c) { c.lod_distances[2] = 10.0; },
                            [](GrassConfig& c) { c.lod_blades[0] = 1.1; },
                            [](GrassConfig& c) { c.lod_blades[3] = 0.5; },
                            [](GrassConfig& c) { c.lod_wind[4] = 0.5; }};
  EXPECT_NO_THROW(make_grass_field({}));
  for (size_t i = 0; i < std::size(changes); ++i) {
    GrassConfig config;
    changes[i](config);
    try {
      make_grass_field(config);
      ADD_FAILURE() << "change " << i << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    }
  }
}

} // namespace
} // namespace packtrace::scenegen
