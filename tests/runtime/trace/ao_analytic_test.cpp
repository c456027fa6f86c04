#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

using test::add_shape;
using test::ao_at;
using test::box;
using test::quad;
using test::sphere;

constexpr float kHuge = 1e5f;

AoConfig visibility(float radius, uint32_t spp = 256) {
  AoConfig config;
  config.radius = radius;
  config.spp = spp;
  config.falloff = false;
  return config;
}

Mesh horizontal(float y, float half = kHuge) { return quad({-half, y, -half}, {0, 0, 2 * half}, {2 * half, 0, 0}); }

TEST(AoAnalytic, OpenPlaneIsOne) {
  Scene scene;
  add_shape(scene, horizontal(0));
  EXPECT_EQ(ao_at(scene, {3, 0, 5}, {0, 1, 0}, visibility(100)), 1.0);
}

TEST(AoAnalytic, BentNormalsOnAnOpenPlaneAreStillOne) {
  Scene scene;
  add_shape(scene, horizontal(0));
  const test::Rendered flat = test::render(scene, test::camera_at({0, 5, -5}, {0, 0, 0}), {32, 32}, visibility(50, 16));
  scene.meshes[0].normals.assign(4, glm::normalize(Vec3(2, 1, 0)));
  const test::Rendered bent = test::render(scene, test::camera_at({0, 5, -5}, {0, 0, 0}), {32, 32}, visibility(50, 16));
  EXPECT_GT(std::abs(bent.gbuffer.normal[5].x), 0.5f);
  for (size_t i = 0; i < bent.ao.ao.size(); ++i) {
    EXPECT_EQ(flat.ao.ao[i], 1.0f);
    EXPECT_EQ(bent.ao.ao[i], 1.0f);
  }
}

TEST(AoAnalytic, CornerOfInfiniteWallIsOneHalf) {
  Scene scene;
  add_shape(scene, horizontal(0));
  add_shape(scene, quad({1, 0, -kHuge}, {0, 0, 2 * kHuge}, {0, kHuge, 0}));
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility(1e9f)), 0.5, 1e-3);
}

TEST(AoAnalytic, LongWallOfFiniteHeightMatchesItsFormFactor) {
  // Form factor of an element at distance a from an infinite perpendicular strip of height h:
  // F = (1 - a / sqrt(a^2 + h^2)) / 2.
  for (const auto& [a, h] : {std::pair{1.0f, 1.0f}, {3.0f, 1.0f}, {1.0f, 4.0f}}) {
    Scene scene;
    add_shape(scene, horizontal(0));
    add_shape(scene, quad({a, 0, -kHuge}, {0, 0, 2 * kHuge}, {0, h, 0}));
    const double form_factor = 0.5 * (1.0 - a / std::sqrt(double(a * a + h * h)));
    EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility(1e9f)), 1.0 - form_factor, 1e-3);
  }
}

TEST(AoAnalytic, ParallelPlatesWithinARadius) {
  // cos^2 of cosine-weighted directions is uniformly distributed, and the ceiling is within R where cos > H / R.
  Scene scene;
  add_shape(scene, horizontal(0));
  add_shape(scene, horizontal(2));
  for (const float radius : {2.5f, 4.0f, 20.0f}) {
    const double open = std::pow(2.0 / radius, 2);
    EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility(radius)), open, 1e-3);
  }
  EXPECT_EQ(ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility(1.999f)), 1.0);
}

/// Mean of f(distance) over cosine-weighted directions to a plane at the given height, by the midpoint rule over the
/// uniform cos^2.
template <typename F>
double plate_mean(double height, const F& f) {
  constexpr int kSteps = 200000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) sum += f(height / std::sqrt((i + 0.5) / kSteps));
  return sum / kSteps;
}

