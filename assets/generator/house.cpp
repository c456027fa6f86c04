#include "assets/generator/house.h"

#include <cmath>
#include <vector>

#include "assets/generator/facade.h"
#include "assets/generator/placement.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

constexpr double kEaves = 0.42;

/// The four sides of a block as facade frames: front, right, back, left.
DAffine side_frame(double x0, double x1, double z0, double z1, int side) {
  const DVec3 corners[] = {{x0, 0, z0}, {x1, 0, z0}, {x1, 0, z1}, {x0, 0, z1}};
  return compose(translation(corners[side]), rotation_y(-kPi / 2 * side));
}

Opening window(double centre, double floor_y, bool shutters, Random& random) {
  const bool lit = random.chance(0.12);
  return {shutters ? OpeningKind::kShutteredWindow : OpeningKind::kWindow,
          centre - 0.45,
          floor_y + 0.95,
          centre + 0.45,
          floor_y + 2.3,
          lit};
}

std::vector<Opening> front_openings(const HouseConfig& c, Random& random) {
  std::vector<Opening> openings;
  const double step = c.width / c.columns;
  const uint32_t door = random.below(c.columns);
  for (uint32_t floor = 0; floor < c.floors; ++floor) {
    for (uint32_t i = 0; i < c.columns; ++i) {
      const double x = (i + 0.5) * step, y = floor * kFloorHeight;
      if (floor == 0 && c.arcade) {
        const double half = std::min(1.05, step * 0.36);
        openings.push_back({OpeningKind::kArch, x - half, 0.0, x + half, 2.6, false});
      } else if (floor == 0 && i == door) {
        openings.push_back({OpeningKind::kDoor, x - 0.52, 0.24, x + 0.52, 2.3, false});
      } else if (c.balcony && floor + 1 == c.floors && i < 2) {
        openings.push_back({OpeningKind::kBalconyDoor, x - 0.5, y + 0.12, x + 0.5, y + 2.25, random.chance(0.2)});
      } else {
        openings.push_back(window(x, y, c.shutters, random));
      }
    }
  }
  return openings;
}

std::vector<Opening> side_openings(const HouseConfig& c, Random& random) {
  std::vector<Opening> openings;
  for (uint32_t floor = 0; floor < c.floors; ++floor) {
    for (const double t : {0.28, 0.72}) {
      if (random.chance(0.75)) openings.push_back(window(c.depth * t, floor * kFloorHeight, c.shutters, random));
    }
  }
  return openings;
}

void add_balcony(Model& model, const HouseConfig& c) {
  const double y = (c.floors - 1) * kFloorHeight, length = 2.0 * c.width / c.columns - 0.3, x0 = -c.width / 2 + 0.15;
  Mesh& stone = model.flat("stone");
  add_box(stone, kHere, {x0, y - 0.06, -1.05}, {x0 + length, y + 0.1, 0.0});
  for (const double t : {0.1, 0.5, 0.9}) {
    const double x = x0 + length * t;
    add_box(stone, kHere, {x - 0.08, y - 0.4, -0.45}, {x + 0.08, y - 0.06, 0.0});
    add_box(stone, kHere, {x - 0.08, y - 0.22, -0.85}, {x + 0.08, y - 0.06, -0.45});
  }
  add_railing(model, "iron", compose(translation({x0 + 0.05, y + 0.1, -1.0}), kHere), length - 0.1, 0.95, 0.16);
  for (const double x : {x0 + 0.05, x0 + length - 0.05}) {
    add_railing(model, "iron", compose(translation({x, y + 0.1, -1.0}), rotation_y(-kPi / 2)), 0.95, 0.95, 0.2);
  }
}

/// The room behind the arches: a floor, a back wall with a door, and darkness.
void add_arcade_room(Model& model, const HouseConfig& c) {
  const DAffine back = translation({-c.width / 2, 0, 2.0});
  const Opening doors[] = {{OpeningKind::kDoor, c.width * 0.25 - 0.5, 0.24, c.width * 0.25 + 0.5, 2.2, false},
                           {OpeningKind::kWindow, c.width * 0.7 - 0.6, 0.9, c.width * 0.7 + 0.6, 2.1, true}};
  add_facade(model, back, c.width, 2.75, doors);
  add_box(model.flat("wood"), kHere, {-c.width / 2 + 0.05, 2.7, 0.05}, {c.width / 2 - 0.05, 2.8, 2.0});
  add_box(model.flat("stone"), kHere, {-c.width / 2 + 0.05, -0.1, 0.05}, {c.width / 2 - 0.05, 0.02, 2.0});
}

