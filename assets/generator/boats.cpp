#include "assets/generator/boats.h"

#include <algorithm>
#include <array>
#include <vector>

#include "assets/generator/facade.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

struct HullConfig {
  double length = 4.0;
  double half_width = 0.8;
  double freeboard = 0.5; ///< height of the side amidships
  double draught = 0.25;
  double rise = 0.4;        ///< height of the bow above the side amidships
  double stern_width = 0.7; ///< fraction of half_width
};

/// Point of the hull's surface: u in [0,1] from stern to bow, v in [0,1] from keel to sheer, side -1 or 1.
DVec3 hull_point(const HullConfig& c, double u, double v, double side, double thickness) {
  const double bow = u * u * u * u * u;
  const double fullness = mix(c.stern_width, 1.0, smooth_step(0.0, 0.5, u)) * (1.0 - bow);
  const double sheer = c.freeboard + c.rise * u * u * u + c.rise * 0.25 * (1.0 - u) * (1.0 - u);
  const double keel = -c.draught * (1.0 - bow) + sheer * 0.4 * bow;
  const double flare = v * (2.0 - v); // round bilge
  const double width = std::max(0.0, c.half_width * fullness * flare - thickness);
  const double stem = 0.45 * c.rise * bow * v; // the stem leans forward
  return {side * width, mix(keel + thickness, sheer, v), (u - 0.5) * c.length + stem - thickness * bow};
}

void add_skin(Mesh& mesh, const HullConfig& c, double side, double v0, double v1, double thickness, bool inside) {
  constexpr uint32_t kLong = 14, kRound = 5;
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (uint32_t i = 0; i <= kLong; ++i) {
    for (uint32_t j = 0; j <= kRound; ++j) {
      add_vertex(mesh, hull_point(c, static_cast<double>(i) / kLong, mix(v0, v1, static_cast<double>(j) / kRound), side,
                                  thickness));
    }
  }
  for (uint32_t i = 0; i < kLong; ++i) {
    for (uint32_t j = 0; j < kRound; ++j) {
      const uint32_t a = first + i * (kRound + 1) + j, b = a + kRound + 1;
      if ((side > 0) != inside)
        add_quad(mesh, a, a + 1, b + 1, b);
      else
        add_quad(mesh, a, b, b + 1, a + 1);
    }
  }
}

void add_hull(Model& model, const HullConfig& c) {
  constexpr double kThickness = 0.06;
  const double water = c.draught / (c.draught + c.freeboard) + 0.08;
  for (const double side : {-1.0, 1.0}) {
    add_skin(model.smooth("hull_low"), c, side, 0.0, water, 0.0, false);
    add_skin(model.smooth("hull"), c, side, water, 1.0, 0.0, false);
    add_skin(model.smooth("wood"), c, side, 0.0, 0.98, kThickness, true);
    std::vector<DVec3> rail;
    for (int i = 0; i <= 14; ++i) rail.push_back(hull_point(c, i / 14.0, 1.0, side, 0.02));
    const std::vector<double> radii(rail.size(), 0.055);
    add_tube(model.smooth("trim"), rail, radii, 5);
  }
  Mesh& transom = model.flat("hull");
  for (int j = 0; j < 5; ++j) {
    const double v0 = j / 5.0, v1 = (j + 1) / 5.0;
    add_quad(transom, hull_point(c, 0, v0, -1, 0), hull_point(c, 0, v1, -1, 0), hull_point(c, 0, v1, 1, 0),
             hull_point(c, 0, v0, 1, 0));
  }
}

/// A deck across the hull at a height, between two stations.
void add_deck(Mesh& mesh, const HullConfig& c, double v, double u0, double u1) {
  constexpr int kCells = 8;
  for (int i = 0; i < kCells; ++i) {
    const double a = mix(u0, u1, i / 8.0), b = mix(u0, u1, (i + 1) / 8.0);
    add_quad(mesh, hull_point(c, a, v, -1, 0.05), hull_point(c, b, v, -1, 0.05), hull_point(c, b, v, 1, 0.05),
             hull_point(c, a, v, 1, 0.05));
  }
}

void add_line(Model& model, DVec3 from, DVec3 to, double sag) {
  const DVec3 path[] = {from, glm::mix(from, to, 0.33) - DVec3(0, sag, 0), glm::mix(from, to, 0.67) - DVec3(0, sag, 0),
                        to};
  const double radii[] = {0.02, 0.02, 0.02, 0.02};
  add_tube(model.smooth("rope"), path, radii, 3);
}

/// A sail that bulges towards +x: a subdivided triangle, visible from both sides.
void add_sail(Model& model, DVec3 tack, DVec3 clew, DVec3 head, double belly) {
  Mesh& mesh = model.smooth("sail");
  constexpr uint32_t kCells = 8;
  std::array<std::array<uint32_t, kCells + 1>, kCells + 1> grid{};
  for (uint32_t j = 0; j <= kCells; ++j) {
    for (uint32_t i = 0; i + j <= kCells; ++i) {
      const double u = static_cast<double>(i) / kCells, v = static_cast<double>(j) / kCells, w = 1.0 - u - v;
      const DVec3 push(belly * 9.0 * (u * v * w + 0.35 * u * w), 0, 0);
      grid[j][i] = add_vertex(mesh, tack * w + clew * u + head * v + push);
    }
  }
  for (uint32_t j = 0; j < kCells; ++j) {
    for (uint32_t i = 0; i + j < kCells; ++i) {
      mesh.triangles.emplace_back(grid[j][i], grid[j][i + 1], grid[j + 1][i]);
      if (i + j + 1 < kCells) mesh.triangles.emplace_back(grid[j][i + 1], grid[j + 1][i + 1], grid[j + 1][i]);
    }
  }
}

} // namespace