TEST(AoAnalytic, ParallelPlatesWithFalloff) {
  Scene scene;
  add_shape(scene, horizontal(0));
  add_shape(scene, horizontal(2));
  AoConfig config = visibility(8);
  config.falloff = true;
  config.min_visibility = 0.1f;
  const double end = 8 * std::sqrt(std::log(0.4) / -2.0);
  const auto occlusion = [&](double t) { return t < end ? std::exp(-2.0 * t * t / 64.0) : 0.0; };
  config.continuous = false;
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, config),
              plate_mean(2, [&](double t) { return 1 - 0.9 * occlusion(t); }), 1e-3);
  config.continuous = true;
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, config),
              plate_mean(2, [&](double t) { return t < end ? 1 - 0.9 * (occlusion(t) - 0.4) / 0.6 : 1.0; }), 1e-3);
}

TEST(AoAnalytic, ContinuousFalloffHasNoStepAtItsEnd) {
  Scene scene;
  // Small, and within the radius for a narrow cone of directions only.
  add_shape(scene, quad({-1, 0.999f, -1}, {0, 0, 2}, {2, 0, 0}));
  AoConfig config = visibility(1);
  config.falloff = true;
  config.lambda = 0.5f; // The falloff reaches the radius.
  const double continuous = ao_at(scene, {0, 0, 0}, {0, 1, 0}, config);
  config.continuous = false;
  EXPECT_LT(ao_at(scene, {0, 0, 0}, {0, 1, 0}, config), 1.0);
  EXPECT_GT(continuous, 0.9999);
}

TEST(AoAnalytic, ACutoffOfOneLeavesNoOcclusion) {
  Scene scene;
  add_shape(scene, horizontal(0));
  add_shape(scene, horizontal(2));
  AoConfig config = visibility(8);
  config.falloff = true, config.cutoff = 1;
  EXPECT_EQ(ao_at(scene, {0, 0, 0}, {0, 1, 0}, config), 1.0);
}

TEST(AoAnalytic, LambdaZeroIsTheLimitOfSmallLambda) {
  Scene scene;
  add_shape(scene, horizontal(0));
  add_shape(scene, horizontal(2));
  AoConfig config = visibility(8);
  config.falloff = true;
  config.lambda = 0;
  const double limit = ao_at(scene, {0, 0, 0}, {0, 1, 0}, config);
  EXPECT_NEAR(limit, plate_mean(2, [](double t) { return t < 8 ? t * t / 64 : 1.0; }), 1e-3);
  config.lambda = 1e-3f;
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, config), limit, 1e-3);
}

TEST(AoAnalytic, ClosedBoxIsZero) {
  Scene scene;
  add_shape(scene, box({-1, -1, -1}, {2, 3, 4}));
  EXPECT_EQ(ao_at(scene, {0.3f, -1, 0.7f}, {0, 1, 0}, visibility(100)), 0.0);
}

TEST(AoAnalytic, SphereAbovePlaneMatchesItsFormFactor) {
  // Form factor of a sphere entirely above the horizon: F = cos(theta) (r / d)^2.
  for (const float x : {0.0f, 2.0f, 5.0f}) {
    Scene scene;
    add_shape(scene, sphere({x, 3, 0}, 2, 100));
    const double d2 = x * x + 9.0;
    const double form_factor = 3.0 / std::sqrt(d2) * 4.0 / d2;
    EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility(100, 1024)), 1.0 - form_factor, 1e-3);
  }
}

TEST(AoAnalytic, HitDistanceIsTheMeanWithMissesAtTheRadius) {
  Scene scene;
  add_shape(scene, horizontal(2));
  AoConfig config = visibility(8);
  config.falloff = true;
  config.lambda = 0.5f; // The falloff reaches the radius.
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  Progress progress;
  AoFrame frame;
  trace_ao(source, embree, test::point_gbuffer({0, 0, 0}, {0, 1, 0}, 0), config, 0, frame, progress);
  double mean = 0.0;
  for (const float distance : frame.hit_distance) mean += distance / 64.0;
  EXPECT_NEAR(mean, plate_mean(2, [](double t) { return std::min(t, 8.0); }), 2e-3);
}