/// Roof deck under the tiles, tiles, and rafter ends along the eave. Frame as in add_tiles().
void add_slope(Model& model, const DAffine& frame, double width, double length, double inset, Random& random) {
  Mesh& wood = model.flat("wood");
  if (inset == 0.0) {
    add_box(wood, frame, {0.0, 0.0, 0.02}, {width, length, 0.12});
  } else {
    add_quad(wood, transform_point(frame, {0, 0, 0.03}), transform_point(frame, {inset, length, 0.03}),
             transform_point(frame, {width - inset, length, 0.03}), transform_point(frame, {width, 0, 0.03}));
    add_quad(wood, transform_point(frame, {0, 0, 0.12}), transform_point(frame, {width, 0, 0.12}),
             transform_point(frame, {width - inset, length, 0.12}), transform_point(frame, {inset, length, 0.12}));
  }
  add_tiles(model, frame, width, length, inset, random);
  const auto rafters = static_cast<uint32_t>(width / 0.7);
  for (uint32_t i = 0; i <= rafters; ++i) {
    const double x = 0.15 + (width - 0.3) * i / rafters;
    add_box(wood, frame, {x - 0.06, 0.05, 0.12}, {x + 0.06, 0.75, 0.27});
  }
}

void add_ridge(Model& model, DVec3 from, DVec3 to) { add_rod(model.smooth("tile_b"), from, to, 0.14, 8); }

/// Two slopes whose ridge runs along x of the frame; the block spans [0,width] x [0,depth] at y = 0.
void add_gable(Model& model, const DAffine& frame, double width, double depth, double pitch_rad, Random& random) {
  const auto [s, c] = sin_cos(pitch_rad);
  const double rise = depth / 2 * s / c, length = (depth / 2 + kEaves) / c, overhang = 0.3;
  for (int k = 0; k < 2; ++k) {
    const DAffine turn = k == 0 ? kHere : compose(translation({width, 0, depth}), rotation_y(kPi));
    // The facade plane tilted back, so that its y axis climbs the slope.
    const DAffine tilt = compose(translation({-overhang, -kEaves * s / c, -kEaves}), rotation_x(kPi / 2 - pitch_rad));
    add_slope(model, compose(frame, compose(turn, tilt)), width + 2 * overhang, length, 0.0, random);
    Mesh& wall = model.flat("wall");
    const DAffine side = compose(frame, turn);
    add_triangle(wall, transform_point(side, {0, 0, depth}), transform_point(side, {0, rise, depth / 2}),
                 transform_point(side, {0, 0, 0}));
  }
  add_ridge(model, transform_point(frame, {-overhang, rise + 0.08, depth / 2}),
            transform_point(frame, {width + overhang, rise + 0.08, depth / 2}));
}

/// Four slopes up to a short ridge along x, or to a point.
void add_hip(Model& model, const DAffine& frame, double width, double depth, double pitch_rad, Random& random) {
  const auto [s, c] = sin_cos(pitch_rad);
  const double half = std::min(width, depth) / 2, rise = half * s / c, length = (half + kEaves) / c;
  for (int k = 0; k < 4; ++k) {
    const double run = (k % 2 == 0 ? width : depth) + 2 * kEaves;
    const DAffine side = side_frame(-kEaves, width + kEaves, -kEaves, depth + kEaves, k);
    const DAffine tilt = compose(translation({0, -kEaves * s / c, 0}), rotation_x(kPi / 2 - pitch_rad));
    add_slope(model, compose(frame, compose(side, tilt)), run, length, half + kEaves, random);
  }
  const DVec3 a(half, rise, depth >= width ? half : depth / 2),
      b(width - half, rise, depth >= width ? depth - half : depth / 2);
  const double drop = -kEaves * s / c;
  const DVec3 corners[] = {{-kEaves, drop, -kEaves},
                           {width + kEaves, drop, -kEaves},
                           {width + kEaves, drop, depth + kEaves},
                           {-kEaves, drop, depth + kEaves}};
  const DVec3 lift(0, 0.06, 0);
  for (int k = 0; k < 4; ++k) {
    const bool low_end = depth >= width ? k < 2 : (k == 0 || k == 3);
    add_ridge(model, transform_point(frame, corners[k] + lift), transform_point(frame, (low_end ? a : b) + lift));
  }
  if (glm::length(b - a) > 0.01) add_ridge(model, transform_point(frame, a + lift), transform_point(frame, b + lift));
}

