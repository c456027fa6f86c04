// Reflections and transmissions against analytic directions, and pictures against brute force.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "runtime/ao/hash.h"
#include "tests/runtime/shade/shaded_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

ShadeConfig no_ambient() {
  ShadeConfig config;
  config.ambient = 0.0f;
  return config;
}

/// A floor of a specular surface, and an emitting wall at x = 4 with stripes of height 0.5 whose radiance is their
/// number, seen from the other side.
Scene striped_scene(const SurfaceShading& floor) {
  Scene scene;
  test::add_shaded(scene, test::floor_quad(3.0f), floor, Vec3(1.0f));
  for (int i = 0; i < 16; ++i)
    test::add_shaded(scene, test::quad(Vec3(4, 0.5f * static_cast<float>(i), -8), Vec3(0, 0, 16), Vec3(0, 0.5f, 0)),
                     test::emitter(Vec3(static_cast<float>(i + 1))), Vec3(0), kEmitsBothSides);
  return scene;
}

Camera from_left(double height) { return test::camera_at(DVec3(-2, height, 0), DVec3(0, 0, 0), 0.05); }

TEST(Mirrors, ShowWhatLiesInTheMirroredDirection) {
  const Scene scene = striped_scene(test::specular_surface(kFresnelNone));
  for (const double height : {0.4, 1.1, 2.4}) {
    const double y = 4.0 * height / 2.0; // the ray comes back with the same slope
    EXPECT_NEAR(test::middle(scene, from_left(height), no_ambient(), 1).x, std::floor(y / 0.5) + 1.0, 1e-4) << height;
  }
}

TEST(Mirrors, AreColouredByTheirAlbedoOrFresnel) {
  SurfaceShading tinted = test::specular_surface(kFresnelNone | kSpecularTimesAlbedo);
  Scene scene = striped_scene(tinted);
  scene.materials[0].albedo = Vec3(0.5f, 0.25f, 0.0f);
  const Vec3 seen = test::middle(scene, from_left(1.1), no_ambient(), 1);
  EXPECT_NEAR(seen.y, 0.5f * seen.x, 1e-4f);
  EXPECT_EQ(seen.z, 0.0f);
  const Scene coated = striped_scene(test::specular_surface(kFresnelDielectric));
  const double cosine = 1.1 / std::sqrt(1.1 * 1.1 + 4.0);
  const double stripe = std::floor(2.2 / 0.5) + 1.0;
  EXPECT_NEAR(test::middle(coated, from_left(1.1), no_ambient(), 1).x,
              stripe * double{fresnel_dielectric(static_cast<float>(cosine), 1.5f)}, 1e-3);
}

TEST(Mirrors, FaceEachOtherUpToTheDepth) {
  // Two mirrors that face each other at x = -1 and 1, with reflectance 1/2; nothing else. The ambient light ends paths.
  Scene scene;
  SurfaceShading half = test::specular_surface(kFresnelNone);
  half.specular = Vec3(0.5f);
  test::add_shaded(scene, test::quad(Vec3(1, -50, -50), Vec3(0, 100, 0), Vec3(0, 0, 100)), half);
  test::add_shaded(scene, test::quad(Vec3(-1, -50, -50), Vec3(0, 0, 100), Vec3(0, 100, 0)), half);
  Light unused;
  unused.position = DVec3(0, 1e6, 0);
  scene.lights.push_back(unused); // no white sky
  ShadeConfig config;
  config.ambient = 1.0f;
  for (const uint32_t depth : {0u, 1u, 3u}) {
    config.depth = depth;
    EXPECT_NEAR(test::middle(scene, test::camera_at(DVec3(0), DVec3(1, 0.01, 0), 0.1), config, 1).x,
                std::pow(0.5, depth + 1.0), 1e-5)
        << depth;
  }
}

