#include "assets/generator/foliage.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

/// An ellipsoid that leaves grow on.
struct Crown {
  DVec3 centre;
  DVec3 radius;
};

struct Foliage {
  std::string_view light, dark; ///< materials of the upper and the lower, inner leaves
  double length = 0.5;          ///< metres
  double width = 0.3;
  double droop = 0.3; ///< drop of the tips as a fraction of the length
};

/// More leaves are smaller, so that together they cover the same area.
Foliage refined(Foliage foliage, double detail) {
  const double size = detail > 1.0 ? 1.0 / std::sqrt(detail) : 1.0;
  foliage.length *= size, foliage.width *= size;
  return foliage;
}

uint32_t scaled(double count, double detail) { return static_cast<uint32_t>(std::max(1.0, count * detail + 0.5)); }

void add_leaf_towards(Model& model, const Foliage& foliage, DVec3 stalk, DVec3 outward, double lightness,
                      Random& random) {
  const double size = random.uniform(0.75, 1.25);
  DVec3 direction = outward + random_direction(random) * 0.7 - DVec3(0, foliage.droop, 0);
  const double length = glm::length(direction);
  direction = length > 1e-3 ? direction / length : DVec3(0, -1, 0);
  const DVec3 side = along(DVec3(0.0), direction + random_direction(random) * 0.01)[0];
  const bool light = lightness + random.uniform(-0.35, 0.35) > 0.5;
  add_leaf(model.flat(light ? foliage.light : foliage.dark), stalk, direction * (foliage.length * size),
           side * (foliage.width * 0.5 * size));
}

/// Leaves near the surface of an ellipsoid, dense at the top, light above and dark below.
void cover(Model& model, const Crown& crown, const Foliage& foliage, uint32_t count, Random& random) {
  for (uint32_t i = 0; i < count; ++i) {
    DVec3 out = random_direction(random);
    if (out.y < -0.35 && random.chance(0.7)) out.y = -out.y;
    const double shell = random.uniform();
    const double depth = 1.0 - 0.3 * shell * shell;
    const DVec3 stalk = crown.centre + out * crown.radius * depth;
    add_leaf_towards(model, foliage, stalk, out, 0.5 + 0.5 * out.y - (1.0 - depth), random);
  }
}

double area(const Crown& crown) {
  return crown.radius.x * crown.radius.y + crown.radius.y * crown.radius.z + crown.radius.z * crown.radius.x;
}

void cover(Model& model, std::span<const Crown> crowns, const Foliage& foliage, uint32_t count, Random& random) {
  double total = 0.0;
  for (const Crown& crown : crowns) total += area(crown);
  for (const Crown& crown : crowns) cover(model, crown, foliage, scaled(count, area(crown) / total), random);
}

/// A bent, tapering trunk or branch.
void add_limb(Model& model, DVec3 from, DVec3 to, double radius_from, double radius_to, double bend, Random& random) {
  constexpr size_t kPoints = 4;
  const DVec3 sway = random_direction(random) * bend;
  DVec3 path[kPoints];
  double radii[kPoints];
  for (size_t i = 0; i < kPoints; ++i) {
    const double t = static_cast<double>(i) / (kPoints - 1);
    path[i] = glm::mix(from, to, t) + sway * (4.0 * t * (1.0 - t));
    radii[i] = mix(radius_from, radius_to, t);
  }
  add_tube(model.smooth("bark"), path, radii, 6);
}

/// A trunk, one branch per crown, and leaves.
Model make_branched(DVec3 fork, double trunk_radius, std::span<const Crown> crowns, const Foliage& foliage,
                    uint32_t leaf_count, Random& random) {
  Model model;
  add_limb(model, DVec3(0, -0.6, 0), fork, trunk_radius * 1.25, trunk_radius * 0.75, fork.y * 0.06, random);
  for (const Crown& crown : crowns) {
    add_limb(model, fork - DVec3(0, 0.1, 0), crown.centre, trunk_radius * 0.6, trunk_radius * 0.2, 0.25, random);
  }
  cover(model, crowns, foliage, leaf_count, random);
  model.finish();
  return model;
}

} // namespace