/// Flat roof with a parapet, a pergola and pots.
void add_terrace(Model& model, const DAffine& f, double width, double depth) {
  Mesh& wall = model.flat("wall");
  add_box(model.flat("stone"), f, {0.0, -0.05, 0.0}, {width, 0.05, depth});
  add_box(wall, f, {0, 0.0, 0}, {width, 0.7, 0.25});
  add_box(wall, f, {0, 0.0, depth - 0.25}, {width, 0.7, depth});
  add_box(wall, f, {0, 0.0, 0.25}, {0.25, 0.7, depth - 0.25});
  add_box(wall, f, {width - 0.25, 0.0, 0.25}, {width, 0.7, depth - 0.25});
  Mesh& wood = model.flat("wood");
  for (const double x : {0.6, width * 0.55}) {
    for (const double z : {0.6, depth * 0.6}) add_box(wood, f, {x - 0.07, 0.05, z - 0.07}, {x + 0.07, 2.3, z + 0.07});
  }
  for (int i = 0; i < 8; ++i) {
    const double x = mix(0.5, width * 0.55, i / 7.0);
    add_box(wood, f, {x - 0.05, 2.3, 0.3}, {x + 0.05, 2.42, depth * 0.6 + 0.3});
  }
}

void add_chimney(Model& model, DVec3 foot) {
  const DAffine f = translation(foot);
  add_box(model.flat("wall"), f, {-0.3, -1.2, -0.3}, {0.3, 1.1, 0.3});
  add_box(model.flat("stone"), f, {-0.4, 1.1, -0.4}, {0.4, 1.22, 0.4});
  for (const double x : {-0.15, 0.15}) {
    static constexpr glm::dvec2 kProfile[] = {{0.13, 1.2}, {0.1, 1.6}, {0.13, 1.65}, {0.07, 1.66}};
    add_lathe(model.smooth("pot"), compose(f, translation({x, 0, 0})), kProfile, 8);
  }
}

void add_walls(House& house, const HouseConfig& c, Random& random) {
  Model& model = house.model;
  const double height = c.floors * kFloorHeight, x0 = -c.width / 2, x1 = c.width / 2;
  for (int side = 0; side < 4; ++side) {
    const DAffine frame = side_frame(x0, x1, 0, c.depth, side);
    std::vector<Opening> openings;
    if (side == 0) openings = front_openings(c, random);
    for (const Opening& o : openings) {
      const bool window = o.kind == OpeningKind::kWindow || o.kind == OpeningKind::kShutteredWindow;
      if (window && o.y0 > kFloorHeight) house.sills.emplace_back(x0 + (o.x0 + o.x1) * 0.5, o.y0, 0.0);
    }
    if (side == 1 || side == 3) openings = side_openings(c, random);
    add_facade(model, frame, side % 2 == 0 ? c.width : c.depth, height, openings);
  }
  Mesh& stone = model.flat("stone");
  add_box(stone, kHere, {x0 - 0.08, -kPlinthDepth, c.arcade ? 0.0 : -0.08}, {x1 + 0.08, 0.0, c.depth + 0.08});
  if (!c.arcade) { // stone skirting along both side walls
    add_box(stone, kHere, {x0 - 0.06, 0.0, 0.02}, {x0 + 0.02, 0.5, c.depth});
    add_box(stone, kHere, {x1 - 0.02, 0.0, 0.02}, {x1 + 0.06, 0.5, c.depth});
  }
  for (const double x : {x0 - 0.05, x1 - 0.3}) { // corner stones, long and short
    for (uint32_t i = 0; i < c.floors * 6; ++i) {
      const double w = i % 2 == 0 ? 0.35 : 0.22, y = i * kFloorHeight / 6.0;
      const double left = x < 0 ? x : x + 0.35 - w;
      add_box(stone, kHere, {left, y + 0.02, -0.05}, {left + w, y + kFloorHeight / 6.0 - 0.02, 0.03});
    }
  }
  if (c.floors > 1)
    add_box(stone, kHere, {x0 - 0.05, kFloorHeight - 0.08, -0.06}, {x1 + 0.05, kFloorHeight + 0.06, 0.02});
}

} // namespace

