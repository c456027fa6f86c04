#include "assets/generator/props.h"

#include <cmath>
#include <vector>

#include "assets/generator/noise.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

void add_flowers(Model& model, const DAffine& frame, DVec3 spread, int count, Random& random) {
  for (int i = 0; i < count; ++i) {
    const DVec3 out = random_direction(random);
    const DVec3 stalk = transform_point(frame, out * spread);
    const char* material = random.chance(0.4) ? "blossom" : random.chance(0.5) ? "leaf_light" : "leaf_dark";
    const DVec3 direction = glm::normalize(out + DVec3(0, 0.4, 0)) * random.uniform(0.16, 0.26);
    add_leaf(model.flat(material), stalk, direction, along(DVec3(0.0), direction)[0] * 0.08);
  }
}

/// A striped cloth roof from a high back edge to a low front edge with a scalloped hem; faces -z.
void add_awning(Model& model, const DAffine& f, double width, double depth, double drop, int stripes) {
  for (int i = 0; i < stripes; ++i) {
    Mesh& mesh = model.flat(i % 2 == 0 ? "canvas_a" : "canvas_b");
    const double x0 = width * i / stripes, x1 = width * (i + 1) / stripes, middle = (x0 + x1) / 2;
    add_quad(mesh, transform_point(f, {x0, -drop, -depth}), transform_point(f, {x0, 0, 0}),
             transform_point(f, {x1, 0, 0}), transform_point(f, {x1, -drop, -depth}));
    add_quad(mesh, transform_point(f, {x0, -drop - 0.22, -depth}), transform_point(f, {x0, -drop, -depth}),
             transform_point(f, {x1, -drop, -depth}), transform_point(f, {x1, -drop - 0.22, -depth}));
    add_triangle(mesh, transform_point(f, {x0, -drop - 0.22, -depth}), transform_point(f, {x1, -drop - 0.22, -depth}),
                 transform_point(f, {middle, -drop - 0.34, -depth}));
  }
}

void add_chair(Model& model, const DAffine& f) {
  Mesh& wood = model.flat("wood");
  add_box(wood, f, {-0.22, 0.42, -0.22}, {0.22, 0.47, 0.22});
  add_box(wood, f, {-0.22, 0.6, 0.19}, {0.22, 0.92, 0.23});
  for (const double x : {-0.2, 0.16}) {
    add_box(wood, f, {x, 0, -0.2}, {x + 0.04, 0.42, -0.16});
    add_box(wood, f, {x, 0, 0.18}, {x + 0.04, 0.9, 0.22});
  }
}

} // namespace

Model make_crate(Random& random) {
  Model model;
  Mesh& wood = model.flat("wood");
  Mesh& dark = model.flat("wood_dark");
  add_box(dark, kHere, {-0.36, 0.04, -0.36}, {0.36, 0.76, 0.36});
  for (int side = 0; side < 4; ++side) {
    const DAffine f = rotation_y(kPi / 2 * side);
    for (int i = 0; i < 4; ++i) {
      const double y = 0.02 + 0.195 * i;
      add_box(wood, f, {-0.4, y, -0.4}, {0.4, y + 0.17, -0.36 - random.uniform(0.0, 0.015)});
    }
    add_box(wood, f, {-0.42, 0.0, -0.44}, {-0.32, 0.8, -0.4});
    add_box(wood, f, {0.32, 0.0, -0.44}, {0.42, 0.8, -0.4});
  }
  for (int i = 0; i < 4; ++i) add_box(wood, kHere, {-0.4, 0.76, -0.4 + 0.2 * i}, {0.4, 0.8, -0.22 + 0.2 * i});
  return model;
}

Model make_barrel() {
  Model model;
  static constexpr glm::dvec2 kStaves[] = {{0.3, 0.0}, {0.37, 0.25}, {0.4, 0.5}, {0.37, 0.75}, {0.3, 1.0}};
  static constexpr glm::dvec2 kLid[] = {{0.3, 1.0}, {0.26, 1.0}, {0.26, 0.94}, {0.0, 0.94}};
  add_lathe(model.smooth("wood"), kHere, kStaves, 16);
  add_lathe(model.flat("wood_dark"), kHere, kLid, 16);
  for (const double y : {0.12, 0.3, 0.66, 0.84}) {
    const double t = (y - 0.5) * 2.0, r = 0.4 - 0.1 * t * t + 0.012;
    const glm::dvec2 hoop[] = {{r - 0.03, y - 0.005}, {r, y}, {r, y + 0.055}, {r - 0.03, y + 0.06}};
    add_lathe(model.flat("iron"), kHere, hoop, 16);
  }
  model.finish();
  return model;
}

