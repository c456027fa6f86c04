#include "assets/generator/asteroids.h"

#include <algorithm>
#include <iterator>
#include <string>

#include <fmt/format.h>

#include "assets/generator/noise.h"
#include "assets/generator/placement.h"
#include "assets/generator/primitives.h"
#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

constexpr uint32_t kCells = 18;      ///< 6 * 18^2 quads per rock
constexpr double kSpacing = 5.4;     ///< metres: edge of the cube that each rock occupies on average
constexpr double kClearAround = 2.5; ///< metres around the eye without rocks
constexpr const char* kRockPaints[] = {"basalt", "slate", "clay", "ochre"};
constexpr const char* kRocksComment =
    "# Rocks of many shapes about the camera, as many as the generator is asked for.\n"
    "# To be seen: dented rocks of four colours in all directions, near and far. Made by "
    "packtrace_scenegen asteroids.\n\n";

/// An elongated lump of noise with one or two dents.
Model make_asteroid(uint64_t seed, uint64_t number) {
  Random random(seed, 400 + number);
  const double lumps = random.uniform(1.2, 2.4), roughness = random.uniform(0.2, 0.45);
  const uint64_t noise_seed = random.bits();
  struct Dent {
    DVec3 towards;
    double cosine, depth;
  };
  Dent dents[2];
  for (Dent& dent : dents) dent = {random_direction(random), random.uniform(0.75, 0.95), random.uniform(0.05, 0.25)};
  const DVec3 shape{random.uniform(0.7, 1.3), random.uniform(0.6, 1.0), random.uniform(0.6, 1.0)};
  Model model;
  add_blob(model.smooth(kRockPaints[number % std::size(kRockPaints)]), scaling(shape), kCells, [&](DVec3 direction) {
    double radius = 1.0 + roughness * fractal_noise(direction * lumps, noise_seed, 5);
    for (const Dent& dent : dents)
      radius -= dent.depth * smooth_step(dent.cosine, 1.0, glm::dot(direction, dent.towards));
    return std::max(radius, 0.3);
  });
  model.finish();
  return model;
}

/// Random rotation from three angles; not exactly uniform, but sufficient for rocks.
DAffine random_rock_rotation(Random& random) {
  const double x = random.uniform(0.0, 2.0 * kPi), y = random.uniform(0.0, 2.0 * kPi),
               z = random.uniform(0.0, 2.0 * kPi);
  return compose(rotation_x(x), compose(rotation_y(y), rotation_z(z)));
}

} // namespace

SceneTotals generate_asteroids(const AsteroidsConfig& config, const OutputConfig& output) {
  if (config.geometries < 1 || config.geometries > 5'000) {
    throw Error(ErrorKind::kUsage, fmt::format("--geometries {}: asteroids take 1 to 5000", config.geometries));
  }
  if (config.instances < config.geometries || config.instances > 50'000'000) {
    throw Error(ErrorKind::kUsage, fmt::format("--instances {}: asteroids take {} (one of each) to 50000000",
                                               config.instances, config.geometries));
  }
  const ViewConfig view{{0, 0, 0}, {0.3, 0.1, 1.0}, 60.0, 960, 540};
  SceneWriter writer(output, "asteroids", kRocksComment, view);
  const Vec3 albedo[] = {{0.22f, 0.22f, 0.24f}, {0.35f, 0.38f, 0.42f}, {0.55f, 0.38f, 0.28f}, {0.62f, 0.52f, 0.30f}};
  for (size_t i = 0; i < std::size(kRockPaints); ++i) writer.material(kRockPaints[i], albedo[i]);

  Random random(config.seed, 401'000'000);
  uint64_t side = 1;
  while (side * side * side < config.instances) ++side;
  const double half = 0.5 * kSpacing * static_cast<double>(side);
  for (uint64_t i = 0; i < config.instances; ++i) {
    const std::string name = fmt::format("rock_{}", i % config.geometries);
    if (i < config.geometries) writer.object(name, make_asteroid(config.seed, i)); // written with its first instance
    DVec3 place(0.0);
    do {
      for (int axis = 0; axis < 3; ++axis) place[axis] = random.uniform(-half, half);
    } while (glm::dot(place, place) < kClearAround * kClearAround);
    const double size = random.uniform(0.4, 1.3);
    const DAffine turned = compose(random_rock_rotation(random), scaling(DVec3(size)));
    writer.instance(name, compose(translation(place), turned));
  }
  return writer.finish();
}

} // namespace packtrace::scenegen