Model make_rowing_boat(Random& random) {
  Model model;
  const HullConfig c{4.2, 0.8, 0.42, 0.18, 0.3, 0.7};
  add_hull(model, c);
  Mesh& wood = model.flat("wood");
  for (const double u : {0.18, 0.48, 0.72}) {
    const DVec3 end = hull_point(c, u, 0.75, 1, 0.05);
    add_box(wood, kHere, {-end.x, end.y - 0.04, end.z - 0.14}, {end.x, end.y, end.z + 0.14});
  }
  for (const double side : {-1.0, 1.0}) { // oars laid inside
    const DVec3 from{side * 0.25, 0.36, -1.5}, to{side * random.uniform(0.2, 0.4), 0.5, 1.3};
    add_rod(model.smooth("trim"), from, to, 0.03, 5);
    add_box(model.flat("trim"), along(from, to - from), {-0.08, 0.0, -0.015}, {0.08, 0.6, 0.015});
  }
  model.finish();
  return model;
}

Model make_fishing_boat(Random& random) {
  Model model;
  const HullConfig c{9.0, 1.6, 0.85, 0.6, 0.8, 0.8};
  add_hull(model, c);
  add_deck(model.flat("wood"), c, 0.72, 0.0, 0.93);
  const double deck = hull_point(c, 0.4, 0.72, 1, 0).y;
  const DAffine house = translation({-0.85, deck - 0.1, -0.4}); // wheelhouse
  const Opening front[] = {{OpeningKind::kBalconyDoor, 0.15, 1.2, 0.78, 1.85, false},
                           {OpeningKind::kBalconyDoor, 0.92, 1.2, 1.55, 1.85, false}};
  const Opening side[] = {{OpeningKind::kBalconyDoor, 0.4, 1.2, 1.4, 1.85, false}};
  Model cabin;
  const DVec3 corners[] = {{0, 0, 0}, {1.7, 0, 0}, {1.7, 0, 1.8}, {0, 0, 1.8}};
  for (int k = 0; k < 4; ++k) {
    const DAffine f = compose(house, compose(translation(corners[k]), rotation_y(-kPi / 2 * k)));
    add_facade(cabin, f, k % 2 == 0 ? 1.7 : 1.8, 2.1,
               k % 2 == 0 ? std::span<const Opening>(front) : std::span<const Opening>(side));
  }
  for (const ModelPart& part : cabin.parts()) { // the wheelhouse walls are painted planks, not masonry
    Mesh& mesh = model.flat(part.material == "wall" ? "white" : part.material);
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), part.mesh.positions.begin(), part.mesh.positions.end());
    for (const Triangle& t : part.mesh.triangles) mesh.triangles.push_back(t + first);
  }
  add_box(model.flat("red"), house, {-0.15, 2.1, -0.2}, {1.85, 2.22, 2.0});
  add_rod(model.smooth("wood"), {0, deck, 2.2}, {0, 5.6, 2.0}, 0.09, 7);
  add_rod(model.smooth("wood"), {0, 2.2, 2.2}, {0, 4.4, -0.4}, 0.06, 6);
  add_line(model, {0, 5.5, 2.0}, {0, 1.9, 4.6}, 0.0);
  add_line(model, {0, 5.5, 2.0}, {0, 3.1, -0.9}, 0.1);
  for (int i = 0; i < 5; ++i) { // fish boxes on the after deck
    const double x = random.uniform(-0.8, 0.8);
    const double z = -2.0 - 0.5 * i;
    add_box(model.flat(i % 2 == 0 ? "wood" : "red"), kHere, {x - 0.35, deck - 0.1, z},
            {x + 0.35, deck + 0.3, z + 0.42});
  }
  for (const double z : {-2.4, -0.6, 1.2}) { // fenders
    for (const double sign : {-1.0, 1.0}) {
      const double u = z / c.length + 0.5;
      const DVec3 p = hull_point(c, u, 0.8, sign, -0.12);
      add_rod(model.smooth("sail"), p - DVec3(0, 0.35, 0), p + DVec3(0, 0.15, 0), 0.13, 8);
    }
  }
  model.finish();
  return model;
}

Model make_sailing_boat(Random& random) {
  Model model;
  const HullConfig c{10.0, 1.5, 0.8, 0.5, 0.6, 0.6};
  add_hull(model, c);
  add_deck(model.flat("wood"), c, 0.9, 0.25, 0.97);
  add_deck(model.flat("wood"), c, 0.5, 0.0, 0.3);
  add_tapered_box(model.flat("white"), kHere, {-0.8, 0.6, -1.8}, {0.8, 1.35, 1.8}, 0.85);
  add_box(model.flat("glass"), kHere, {-0.79, 0.98, -1.2}, {0.79, 1.16, 1.2});
  const double belly = random.uniform(0.7, 0.9);
  add_rod(model.smooth("wood"), {0, 0.3, 1.0}, {0, 11.5, 0.8}, 0.09, 8);
  add_rod(model.smooth("wood"), {0, 1.9, 0.95}, {0.4, 1.8, -3.8}, 0.07, 6);
  add_sail(model, {0, 2.0, 0.8}, {0.4, 1.95, -3.7}, {0, 11.2, 0.7}, belly);
  add_sail(model, {0, 1.5, 5.0}, {0.5, 1.7, 1.4}, {0, 9.8, 0.95}, belly * 0.8);
  add_line(model, {0, 11.4, 0.8}, {0, 1.4, 5.1}, 0.0);
  add_line(model, {0, 11.4, 0.8}, {0, 1.0, -4.9}, 0.0);
  model.finish();
  return model;
}

} // namespace packtrace::scenegen