Model make_rope_coil() {
  Model model;
  std::vector<DVec3> path;
  for (int i = 0; i <= 64; ++i) {
    const auto [s, c] = sin_cos(2 * kPi * i / 16.0);
    const double radius = 0.36 - 0.015 * (i / 16);
    path.push_back(DVec3(c * radius, 0.05 + 0.085 * i / 16.0, s * radius));
  }
  const std::vector<double> radii(path.size(), 0.05);
  add_tube(model.smooth("rope"), path, radii, 6);
  model.finish();
  return model;
}

Model make_bollard() {
  Model model;
  static constexpr glm::dvec2 kProfile[] = {{0.26, -0.1}, {0.25, 0.08}, {0.15, 0.14}, {0.13, 0.42},
                                            {0.22, 0.5},  {0.22, 0.58}, {0.12, 0.65}, {0.0, 0.66}};
  add_lathe(model.smooth("iron"), kHere, kProfile, 14);
  model.finish();
  return model;
}

Model make_lamp_post() {
  Model model;
  static constexpr glm::dvec2 kPost[] = {{0.16, -0.1}, {0.16, 0.3}, {0.09, 0.42}, {0.06, 0.6},
                                         {0.05, 3.2},  {0.09, 3.3}, {0.03, 3.4}};
  static constexpr glm::dvec2 kGlass[] = {{0.1, 3.4}, {0.19, 3.85}};
  static constexpr glm::dvec2 kHat[] = {{0.26, 3.84}, {0.22, 3.92}, {0.08, 4.1}, {0.04, 4.2}, {0.0, 4.28}};
  add_lathe(model.smooth("iron"), kHere, kPost, 10);
  add_lathe(model.flat("lamp"), kHere, kGlass, 6);
  add_lathe(model.flat("iron"), kHere, kHat, 6);
  for (int i = 0; i < 6; ++i) {
    const auto [s, c] = sin_cos(2 * kPi * i / 6.0);
    add_rod(model.smooth("iron"), {0.1 * c, 3.38, 0.1 * s}, {0.2 * c, 3.88, 0.2 * s}, 0.014, 4);
  }
  model.finish();
  return model;
}

Model make_bench() {
  Model model;
  Mesh& wood = model.flat("wood");
  for (int i = 0; i < 3; ++i) add_box(wood, kHere, {-0.8, 0.44, -0.25 + 0.16 * i}, {0.8, 0.48, -0.12 + 0.16 * i});
  for (int i = 0; i < 2; ++i) add_box(wood, kHere, {-0.8, 0.6 + 0.16 * i, 0.24}, {0.8, 0.73 + 0.16 * i, 0.28});
  for (const double x : {-0.65, 0.6}) {
    add_box(model.flat("iron"), kHere, {x, 0, -0.22}, {x + 0.05, 0.44, -0.17});
    add_box(model.flat("iron"), kHere, {x, 0, 0.26}, {x + 0.05, 0.9, 0.32});
    add_box(model.flat("iron"), kHere, {x, 0.4, -0.22}, {x + 0.05, 0.44, 0.3});
  }
  return model;
}

Model make_flower_pot(Random& random) {
  Model model;
  static constexpr glm::dvec2 kPot[] = {{0.16, 0.0},  {0.24, 0.4}, {0.28, 0.4}, {0.28, 0.48},
                                        {0.22, 0.48}, {0.2, 0.42}, {0.0, 0.42}};
  add_lathe(model.flat("pot"), kHere, kPot, 14);
  add_flowers(model, translation({0, 0.62, 0}), {0.3, 0.24, 0.3}, 60, random);
  return model;
}

