// Light of each kind against closed forms.

#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/shade/shaded_scenes.h"

namespace packtrace {
namespace {

constexpr float kAlbedo = 0.5f;

/// A Lambert floor around the origin; it returns albedo / pi of its irradiance.
Scene floor_scene() {
  Scene scene;
  test::add_shaded(scene, test::floor_quad(), {}, Vec3(kAlbedo));
  return scene;
}

double irradiance(const Scene& scene, uint32_t frames = 64, const ShadeConfig& config = {}) {
  return double{test::middle(scene, test::floor_camera(), config, frames).x} * M_PI / double{kAlbedo};
}

TEST(LightClosedForms, PointLight) {
  Scene scene = floor_scene();
  Light light;
  light.position = {3, 4, 0}, light.radiance = Vec3(10.0f);
  scene.lights.push_back(light);
  EXPECT_NEAR(irradiance(scene), 10.0 / 25.0 * 0.8, 2e-3);
}

TEST(LightClosedForms, SpotLightFallsOffInItsCone) {
  for (const double degrees : {5.0, 25.0, 35.0}) {
    Scene scene = floor_scene();
    Light light;
    light.kind = LightKind::kSpot, light.position = {0, 2, 0}, light.radiance = Vec3(10.0f);
    const double a = degrees * M_PI / 180.0; // the floor's middle lies off the axis
    light.direction = Vec3(std::sin(a), -std::cos(a), 0.0);
    light.cos_outer = std::cos(30.0f * 3.14159265f / 180.0f), light.cos_inner = std::cos(20.0f * 3.14159265f / 180.0f);
    scene.lights.push_back(light);
    const double t = (std::cos(a) - double{light.cos_outer}) / double{light.cos_inner - light.cos_outer};
    const double falloff = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t * t * t * t;
    EXPECT_NEAR(irradiance(scene), falloff * 10.0 / 4.0, 0.02) << degrees;
  }
}

TEST(LightClosedForms, DistantLight) {
  Scene scene = floor_scene();
  Light light;
  light.kind = LightKind::kDistant, light.direction = Vec3(0.6f, 0.8f, 0.0f), light.radiance = Vec3(3.0f);
  scene.lights.push_back(light);
  EXPECT_NEAR(irradiance(scene), 3.0 * 0.8, 1e-4);
}

TEST(LightClosedForms, SphericalLight) {
  Scene scene = floor_scene();
  test::add_shaded(scene, test::sphere(Vec3(0, 3, 0), 1.0f, 48), test::emitter(Vec3(5.0f)));
  const double exact = M_PI * 5.0 / 9.0; // pi L (r / d)^2
  EXPECT_NEAR(irradiance(scene, 256), exact, 0.015 * exact);
}

TEST(LightClosedForms, SquareLight) {
  // A square of side 2 at height 1 above the point: four times the formula for a rectangle over its corner.
  Scene scene = floor_scene();
  test::add_shaded(scene, test::quad(Vec3(-1, 1, -1), Vec3(2, 0, 0), Vec3(0, 0, 2)), test::emitter(Vec3(1.0f)));
  const double side = 1.0 / std::sqrt(2.0); // a / sqrt(a^2 + h^2) for a = b = h = 1
  const double corner = 0.5 * 2.0 * side * std::atan(side);
  EXPECT_NEAR(irradiance(scene, 256), 4.0 * corner, 0.02 * 4.0 * corner);
}

TEST(LightClosedForms, EnvironmentMap) {
  // Radiance 2 from the upper hemisphere (x > 0 in light space, turned to +y), 0 from below.
  Scene scene = floor_scene();
  Light light = test::sky_of(Vec3(1.0f));
  EnvironmentMap map{"half", 64, 32, std::vector<Vec3>(64 * 32, Vec3(0.0f))};
  for (uint32_t i = 0; i < 64 * 32; ++i)
    if (i / 64 < 16) map.radiance[i] = Vec3(2.0f); // theta below 90 degrees: +z
  scene.environment_maps.push_back(map);
  light.map = 0;
  light.world_from_light = glm::mat3(Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, 1, 0));
  scene.lights.push_back(light);
  EXPECT_NEAR(irradiance(scene, 256), 2.0 * M_PI, 0.05 * M_PI);
}

TEST(LightClosedForms, SmallSunInAMapIsFound) {
  Scene scene = floor_scene();
  EnvironmentMap map{"sun", 256, 128, std::vector<Vec3>(256 * 128, Vec3(0.1f))};
  map.radiance[256 * 20 + 100] = Vec3(1e5f);
  scene.environment_maps.push_back(map);
  Light light = test::sky_of(Vec3(1.0f));
  light.map = 0;
  light.world_from_light = glm::mat3(Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, 1, 0));
  scene.lights.push_back(light);
  const double theta = M_PI * 20.5 / 128.0;
  const double solid_angle = M_PI / 128.0 * 2.0 * M_PI / 256.0 * std::sin(theta);
  const double exact = 1e5 * solid_angle * std::cos(theta) + 0.1 * M_PI;
  EXPECT_NEAR(irradiance(scene, 256), exact, 0.03 * exact);
}