TEST(Glass, SlabShiftsWhatLiesBehindIt) {
  // A slab of thickness d shifts a ray sideways by d sin(a) (1 - cos(a) / sqrt(n^2 - sin^2(a))).
  SurfaceShading glass = test::specular_surface(kFresnelDielectric);
  glass.specular = Vec3(0.0f), glass.transmission = Vec3(1.0f);
  Scene scene;
  test::add_shaded(scene, test::box(Vec3(-5, -1, -5), Vec3(5, 0, 5)), glass);
  // Stripes of 0.05 along x below the slab.
  for (int i = 0; i < 80; ++i)
    test::add_shaded(scene, test::quad(Vec3(0.05f * static_cast<float>(i), -2, -5), Vec3(0.05f, 0, 0), Vec3(0, 0, 10)),
                     test::emitter(Vec3(static_cast<float>(i + 1))), Vec3(0), kEmitsBothSides);
  for (const double degrees : {20.0, 50.0}) {
    const double a = degrees * M_PI / 180.0, n = 1.5;
    const Camera camera = test::camera_at(DVec3(-std::tan(a), 1, 0), DVec3(0, 0, 0), 0.01);
    const double inside = std::asin(std::sin(a) / n);
    const double x = std::tan(inside) + std::tan(a); // 1 in glass, 1 in air
    const double f = double{fresnel_dielectric(static_cast<float>(std::cos(a)), 1.5f)};
    EXPECT_NEAR(test::middle(scene, camera, no_ambient(), 1).x, (std::floor(x / 0.05) + 1.0) * (1 - f) * (1 - f), 0.02)
        << degrees;
  }
}

TEST(Glass, ThinSurfacesDoNotRefract) {
  SurfaceShading thin = test::specular_surface(kFresnelDielectric | kThin);
  thin.specular = Vec3(0.0f), thin.transmission = Vec3(0.75f);
  Scene scene;
  test::add_shaded(scene, test::floor_quad(), thin);
  scene.lights.push_back(test::sky_of(Vec3(2.0f)));
  EXPECT_NEAR(test::middle(scene, test::floor_camera(), no_ambient(), 1).x, 1.5f, 1e-4f);
}

TEST(Ambient, IsOccludedBehindMirrors) {
  // The mirror shows a floor below a low roof: a cosine-weighted ray meets it always.
  const auto seen = [](bool roof) {
    Scene scene;
    test::add_shaded(scene, test::quad(Vec3(0, 0, 5), Vec3(0, 9, 0), Vec3(9, 0, 0)),
                     test::specular_surface(kFresnelNone));
    test::add_shaded(scene, test::floor_quad(), {}, Vec3(0.5f));
    Light unused;
    unused.position = DVec3(0, 1e6, 0), unused.radiance = Vec3(1e-20f);
    scene.lights.push_back(unused);
    if (roof) test::add_shaded(scene, test::quad(Vec3(-9, 0.2f, -9), Vec3(18, 0, 0), Vec3(0, 0, 13.9f)), {}, Vec3(0));
    ShadeConfig config;
    config.ambient = 1.0f;
    return test::middle(scene, test::camera_at(DVec3(2, 0.1, 4.9), DVec3(2, 0.099, 5), 0.05), config, 16).x;
  };
  EXPECT_NEAR(seen(false), 0.5f, 1e-4f);
  EXPECT_LT(seen(true), 0.05f);
}

/// Estimates the light that arrives along a ray with uniformly distributed directions and nothing else in common with
/// the path tracer than the tracer of rays, the surfaces' records and the BRDF.
class BruteForce {
public:
  BruteForce(const Scene& scene, const test::ShadeBench& bench) : scene_(scene), bench_(bench) {}