Model make_flower_box(Random& random) {
  Model model;
  add_box(model.flat("pot"), kHere, {-0.55, 0.0, -0.34}, {0.55, 0.2, -0.1});
  add_flowers(model, translation({0, 0.24, -0.24}), {0.52, 0.16, 0.18}, 70, random);
  return model;
}

Model make_market_stall(Random& random) {
  Model model;
  for (const double x : {-1.25, 1.2}) {
    for (const double z : {-0.8, 0.85})
      add_box(model.flat("wood"), kHere, {x, 0, z}, {x + 0.06, z < 0 ? 2.1 : 2.6, z + 0.06});
  }
  add_awning(model, translation({-1.4, 2.65, 0.95}), 2.8, 2.1, 0.55, 8);
  add_box(model.flat("wood_dark"), kHere, {-1.2, 0.0, -0.6}, {1.2, 0.75, 0.6});
  static constexpr const char* kFruit[] = {"fruit_a", "fruit_b", "fruit_c"};
  for (int box = 0; box < 3; ++box) { // trays tilted towards the buyer, heaped with fruit
    const DAffine f = compose(translation({-1.15 + 0.78 * box, 0.78, -0.62}), rotation_x(-0.3));
    add_box(model.flat("wood"), f, {0, 0, 0}, {0.72, 0.16, 1.15});
    for (int i = 0; i < 15; ++i) {
      const DVec3 at{0.12 + 0.12 * (i % 5) + random.uniform(-0.02, 0.02), 0.18,
                     0.2 + 0.33 * (i / 5) + random.uniform(-0.04, 0.04)};
      const DAffine ball = compose(f, compose(translation(at), scaling(DVec3(0.085))));
      add_blob(model.smooth(kFruit[box]), ball, 2, [](DVec3) { return 0.0; });
    }
  }
  model.finish();
  return model;
}

Model make_cafe_table(Random& random) {
  Model model;
  static constexpr glm::dvec2 kTop[] = {{0.42, 0.7}, {0.42, 0.75}, {0.0, 0.75}};
  add_lathe(model.flat("white"), kHere, kTop, 16);
  add_rod(model.smooth("iron"), {0, 0, 0}, {0, 2.75, 0}, 0.03, 6);
  constexpr int kPanels = 8;
  for (int i = 0; i < kPanels; ++i) {
    const auto a = sin_cos(2 * kPi * i / kPanels), b = sin_cos(2 * kPi * (i + 1) / kPanels);
    Mesh& cloth = model.flat(i % 2 == 0 ? "canvas_a" : "canvas_b");
    const DVec3 top(0, 2.75, 0), pa(1.35 * a.cos, 2.2, 1.35 * a.sin), pb(1.35 * b.cos, 2.2, 1.35 * b.sin),
        hem(0, 0.18, 0);
    add_triangle(cloth, pa, top, pb);
    add_quad(cloth, pa - hem, pa, pb, pb - hem);
  }
  const double turn = random.uniform(0.0, kPi);
  for (int i = 0; i < 3; ++i)
    add_chair(model, compose(rotation_y(turn + 2 * kPi * i / 3.0), translation({0, 0, 0.75})));
  model.finish();
  return model;
}

Model make_laundry(Random& random) {
  Model model;
  static constexpr const char* kCloth[] = {"cloth_a", "cloth_b", "cloth_c", "white"};
  const DVec3 path[] = {{0, 0, 0}, {1.3, -0.12, 0}, {2.7, -0.12, 0}, {4, 0, 0}};
  const double radii[] = {0.012, 0.012, 0.012, 0.012};
  add_tube(model.smooth("rope"), path, radii, 3);
  for (const double end : {0.0, 4.0})
    add_box(model.flat("iron"), kHere, {end - 0.02, -0.02, 0.0}, {end + 0.02, 0.02, 0.45});
  double x = 0.3;
  while (x < 3.3) {
    const double width = random.uniform(0.35, 0.7), length = random.uniform(0.5, 1.0),
                 blow = random.uniform(-0.2, 0.25);
    Mesh& mesh = model.flat(kCloth[random.below(4)]);
    const auto cloth = [&](double u, double v) { // hangs from the line, blown outwards at the hem
      return DVec3(x + width * u, -0.1 - length * v, blow * v * v + 0.05 * v * sin_cos(9.0 * u).sin);
    };
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 3; ++j) {
        const double u0 = i / 4.0, u1 = (i + 1) / 4.0, v0 = j / 3.0, v1 = (j + 1) / 3.0;
        add_quad(mesh, cloth(u0, v1), cloth(u0, v0), cloth(u1, v0), cloth(u1, v1));
      }
    }
    x += width + random.uniform(0.08, 0.25);
  }
  model.finish();
  return model;
}

