#include "assets/generator/masonry.h"

#include <array>
#include <cmath>

#include "assets/generator/facade.h"
#include "assets/generator/noise.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

constexpr double kHalf = kWallModule / 2;
constexpr std::array<const char*, 4> kStones{"stone", "stone", "stone_b", "stone_c"};

/// Courses of blocks with uneven lengths and relief, facing -z.
void add_courses(Model& model, double y0, double y1, double course, double block, double relief, Random& random) {
  const auto count = static_cast<uint32_t>(std::max(1.0, std::floor((y1 - y0) / course + 0.5)));
  for (uint32_t j = 0; j < count; ++j) {
    const double bottom = y0 + (y1 - y0) * j / count, top = y0 + (y1 - y0) * (j + 1) / count;
    double x = -kHalf;
    while (x < kHalf - 0.05) {
      double end = x + block * random.uniform(0.65, 1.35);
      if (end > kHalf - block * 0.4) end = kHalf;
      const double front = -relief * random.uniform();
      add_box(model.flat(kStones[random.below(4)]), kHere, {x + 0.015, bottom + 0.015, front},
              {end - 0.015, top - 0.015, 0.25});
      x = end;
    }
  }
  add_box(model.flat("stone_c"), kHere, {-kHalf, y0, 0.05}, {kHalf, y1, 0.45}); // mortar
}

} // namespace

Model make_stone_wall(double height, Random& random) {
  Model model;
  add_courses(model, -0.3, height, 0.45, 0.6, 0.1, random);
  add_box(model.flat("stone"), kHere, {-kHalf - 0.02, height, -0.14}, {kHalf + 0.02, height + 0.12, 0.45});
  return model;
}

Model make_quay_wall(double depth, Random& random) {
  Model model;
  add_courses(model, -depth, -0.2, 0.6, 1.0, 0.06, random);
  add_box(model.flat("stone"), kHere, {-kHalf, -0.2, -0.12}, {-0.01, 0.06, 0.8});
  add_box(model.flat("stone_b"), kHere, {0.01, -0.2, -0.12}, {kHalf, 0.06, 0.8});
  if (random.chance(0.6)) {
    const double x = random.uniform(-0.6, 0.6);
    add_rod(model.smooth("wood_dark"), {x, -depth, -0.22}, {x, -0.1, -0.22}, 0.12, 7);
  }
  model.finish();
  return model;
}

Model make_stairs(uint32_t steps, double rise, double run, double width) {
  Model model;
  const double half = width / 2;
  for (uint32_t i = 0; i < steps; ++i) {
    Mesh& mesh = model.flat(i % 3 == 1 ? "stone_b" : "stone");
    add_box(mesh, kHere, {-half, i * rise - (i == 0 ? 0.6 : 0.25), i * run - 0.03},
            {half, (i + 1) * rise, (i + 1) * run + 0.1});
  }
  const double height = steps * rise, length = steps * run;
  for (const double x : {-half - 0.28, half}) { // side walls: parallelograms with sloping tops
    Mesh& mesh = model.flat("stone_b");
    const DVec3 corners[] = {
        {x, -0.6, -0.3}, {x, 0.75, -0.3}, {x, height + 0.75, length}, {x, height - 0.6, length + 0.1}};
    const DVec3 across(0.28, 0, 0);
    add_quad(mesh, corners[0], corners[3], corners[2], corners[1]);
    add_quad(mesh, corners[0] + across, corners[1] + across, corners[2] + across, corners[3] + across);
    add_quad(mesh, corners[1], corners[2], corners[2] + across, corners[1] + across);
    add_quad(mesh, corners[0], corners[1], corners[1] + across, corners[0] + across);
    add_quad(mesh, corners[2], corners[3], corners[3] + across, corners[2] + across);
  }
  return model;
}

Model make_parapet(Random& random) {
  Model model;
  add_courses(model, 0.0, 0.8, 0.4, 0.55, 0.05, random);
  add_box(model.flat("stone"), kHere, {-kHalf, 0.8, -0.1}, {kHalf, 0.92, 0.5});
  return model;
}

Model make_iron_railing() {
  Model model;
  add_railing(model, "iron", translation({-kHalf, 0, 0}), kWallModule, 1.0, 0.2);
  return model;
}

Model make_wooden_fence(Random& random) {
  Model model;
  Mesh& mesh = model.flat("wood");
  for (const double y : {0.35, 0.75}) add_box(mesh, kHere, {-kHalf, y, 0.0}, {kHalf, y + 0.1, 0.05});
  for (int i = 0; i < 9; ++i) {
    const double x = -kHalf + (i + 0.5) * kWallModule / 9.0, top = random.uniform(0.9, 1.1);
    add_box(mesh, kHere, {x - 0.07, -0.3, -0.04}, {x + 0.07, top, 0.0});
  }
  return model;
}

Model make_pier(Random& random) {
  Model model;
  for (int i = 0; i < 8; ++i) {
    const double z = i * kWallModule / 8.0;
    const double left = -2.0 - random.uniform(0.0, 0.12);
    const double right = 2.0 + random.uniform(0.0, 0.12);
    const double top = random.uniform(0.0, 0.02);
    add_box(model.flat(random.chance(0.3) ? "wood_dark" : "wood"), kHere, {left, -0.07, z + 0.012},
            {right, top, z + 0.238});
  }
  Mesh& beams = model.flat("wood_dark");
  for (const double x : {-1.7, 0.0, 1.7}) add_box(beams, kHere, {x - 0.1, -0.3, 0.0}, {x + 0.1, -0.07, kWallModule});
  add_box(beams, kHere, {-2.0, -0.52, 0.9}, {2.0, -0.3, 1.1});
  for (const double x : {-1.85, 1.85}) {
    const double lean = random.uniform(-0.06, 0.06), top = random.uniform(0.5, 0.8);
    add_rod(model.smooth("wood_dark"), {x + lean, -4.0, 1.0}, {x, top, 1.0 + lean}, 0.14, 8);
  }
  model.finish();
  return model;
}

Model make_rock(std::string_view material, Random& random) {
  Model model;
  const uint64_t seed = random.bits();
  const double wide = random.uniform(0.5, 0.75), high = random.uniform(0.35, 0.55), deep = random.uniform(0.45, 0.7);
  const auto shape = [seed](DVec3 d) {
    const double ridged = 1.0 - std::abs(fractal_noise(d * 1.7, seed, 3)) * 1.8;
    return 0.45 * (ridged - 0.7) + 0.12 * value_noise(d * 5.0, seed + 1);
  };
  add_blob(model.flat(material), compose(translation({0, 0.15, 0}), scaling({wide, high, deep})), 7, shape);
  return model;
}

} // namespace packtrace::scenegen