Model make_broadleaf(Random& random, double detail) {
  std::vector<Crown> crowns{{{0, 4.3, 0}, DVec3(1.5, 1.4, 1.5)}};
  for (int i = 0; i < 5; ++i) {
    const auto [s, c] = sin_cos(2.0 * kPi * i / 5.0 + random.uniform(-0.3, 0.3));
    crowns.push_back({{1.35 * c, random.uniform(3.0, 3.9), 1.35 * s}, DVec3(random.uniform(0.95, 1.3))});
  }
  const Foliage foliage = refined({"leaf_light", "leaf_dark", 0.52, 0.34, 0.35}, detail);
  return make_branched({0.1, 2.1, 0}, 0.22, crowns, foliage, scaled(760, detail), random);
}

Model make_olive(Random& random, double detail) {
  std::vector<Crown> crowns;
  for (int i = 0; i < 4; ++i) {
    const auto [s, c] = sin_cos(2.0 * kPi * i / 4.0 + random.uniform(-0.4, 0.4));
    crowns.push_back({{0.9 * c, random.uniform(2.2, 3.0), 0.9 * s}, DVec3(1.0, 0.75, 1.0) * random.uniform(0.8, 1.2)});
  }
  const Foliage foliage = refined({"olive", "leaf_dark", 0.45, 0.2, 0.3}, detail);
  return make_branched({0.25, 1.1, 0.1}, 0.24, crowns, foliage, scaled(560, detail), random);
}

Model make_umbrella_pine(Random& random, double detail) {
  std::vector<Crown> crowns{{{0.3, 7.9, 0}, DVec3(1.9, 0.75, 1.9)}};
  for (int i = 0; i < 6; ++i) {
    const auto [s, c] = sin_cos(2.0 * kPi * i / 6.0 + random.uniform(-0.3, 0.3));
    crowns.push_back(
        {{0.3 + 2.1 * c, random.uniform(7.1, 7.6), 2.1 * s}, DVec3(1.3, 0.6, 1.3) * random.uniform(0.85, 1.1)});
  }
  const Foliage foliage = refined({"pine", "leaf_dark", 0.5, 0.2, -0.4}, detail);
  return make_branched({0.25, 5.6, 0}, 0.26, crowns, foliage, scaled(820, detail), random);
}

Model make_cypress(Random& random, double detail) {
  Model model;
  add_limb(model, DVec3(0, -0.6, 0), DVec3(0, 6.5, 0), 0.16, 0.05, 0.02, random);
  const Foliage foliage = refined({"cypress", "leaf_dark", 0.6, 0.24, -0.9}, detail);
  const uint32_t count = scaled(620, detail);
  for (uint32_t i = 0; i < count; ++i) {
    const double t = random.uniform();
    const double height = 0.35 + 7.4 * t * (0.6 + 0.4 * t); // denser below, where the tree is wider
    const double u = (height - 0.35) / 7.6;
    const double radius = 0.95 * std::sqrt(std::max(0.0, u * 3.0)) * (1.0 - u) + 0.06;
    const auto [s, c] = sin_cos(random.uniform(0.0, 2.0 * kPi));
    const DVec3 out(c, 0.3, s);
    const double depth = random.uniform(0.75, 1.0);
    add_leaf_towards(model, foliage, DVec3(c * radius * depth, height, s * radius * depth), out, depth * 1.6 - 0.6,
                     random);
  }
  model.finish();
  return model;
}

Model make_conifer(Random& random, double detail) {
  Model model;
  add_limb(model, DVec3(0, -0.6, 0), DVec3(0, 10.8, 0), 0.28, 0.03, 0.05, random);
  const Foliage foliage = refined({"cypress", "leaf_dark", 0.62, 0.22, 0.25}, detail);
  constexpr int kWhorls = 13;
  const uint32_t leaves = scaled(13, detail);
  for (int level = 0; level < kWhorls; ++level) {
    const double u = static_cast<double>(level) / kWhorls;
    const double reach = 3.1 * (1.0 - u) + 0.35, height = 1.7 + 9.4 * u;
    const int branches = 9 - level / 3;
    for (int b = 0; b < branches; ++b) {
      const auto [s, c] = sin_cos(2.0 * kPi * b / branches + level * 0.8 + random.uniform(-0.2, 0.2));
      const double length = reach * random.uniform(0.85, 1.1);
      const DVec3 tip(c * length, height - 0.22 * length, s * length);
      add_rod(model.smooth("bark"), DVec3(0, height, 0), tip, 0.03, 3);
      for (uint32_t k = 0; k < leaves; ++k) {
        const double t = 0.12 + 0.9 * (k + random.uniform()) / leaves;
        const DVec3 stalk = glm::mix(DVec3(0, height, 0), tip, t);
        const DVec3 out = DVec3(c, 0.1, s) * 0.7 + DVec3(-s, 0, c) * ((k & 1) != 0 ? 1.0 : -1.0);
        add_leaf_towards(model, foliage, stalk, out, t * 0.9, random);
      }
    }
  }
  model.finish();
  return model;
}