TEST(AoAnalytic, InterreflectionBrightensByTheSurfaceLuminance) {
  Scene scene;
  add_shape(scene, horizontal(0));
  add_shape(scene, horizontal(2));
  scene.materials[1].albedo = Vec3(0.5f);
  AoConfig config = visibility(1e9f);
  config.min_visibility = 0.2f;
  config.interreflection = 0.5f;
  // Every direction hits, so the visibility is k = 0.2: k / (1 - 0.5 * 0.5 * 0.8).
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, config), 0.2 / 0.8, 1e-3);
  scene.materials[1].albedo = Vec3(0.0f);
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, config), 0.2, 1e-3);
}

TEST(AoConfig, RadiusIsAFractionOfTheDiagonalUnlessItIsGiven) {
  const Bounds bounds{DVec3(0.0), DVec3(2.0, 3.0, 6.0)};
  AoConfig config;
  EXPECT_FLOAT_EQ(ao_radius(config, bounds), 0.7f);
  config.relative_radius = 0.5f;
  EXPECT_FLOAT_EQ(ao_radius(config, bounds), 3.5f);
  config.radius = 2.0f;
  EXPECT_EQ(ao_radius(config, bounds), 2.0f);
  EXPECT_EQ(ao_radius({}, Bounds{}), 1.0f);
}

TEST(AoConfig, SettingsAreAssignedByName) {
  AoConfig config;
  for (const char* text : {"lambda=3", "continuous=off", "sampler_block=4", "offset_scale=2.5"})
    assign_setting(ao_settings(), text, config, "ambient occlusion");
  EXPECT_EQ(config.lambda, 3.0f);
  EXPECT_FALSE(config.continuous);
  EXPECT_EQ(config.sampler_block, 4u);
  EXPECT_EQ(config.offset_scale, 2.5f);
  try {
    assign_setting(ao_settings(), "lambda=30", config, "ambient occlusion");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "ambient occlusion: lambda is 30, not in [0..20]");
  }
}

TEST(AoConfig, EverySettingIsDocumented) {
  std::ifstream in(std::filesystem::path(PACKTRACE_SOURCE_DIR) / "docs/ambient_occlusion.md");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  for (const Setting<AoConfig>& setting : ao_settings()) {
    const std::string row = "| `" + std::string(setting.info.name) + "` | " + setting_range(setting.info) + " | " +
                            setting_text(setting.default_value()) + " |";
    EXPECT_NE(text.find(row), std::string::npos) << row;
  }
}

TEST(AoConfig, RejectsEveryParameterOutOfRange) {
  EXPECT_NO_THROW(validate(AoConfig{}));
  const auto rejects = [](auto change) {
    AoConfig config;
    change(config);
    EXPECT_THROW(validate(config), Error);
  };
  rejects([](AoConfig& c) { c.radius = -1; });
  rejects([](AoConfig& c) { c.radius = INFINITY; });
  rejects([](AoConfig& c) { c.radius = NAN; });
  rejects([](AoConfig& c) { c.spp = 0; });
  rejects([](AoConfig& c) { c.spp = 65537; });
  rejects([](AoConfig& c) { c.lambda = -1; });
  rejects([](AoConfig& c) { c.lambda = 21; });
  rejects([](AoConfig& c) { c.cutoff = 1.5f; });
  rejects([](AoConfig& c) { c.cutoff = NAN; });
  rejects([](AoConfig& c) { c.min_visibility = 1.5f; });
  rejects([](AoConfig& c) { c.interreflection = -0.1f; });
  rejects([](AoConfig& c) { c.relative_radius = 0; });
  rejects([](AoConfig& c) { c.offset_scale = -1; });
  rejects([](AoConfig& c) { c.sampler_block = 9; });
}

} // namespace
} // namespace packtrace