TEST(Environments, DensityIntegratesToOne) {
  EnvironmentMap map{"m", 32, 16, std::vector<Vec3>(32 * 16)};
  for (uint32_t i = 0; i < map.radiance.size(); ++i) map.radiance[i] = Vec3(static_cast<float>(i % 7) * 0.3f);
  const Environment environment(map);
  double sum = 0.0;
  constexpr int kRings = 400, kSteps = 800;
  for (int r = 0; r < kRings; ++r)
    for (int s = 0; s < kSteps; ++s) {
      const double z = 2.0 * (r + 0.5) / kRings - 1.0, phi = 2.0 * M_PI * (s + 0.5) / kSteps;
      const double sine = std::sqrt(1.0 - z * z);
      sum += double{environment.density(Vec3(sine * std::cos(phi), sine * std::sin(phi), z))} * 4.0 * M_PI /
             (kRings * kSteps);
    }
  EXPECT_NEAR(sum, 1.0, 0.01);
}

TEST(AreaLights, EmitToTheirOuterSideOnly) {
  const auto seen = [](bool down, ShadingBits bits, MaterialFlags flags) {
    Scene scene = floor_scene();
    SurfaceShading light = test::emitter(Vec3(1.0f));
    light.bits = bits;
    const Vec3 u = down ? Vec3(2, 0, 0) : Vec3(0, 0, 2), v = down ? Vec3(0, 0, 2) : Vec3(2, 0, 0);
    test::add_shaded(scene, test::quad(Vec3(-1, 1, -1), u, v), light, Vec3(0), flags);
    return irradiance(scene, 4);
  };
  EXPECT_GT(seen(true, 0, 0), 1.0);
  EXPECT_EQ(seen(false, 0, 0), 0.0);
  EXPECT_EQ(seen(true, kOuterSideOpposite, 0), 0.0);
  EXPECT_GT(seen(false, kOuterSideOpposite, 0), 1.0);
  EXPECT_GT(seen(false, 0, kEmitsBothSides), 1.0);
}

TEST(AreaLights, AreSeenAsTheirRadiance) {
  Scene scene;
  test::add_shaded(scene, test::floor_quad(), test::emitter(Vec3(1, 2, 3)));
  const Vec3 seen = test::middle(scene, test::floor_camera());
  EXPECT_FLOAT_EQ(seen.z, 3.0f);
  EXPECT_FLOAT_EQ(seen.x, 1.0f);
}

TEST(DefaultLight, IsAWhiteSky) {
  const Scene scene = floor_scene();
  EXPECT_TRUE(LightSet(FloatSource(scene)).uses_sky());
  EXPECT_NEAR(irradiance(scene), double{kDefaultSky} * M_PI, 0.02);
  Scene lit = floor_scene();
  lit.lights.push_back(test::sky_of(Vec3(0.5f)));
  EXPECT_FALSE(LightSet(FloatSource(lit)).uses_sky());
}

TEST(Shadows, OpaqueSurfacesBlockLight) {
  Scene scene = floor_scene();
  Light light;
  light.position = {0, 4, 0}, light.radiance = Vec3(10.0f);
  scene.lights.push_back(light);
  EXPECT_GT(irradiance(scene, 1), 0.5);
  test::add_shaded(scene, test::quad(Vec3(-1, 3, -1), Vec3(2, 0, 0), Vec3(0, 0, 2)), {});
  EXPECT_EQ(irradiance(scene, 1), 0.0);
}

TEST(Shadows, LightPassesGlassUpToTheShadowDepth) {
  const auto seen = [](int panes, uint32_t shadow_depth) {
    Scene scene = floor_scene();
    Light light;
    light.position = {0, 4, 0}, light.radiance = Vec3(10.0f);
    scene.lights.push_back(light);
    SurfaceShading glass = test::specular_surface(kFresnelDielectric);
    glass.transmission = Vec3(0.5f);
    for (int i = 0; i < panes; ++i) // above the camera
      test::add_shaded(
          scene, test::quad(Vec3(-1, 3.0f + 0.1f * static_cast<float>(i), -1), Vec3(0, 0, 2), Vec3(2, 0, 0)), glass);
    ShadeConfig config;
    config.shadow_depth = shadow_depth;
    return irradiance(scene, 1, config);
  };
  const double open = seen(0, 4);
  EXPECT_NEAR(seen(1, 4), open * 0.96 * 0.5, 1e-3);
  EXPECT_NEAR(seen(2, 4), open * 0.96 * 0.96 * 0.25, 1e-3);
  EXPECT_EQ(seen(1, 0), 0.0);
  EXPECT_EQ(seen(2, 1), 0.0);
}

} // namespace
} // namespace packtrace