  /// Reflected light at a hit; light of the lights is met by chance.
  DVec3 reflected_light(const HitPoint& point, Vec3 to_viewer, uint32_t depth, uint32_t samples) {
    const Material& material = scene_.materials[point.material];
    const ShadedSurface surface(material.shading, point.albedo);
    const Vec3 n = point.normal;
    const Vec3 t = glm::normalize(std::abs(n.x) > 0.5f ? glm::cross(n, Vec3(0, 1, 0)) : glm::cross(n, Vec3(1, 0, 0)));
    const Vec3 b = glm::cross(n, t);
    const auto local = [&](Vec3 v) { return Vec3(glm::dot(v, t), glm::dot(v, b), glm::dot(v, n)); };
    const Vec3 o = local(to_viewer);
    const Vec3 kept = Vec3(1.0f) - bench_.shade_scene.albedo(point.material).at(o.z);
    const HitSurfaces surfaces(bench_.source, bench_.tracer, bench_.shade_scene.textures());
    std::vector<Ray> rays;
    std::vector<Vec3> diffuse, specular;
    for (uint32_t s = 0; s < samples; ++s) {
      const float z = next(), phi = 2.0f * kShadePi * next(), sine = std::sqrt(1.0f - z * z);
      const Vec3 i(sine * std::cos(phi), sine * std::sin(phi), z);
      rays.push_back(surfaces.leaving(point, i.x * t + i.y * b + i.z * n, INFINITY));
      diffuse.push_back(surface.evaluate_diffuse(o, i, kept) * 2.0f * kShadePi);
      specular.push_back(surface.evaluate_specular(o, i, material.shading.eta) * 2.0f * kShadePi);
    }
    std::vector<RayHit> hits(rays.size());
    bench_.tracer.closest_hits(rays, kCameraRays, RayOrder::kIncoherent, hits);
    DVec3 sum(0.0);
    for (uint32_t s = 0; s < samples; ++s) {
      Vec3 emitted = bench_.shade_scene.lights().background(rays[s].direction);
      DVec3 further(0.0);
      if (hits[s].valid()) {
        std::vector<HitPoint> found;
        surfaces.look_up({&rays[s], 1}, {&hits[s], 1}, {}, found);
        emitted = found[0].outer ? scene_.materials[found[0].material].shading.emission : Vec3(0.0f);
        if (depth > 0 && specular[s] != Vec3(0.0f))
          further = reflected_light(found[0], -rays[s].direction, depth - 1, 1);
      }
      sum += DVec3(diffuse[s] + specular[s]) * DVec3(emitted) + DVec3(specular[s]) * further;
    }
    return sum / double(samples);
  }

private:
  float next() { return unit_float(hash32(state_++)); }

  const Scene& scene_;
  const test::ShadeBench& bench_;
  uint32_t state_ = 1;
};

TEST(PathTracer, AgreesWithBruteForce) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene;
  SurfaceShading plastic, rough_metal;
  plastic.bits = kFresnelDielectric, plastic.specular = Vec3(1.0f), plastic.roughness = 0.4f;
  rough_metal = test::specular_surface(kFresnelConductor, 0.5f);
  rough_metal.metal_eta = Vec3(0.2f, 0.9f, 1.1f), rough_metal.metal_k = Vec3(3.9f, 2.4f, 2.1f);
  test::add_shaded(scene, test::floor_quad(4.0f), plastic, Vec3(0.6f, 0.4f, 0.2f));
  test::add_shaded(scene, test::sphere(Vec3(-1.2f, 1, 0), 1.0f, 32), rough_metal);
  test::add_shaded(scene, test::sphere(Vec3(1.2f, 1, 0), 1.0f, 32), {}, Vec3(0.7f));
  test::add_shaded(scene, test::quad(Vec3(-1.5f, 3.5f, -1.5f), Vec3(3, 0, 0), Vec3(0, 0, 3)),
                   test::emitter(Vec3(4, 3, 2)));
  scene.lights.push_back(test::sky_of(Vec3(0.2f, 0.3f, 0.5f)));
  const ImageSize size{12, 9};
  const Camera camera = test::camera_at(DVec3(0, 2, -6), DVec3(0, 0.8, 0), 45.0);
  ShadeConfig config = no_ambient();
  config.depth = 1, config.samples = 4;
  test::ShadeBench bench(scene);
  const ShadedFrame frame = bench.shade(camera, size, config, 128);
  const PrimaryCamera primary(camera, size);
  BruteForce brute(scene, bench);
  const HitSurfaces surfaces(bench.source, bench.tracer, bench.shade_scene.textures());
  double difference = 0.0, total = 0.0;
  std::vector<double> errors; // by pixel
  DVec3 ours(0.0), theirs(0.0);
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      const size_t p = size_t{y} * size.width + x;
      if (bench.gbuffer.instance[p] == kNoInstance) continue;
      const HitPoint point = surfaces.of_pixel(bench.gbuffer, p);
      const Material& material = scene.materials[point.material];
      if (material.shading.emits()) continue;
      const Vec3 direction(glm::normalize(primary.ray(x, y).direction));
      const DVec3 exact = brute.reflected_light(point, -direction, 1, 16384);
      const DVec3 found(frame.direct[p] + frame.specular[p]);
      difference += glm::length(found - exact), total += glm::length(exact);
      errors.push_back(glm::length(found - exact) / glm::length(exact));
      ours += found, theirs += exact;
    }
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(ours[c] / theirs[c], 1.0, 0.01) << c;
  EXPECT_LT(difference / total, 0.1); // noise of 16,384 directions
  ASSERT_GT(errors.size(), 60u);
  std::ranges::sort(errors);
  const double median = errors[errors.size() / 2], p95 = errors[errors.size() * 95 / 100];
  RecordProperty("median_pixel_error", std::to_string(median));
  RecordProperty("p95_pixel_error", std::to_string(p95));
  RecordProperty("largest_pixel_error", std::to_string(errors.back()));
  EXPECT_LT(median, 0.04);
  EXPECT_LT(p95, 0.1);
}