House make_house(const HouseConfig& c, Random& random) {
  House house;
  Model& model = house.model;
  add_walls(house, c, random);
  if (c.arcade) add_arcade_room(model, c);
  if (c.balcony) add_balcony(model, c);
  const double top = c.floors * kFloorHeight;
  const DAffine roof = translation({-c.width / 2, top, 0});
  const double pitch = radians(random.uniform(24.0, 31.0));
  switch (c.roof) {
  case RoofKind::kGable:
    add_gable(model, roof, c.width, c.depth, pitch, random);
    break;
  case RoofKind::kGableToFront:
    add_gable(model, compose(translation({-c.width / 2, top, c.depth}), rotation_y(kPi / 2)), c.depth, c.width, pitch,
              random);
    break;
  case RoofKind::kHip:
    add_hip(model, roof, c.width, c.depth, pitch, random);
    break;
  case RoofKind::kTerrace:
    add_terrace(model, roof, c.width, c.depth);
    break;
  }
  const double side = random.chance(0.5) ? 1.0 : -1.0;
  add_chimney(model, {side * c.width * 0.28, top + 1.15, c.depth * 0.62});
  model.finish();
  return house;
}

Model make_church(Random& random) {
  Model model;
  const double width = 9.0, depth = 17.0, height = 8.5;
  const Opening front[] = {{OpeningKind::kArch, 3.6, 0.0, 5.4, 3.6, false},
                           {OpeningKind::kRecess, 4.0, 5.0, 5.0, 6.6, false}};
  std::vector<Opening> nave;
  for (int i = 0; i < 4; ++i) nave.push_back({OpeningKind::kRecess, 2.2 + 3.8 * i, 3.2, 3.2 + 3.8 * i, 6.6, false});
  for (int side = 0; side < 4; ++side) {
    const std::span<const Opening> holes = side == 0   ? std::span<const Opening>(front)
                                           : side == 2 ? std::span<const Opening>()
                                                       : std::span<const Opening>(nave);
    add_facade(model, side_frame(-width / 2, width / 2, 0, depth, side), side % 2 == 0 ? width : depth, height, holes);
  }
  add_box(model.flat("door"), kHere, {-0.95, 0, 0.35}, {0.95, 3.6, 0.45});
  add_box(model.flat("stone"), kHere, {-width / 2 - 0.2, -4.0, -0.2}, {width / 2 + 0.2, 0.0, depth + 0.2});
  for (int i = 0; i < 5; ++i) {
    for (const double x : {-width / 2 - 0.5, width / 2}) {
      add_tapered_box(model.flat("stone"), kHere, {x, -1.0, 0.3 + 3.9 * i}, {x + 0.5, 7.0, 1.1 + 3.9 * i}, 0.8);
    }
  }
  add_gable(model, compose(translation({-width / 2, height, depth}), rotation_y(kPi / 2)), depth, width, radians(34),
            random);

  const double x0 = width / 2 - 0.2, x1 = x0 + 4.6, z0 = 0.6, z1 = z0 + 4.6; // the bell tower
  const Opening low[] = {{OpeningKind::kWindow, 1.8, 7.0, 2.8, 9.2, false}};
  const Opening bells[] = {{OpeningKind::kArch, 0.7, 0.9, 2.0, 3.6, false},
                           {OpeningKind::kArch, 2.6, 0.9, 3.9, 3.6, false}};
  for (int side = 0; side < 4; ++side) {
    const DAffine frame = side_frame(x0, x1, z0, z1, side);
    add_facade(model, frame, 4.6, 14.5, low);
    add_facade(model, compose(translation({0, 14.5, 0}), frame), 4.6, 4.6, bells);
  }
  const DAffine tower = translation({x0, 0, z0});
  Mesh& stone = model.flat("stone");
  add_box(stone, tower, {-0.1, -4.0, -0.1}, {4.7, 0.4, 4.7});
  add_box(stone, tower, {-0.22, 14.3, -0.22}, {4.82, 14.6, 4.82});
  add_box(stone, tower, {-0.3, 19.0, -0.3}, {4.9, 19.3, 4.9});
  add_box(model.flat("wood"), tower, {0.3, 15.0, 0.3}, {4.3, 15.1, 4.3});
  static constexpr glm::dvec2 kBell[] = {{0.75, 15.9}, {0.6, 16.2}, {0.5, 17.0}, {0.3, 17.4}, {0.0, 17.5}};
  add_lathe(model.smooth("brass"), compose(tower, translation({2.3, 0, 2.3})), kBell, 14);
  add_hip(model, compose(tower, translation({0, 19.3, 0})), 4.6, 4.6, radians(48), random);
  add_box(model.flat("iron"), tower, {2.24, 21.7, 2.24}, {2.36, 23.8, 2.36});
  add_box(model.flat("iron"), tower, {1.85, 22.9, 2.26}, {2.75, 23.05, 2.34});
  model.finish();
  return model;
}

