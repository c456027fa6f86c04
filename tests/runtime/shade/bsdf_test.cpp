#include "runtime/shade/bsdf.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/shade/shaded_scenes.h"

namespace packtrace {
namespace {

TEST(Fresnel, DielectricHasKnownValues) {
  EXPECT_NEAR(fresnel_dielectric(1.0f, 1.5f), 0.04f, 1e-6f);
  EXPECT_NEAR(fresnel_dielectric(0.0f, 1.5f), 1.0f, 1e-6f);
  // At Brewster's angle only perpendicular light is reflected: half of ((eta^2 - 1) / (eta^2 + 1))^2.
  const float brewster = std::cos(std::atan(1.5f)), perpendicular = (1.5f * 1.5f - 1) / (1.5f * 1.5f + 1);
  EXPECT_NEAR(fresnel_dielectric(brewster, 1.5f), 0.5f * perpendicular * perpendicular, 1e-5f);
  EXPECT_EQ(fresnel_dielectric(0.5f, 1.0f / 1.5f), 1.0f) << "total reflection";
}

TEST(Fresnel, DielectricIsTheSameFromBothSides) {
  for (const float cosine : {0.2f, 0.5f, 0.9f}) {
    const float far = std::sqrt(1.0f - (1.0f - cosine * cosine) / (1.5f * 1.5f));
    EXPECT_NEAR(fresnel_dielectric(cosine, 1.5f), fresnel_dielectric(far, 1.0f / 1.5f), 1e-5f);
  }
}

TEST(Fresnel, ConductorHasKnownValues) {
  const float eta = 0.2f, k = 3.9f;
  const float known = ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
  EXPECT_NEAR(fresnel_conductor(1.0f, eta, k), known, 1e-5f);
  EXPECT_NEAR(fresnel_conductor(0.0f, eta, k), 1.0f, 1e-4f);
  for (const float cosine : {0.1f, 0.4f, 0.8f, 1.0f})
    EXPECT_NEAR(fresnel_conductor(cosine, 1.5f, 0.0f), fresnel_dielectric(cosine, 1.5f), 1e-4f);
}

TEST(Refraction, ObeysSnellsLaw) {
  const Vec3 normal(0, 0, 1);
  for (const float eta : {1.5f, 1.0f / 1.2f})
    for (const float sine : {0.0f, 0.3f, 0.7f}) {
      const Vec3 o(sine, 0.0f, std::sqrt(1.0f - sine * sine));
      const Vec3 i = refracted(o, normal, eta);
      EXPECT_NEAR(-i.x * eta, sine, 1e-5f);
      EXPECT_LT(i.z, 0.0f);
      EXPECT_NEAR(glm::length(i), 1.0f, 1e-5f);
    }
  EXPECT_EQ(refracted(Vec3(0.9f, 0.0f, std::sqrt(0.19f)), normal, 1.0f / 1.5f), Vec3(0.0f));
  EXPECT_EQ(reflected(Vec3(0.6f, 0.0f, 0.8f), normal), Vec3(-0.6f, 0.0f, 0.8f));
}

/// Calls visit(direction, weight) for directions of a hemisphere; the weights sum to 2 pi.
template <class Visit>
void for_each_direction(const Visit& visit) {
  constexpr int kRings = 400, kSteps = 200;
  for (int r = 0; r < kRings; ++r)
    for (int s = 0; s < kSteps; ++s) {
      const double z = (r + 0.5) / kRings, phi = 2.0 * M_PI * (s + 0.5) / kSteps, sine = std::sqrt(1.0 - z * z);
      visit(Vec3(sine * std::cos(phi), sine * std::sin(phi), z), 2.0 * M_PI / (kRings * kSteps));
    }
}

TEST(GgxDistribution, ProjectsToOne) {
  for (const float alpha : {0.2f, 0.4f, 1.0f}) {
    double sum = 0.0;
    for_each_direction([&](Vec3 h, double weight) { sum += weight * double{Ggx{alpha}.density(h)} * double{h.z}; });
    EXPECT_NEAR(sum, 1.0, 0.01) << alpha;
  }
}

TEST(GgxDistribution, VisibleNormalsHaveTheirDensity) {
  // The mean of 1 / density over samples is the solid angle from which light is reflected; compare the mean of a test
  // function instead, which is smooth.
  const Ggx ggx{0.3f};
  const Vec3 o(0.6f, 0.0f, 0.8f);
  double exact = 0.0, sampled = 0.0;
  for_each_direction([&](Vec3 i, double weight) {
    exact += weight * double{ggx.reflected_density(o, glm::normalize(o + i))} * double{i.x * i.x};
  });
  constexpr int kSide = 300;
  for (int n = 0; n < kSide * kSide; ++n) {
    const int column = n % kSide, row = n / kSide;
    const Vec2 u((static_cast<float>(column) + 0.5f) / kSide, (static_cast<float>(row) + 0.5f) / kSide);
    const Vec3 i = reflected(o, ggx.visible_normal(o, u));
    if (i.z > 0.0f) sampled += double{i.x * i.x} / (kSide * kSide);
  }
  EXPECT_NEAR(sampled, exact, 0.01 * exact);
}

SurfaceShading furnace_surface(int n) {
  SurfaceShading s;
  s.specular = Vec3(1.0f);
  if (n == 0) s.bits = kFresnelNone, s.roughness = 0.3f, s.diffuse = 0.0f;
  if (n == 1) s.bits = kFresnelDielectric, s.roughness = 0.2f;
  if (n == 2)
    s.bits = kFresnelConductor, s.metal_eta = Vec3(0.2f), s.metal_k = Vec3(3.9f), s.roughness = 0.5f, s.diffuse = 0.0f;
  if (n == 3) s.bits = kFresnelSchlick, s.specular = Vec3(0.5f), s.roughness = 0.15f;
  if (n == 4) s.bits = kFresnelDielectric, s.roughness = 1.0f, s.sigma = 30.0f;
  return s;
}

/// Light that a surface with an albedo of 1 returns of a white sky, by integration of its BRDF.
double returned(const SurfaceShading& s, float cosine) {
  const ShadedSurface surface(s, Vec3(1.0f));
  const DirectionalAlbedo albedo(s);
  const Vec3 o(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine), kept = Vec3(1.0f) - albedo.at(cosine);
  double sum = 0.0;
  for_each_direction([&](Vec3 i, double weight) {
    sum += weight * double{(surface.evaluate_diffuse(o, i, kept) + surface.evaluate_specular(o, i, s.eta)).x};
  });
  return sum;
}

TEST(Furnace, SurfacesReturnNoMoreThanTheyGet) {
  for (int n = 0; n < 5; ++n)
    for (const float cosine : {0.1f, 0.3f, 0.6f, 1.0f}) EXPECT_LE(returned(furnace_surface(n), cosine), 1.005) << n;
}

TEST(Furnace, TableIsTheIntegralOfTheSpecularPart) {
  for (int n = 0; n < 5; ++n) {
    SurfaceShading s = furnace_surface(n);
    s.diffuse = 0.0f;
    for (const float cosine : {0.3f, 0.6f, 0.9f})
      EXPECT_NEAR(double{DirectionalAlbedo(s).at(cosine).x}, returned(s, cosine), 0.01) << n << " at " << cosine;
  }
}

TEST(Furnace, WhiteSkyIsReturnedAsTheTableSays) {
  for (int n = 0; n < 5; ++n)
    for (const double degrees : {20.0, 60.0}) {
      Scene scene;
      SurfaceShading s = furnace_surface(n);
      s.sigma = 0.0f;
      test::add_shaded(scene, test::floor_quad(), s, Vec3(1.0f));
      scene.lights.push_back(test::sky_of(Vec3(1.0f)));
      ShadeConfig config;
      config.ambient = 0.0f;
      const double seen = test::middle(scene, test::floor_camera(degrees), config, 64).x;
      const double specular = DirectionalAlbedo(s).at(static_cast<float>(std::cos(degrees * M_PI / 180.0))).x;
      EXPECT_NEAR(seen, s.diffuse > 0.0f ? 1.0 : specular, 0.02) << n << " at " << degrees;
    }
}

TEST(Furnace, GlassBallIsInvisibleInAWhiteSky) {
  Scene scene;
  SurfaceShading glass = test::specular_surface(kFresnelDielectric);
  glass.transmission = Vec3(1.0f);
  test::add_shaded(scene, test::sphere(Vec3(0), 1.0f, 24), glass);
  scene.lights.push_back(test::sky_of(Vec3(1.0f)));
  ShadeConfig config;
  config.ambient = 1.0f; // what lies beyond the depth
  test::ShadeBench bench(scene);
  const ShadedFrame frame = bench.shade(test::camera_at(DVec3(0, 0, -4), DVec3(0)), {16, 16}, config, 4);
  for (size_t p = 0; p < frame.direct.size(); ++p) EXPECT_NEAR((frame.direct[p] + frame.specular[p]).y, 1.0f, 2e-3f);
}

} // namespace
} // namespace packtrace