TEST(PathTracer, LightPassesWhatIsPartlyOpaque) {
  SurfaceShading half; // an uber material of opacity 0.25, 0.5, 1
  half.bits = kThin, half.transmission = Vec3(0.75f, 0.5f, 0.0f);
  Light sun;
  sun.kind = LightKind::kDistant, sun.direction = Vec3(0, 1, 0), sun.radiance = Vec3(2.0f);
  const Camera camera = test::floor_camera();
  const auto lit = [&](uint32_t veils, bool wall) {
    Scene scene;
    test::add_shaded(scene, test::floor_quad(4.0f), {}, Vec3(0.5f));
    for (uint32_t i = 0; i < veils; ++i) {
      const uint32_t veil =
          test::add_shape(scene, test::quad(Vec3(-1, 1.0f + static_cast<float>(i), -1), Vec3(2, 0, 0), Vec3(0, 0, 2)));
      scene.materials[scene.shapes[veil].material].shading = half;
    }
    if (wall) test::add_shaded(scene, test::quad(Vec3(-1, 5, -1), Vec3(2, 0, 0), Vec3(0, 0, 2)), {});
    scene.lights.push_back(sun);
    return test::middle(scene, camera, no_ambient());
  };
  const Vec3 open = lit(0, false), once = lit(1, false), twice = lit(2, false);
  EXPECT_GT(open.x, 0.1f);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(once[c], open[c] * half.transmission[c], 1e-5f) << c;
    EXPECT_NEAR(twice[c], open[c] * half.transmission[c] * half.transmission[c], 1e-5f) << c;
  }
  EXPECT_EQ(lit(1, true), Vec3(0.0f)) << "a wall above it";
}

TEST(PathTracer, DoesNotDependOnThreads) {
  Scene scene = striped_scene(test::specular_surface(kFresnelDielectric, 0.3f));
  test::add_shaded(scene, test::sphere(Vec3(0, 1, 0), 1.0f, 16), {});
  const Camera camera = test::camera_at(DVec3(-3, 2, -2), DVec3(0, 0.5, 0));
  const auto frame = [&] { return test::ShadeBench(scene).shade(camera, {70, 50}, {}, 2); };
  const ShadedFrame all = frame();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const ShadedFrame alone = frame();
  EXPECT_EQ(all.direct, alone.direct);
  EXPECT_EQ(all.specular, alone.specular);
  EXPECT_EQ(all.ambient, alone.ambient);
}

} // namespace
} // namespace packtrace