Model make_lighthouse(Random& random) {
  Model model;
  for (int band = 0; band < 5; ++band) {
    const double y0 = 2.4 * band, y1 = y0 + 2.4;
    const glm::dvec2 profile[] = {{2.2 - 0.07 * y0, y0}, {2.2 - 0.07 * y1, y1}};
    add_lathe(model.smooth(band % 2 == 0 ? "white" : "red"), kHere, profile, 24);
  }
  static constexpr glm::dvec2 kGallery[] = {{1.3, 11.7}, {1.9, 12.1}, {1.9, 12.3}, {0.0, 12.3}};
  static constexpr glm::dvec2 kBase[] = {{3.2, -2.0}, {3.0, 0.5}, {2.2, 0.6}};
  static constexpr glm::dvec2 kLamp[] = {{1.0, 12.3}, {1.0, 14.2}};
  static constexpr glm::dvec2 kCap[] = {{1.35, 14.1}, {1.1, 14.7}, {0.5, 15.3}, {0.12, 15.5}, {0.1, 16.4}, {0.0, 16.5}};
  add_lathe(model.flat("stone"), kHere, kBase, 24);
  add_lathe(model.flat("white"), kHere, kGallery, 24);
  add_lathe(model.smooth("lamp"), kHere, kLamp, 16);
  add_lathe(model.flat("red"), kHere, kCap, 16);
  for (int i = 0; i < 16; ++i) {
    const DAffine turn = rotation_y(2 * kPi * i / 16.0);
    add_railing(model, "iron", compose(turn, translation({-0.35, 12.3, -1.8})), 0.7, 0.9, 0.35);
    if (i % 2 == 0) add_box(model.flat("iron"), turn, {-0.04, 12.3, -1.06}, {0.04, 14.2, -0.98});
  }
  for (int i = 0; i < 4; ++i) {
    const double y = 2.0 + 2.5 * i, turn = random.uniform(-0.4, 0.4);
    const double z = -(2.2 - 0.07 * y) - 0.02;
    add_box(model.flat("glass"), rotation_y(turn), {-0.3, y, z}, {0.3, y + 0.9, z + 0.4});
    add_box(model.flat("stone"), rotation_y(turn), {-0.42, y - 0.15, z - 0.08}, {0.42, y, z + 0.4});
  }
  model.finish();
  return model;
}

namespace {

void add_windmill_tower(Model& model) {
  static constexpr glm::dvec2 kTower[] = {{2.7, -1.5}, {2.5, 0.0}, {2.1, 6.4}};
  static constexpr glm::dvec2 kCap[] = {{2.45, 6.3}, {2.2, 6.8}, {1.4, 8.0}, {0.0, 8.9}};
  add_lathe(model.smooth("wall"), kHere, kTower, 24);
  add_lathe(model.flat("wood"), kHere, kCap, 18);
  add_rod(model.smooth("wood"), {0, 6.9, 0}, {0, 6.9, -3.2}, 0.14, 8);
  add_box(model.flat("door"), kHere, {-0.5, 0, -2.62}, {0.5, 2.0, -2.0});
  add_box(model.flat("glass"), kHere, {-0.3, 3.4, -2.4}, {0.3, 4.3, -2.0});
}

void add_windmill_sails(Model& model, DVec3 axle, double phase_rad) {
  for (int sail = 0; sail < 8; ++sail) {
    const DAffine f = compose(translation(axle), rotation_z(phase_rad + kPi / 4 * sail));
    add_box(model.flat("wood"), f, {-0.05, 0.0, -0.05}, {0.05, 4.6, 0.05});
    add_triangle(model.flat("white"), transform_point(f, {0.07, 1.2, 0.0}), transform_point(f, {0.07, 4.5, 0.0}),
                 transform_point(f, {1.5, 2.6, -0.35}));
  }
}

} // namespace

Model make_windmill(Random& random) {
  Model model;
  add_windmill_tower(model);
  add_windmill_sails(model, kSailAxle, random.uniform(0.2, 0.5));
  model.finish();
  return model;
}

Model make_windmill_tower() {
  Model model;
  add_windmill_tower(model);
  model.finish();
  return model;
}

Model make_windmill_sails() {
  Model model;
  add_windmill_sails(model, DVec3(0.0), 0.0);
  return model;
}

} // namespace packtrace::scenegen