Model make_fish_rack(Random& random) {
  Model model;
  for (const double x : {-1.5, 0.0, 1.5}) add_rod(model.smooth("wood"), {x, -0.3, 0}, {x, 1.9, 0}, 0.05, 6);
  add_rod(model.smooth("wood"), {-1.6, 1.85, 0}, {1.6, 1.85, 0}, 0.04, 6);
  for (int i = 0; i < 16; ++i) { // the net: crossing cords
    const double x = -1.5 + 0.2 * i;
    const double low = random.uniform(0.35, 0.6);
    add_rod(model.smooth("rope"), {x, 1.85, -0.03}, {x + 0.35 - 0.04 * i, low, -0.25}, 0.012, 3);
  }
  for (int j = 0; j < 7; ++j) {
    const double y = 0.6 + 0.19 * j, z = -0.24 + 0.03 * j;
    add_rod(model.smooth("rope"), {-1.45, y, z}, {1.55, y, z}, 0.012, 3);
    const double x = random.uniform(-1.3, 1.3);
    add_blob(model.smooth("red"), compose(translation({x, y, z - 0.05}), scaling(DVec3(0.08))), 3,
             [](DVec3) { return 0.0; });
  }
  model.finish();
  return model;
}

Model make_buoy() {
  Model model;
  static constexpr glm::dvec2 kProfile[] = {{0.0, -0.4}, {0.3, -0.25}, {0.42, 0.0}, {0.36, 0.2}};
  static constexpr glm::dvec2 kTop[] = {{0.36, 0.2}, {0.2, 0.45}, {0.08, 0.6}, {0.05, 0.95}, {0.0, 0.95}};
  add_lathe(model.smooth("red"), kHere, kProfile, 14);
  add_lathe(model.smooth("white"), kHere, kTop, 14);
  model.finish();
  return model;
}

Model make_gull(Random& random) {
  Model model;
  Mesh& white = model.flat("white");
  const double lift = random.uniform(0.1, 0.2);
  const DVec3 nose(0, 0, 0.28), tail(0, 0, -0.3), back(0, 0.05, 0), belly(0, -0.06, 0);
  for (const double side : {-1.0, 1.0}) {
    const DVec3 rib(side * 0.07, 0, 0), elbow(side * 0.32, lift, 0.08), tip(side * 0.72, lift * 0.7, -0.1);
    add_triangle(white, nose, back, rib);
    add_triangle(white, back, tail, rib);
    add_triangle(white, nose, rib, belly);
    add_triangle(white, belly, rib, tail);
    add_quad(white, rib + DVec3(0, 0, 0.1), elbow + DVec3(0, 0, 0.05), elbow - DVec3(0, 0, 0.14),
             rib - DVec3(0, 0, 0.12));
    add_triangle(model.flat("stone_c"), elbow + DVec3(0, 0, 0.05), tip, elbow - DVec3(0, 0, 0.14));
  }
  return model;
}

Model make_cloud(Random& random) {
  Model model;
  const int puffs = 6;
  for (int i = 0; i < puffs; ++i) {
    const double t = (i + 0.5) / puffs * 2.0 - 1.0, size = (1.0 - 0.6 * t * t) * random.uniform(3.2, 4.6);
    const DVec3 at{t * 9.0, size * 0.45 + random.uniform(-0.5, 0.5), random.uniform(-1.5, 1.5)};
    const uint64_t seed = random.bits();
    add_blob(model.smooth("cloud"), compose(translation(at), scaling(DVec3(size, size * 0.72, size))), 5,
             [seed](DVec3 d) { return 0.12 * fractal_noise(d * 2.2, seed, 2); });
  }
  model.finish();
  return model;
}

} // namespace packtrace::scenegen