Model make_palm(Random& random, double detail) {
  Model model;
  const DVec3 top(0.5, 6.0, 0.2);
  add_limb(model, DVec3(0, -0.5, 0), top, 0.24, 0.15, 0.3, random);
  const uint32_t leaflets = scaled(15, detail);
  constexpr int kFronds = 15;
  for (int f = 0; f < kFronds; ++f) {
    const auto [s, c] = sin_cos(2.0 * kPi * f / kFronds + random.uniform(-0.15, 0.15));
    const double rise = random.uniform(0.2, 1.3), reach = random.uniform(2.0, 2.5);
    const auto spine = [&](double t) {
      return top + DVec3(c * reach * t, rise * t * 1.6 - (1.3 + rise) * t * t, s * reach * t);
    };
    const DVec3 across(-s, 0.0, c);
    for (uint32_t k = 0; k < leaflets; ++k) {
      const double t = 0.12 + 0.88 * k / leaflets;
      const double length = 0.75 * (1.0 - 0.6 * t);
      const DVec3 forward = glm::normalize(spine(t + 0.05) - spine(t));
      for (const double sign : {-1.0, 1.0}) {
        const DVec3 direction = across * (sign * length) + forward * (0.6 * length) - DVec3(0, 0.4 * length, 0);
        add_leaf(model.flat("palm"), spine(t), direction, forward * 0.07);
      }
    }
    const DVec3 rib[] = {spine(0.0), spine(0.35), spine(0.7), spine(1.0)};
    const double radii[] = {0.05, 0.04, 0.03, 0.01};
    add_tube(model.smooth("palm"), rib, radii, 3);
  }
  model.finish();
  return model;
}

Model make_bush(Random& random, double detail) {
  const Crown crowns[] = {{{0, 0.35, 0}, DVec3(0.6, 0.5, 0.6)},
                          {{0.45, 0.25, 0.15}, DVec3(0.45, 0.38, 0.45)},
                          {{-0.35, 0.28, -0.2}, DVec3(0.5, 0.4, 0.45)}};
  Model model;
  cover(model, crowns, refined({"leaf_light", "leaf_dark", 0.3, 0.2, 0.0}, detail), scaled(170, detail), random);
  model.finish();
  return model;
}

Model make_blossom_bush(Random& random, double detail) {
  const Crown crowns[] = {{{0, 0.6, 0}, DVec3(0.8, 0.6, 0.5)},
                          {{0.3, 1.3, 0.1}, DVec3(0.7, 0.5, 0.4)},
                          {{-0.4, 1.0, 0.0}, DVec3(0.5, 0.6, 0.4)}};
  Model model;
  cover(model, crowns, refined({"leaf_light", "leaf_dark", 0.3, 0.2, 0.2}, detail), scaled(130, detail), random);
  cover(model, crowns, refined({"blossom", "blossom", 0.26, 0.22, 0.1}, detail), scaled(120, detail), random);
  model.finish();
  return model;
}

Model make_grass_tuft(Random& random, double detail) {
  Model model;
  const uint32_t blades = scaled(22, detail);
  for (uint32_t i = 0; i < blades; ++i) {
    const auto [s, c] = sin_cos(random.uniform(0.0, 2.0 * kPi));
    const double lean = random.uniform(0.05, 0.3), height = random.uniform(0.25, 0.55);
    const DVec3 root = DVec3(c, 0.0, s) * random.uniform(0.0, 0.25) - DVec3(0, 0.05, 0);
    add_leaf(model.flat(random.chance(0.5) ? "leaf_light" : "olive"), root, DVec3(c * lean, height, s * lean),
             DVec3(-s, 0, c) * 0.04);
  }
  model.finish();
  return model;
}

} // namespace packtrace::scenegen
