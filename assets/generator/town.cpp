#include "assets/generator/town.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "assets/generator/masonry.h"
#include "assets/generator/noise.h"
#include "assets/generator/placement.h"
#include "assets/generator/town_objects.h"
#include "assets/generator/town_terrain.h"
#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

constexpr const char* kComment =
    "# A harbour town on a terraced hillside: houses, stairs, boats and trees, all instances of small PLY meshes.\n"
    "# To be seen: detail at every scale under ambient light: eaves, shutters, arches, foliage, crates on the pier.\n"
    "# Made by packtrace_scenegen town; pbrt-v3 renders it as it stands.\n\n";

constexpr double kFirstAngle = radians(-22), kLastAngle = radians(90);
constexpr double kStairSpacing = 30.0; ///< metres of street between two flights of stairs

const ViewConfig kView{{-22.0, 6.4, -42.0}, {-12.5, 13.0, 50.0}, 37.0, 1280, 720};

/// Lays out the town street by street and writes every placement.
class TownBuilder {
public:
  TownBuilder(const TownConfig& config, SceneWriter& writer)
      : config_(config), writer_(writer), terrain_(config.seed), objects_(write_town_objects(writer, config.seed)) {}

  void build() {
    for (const auto& [name, model] :
         {std::pair{"ground", terrain_.make_ground()}, std::pair{"sea", terrain_.make_sea()},
          std::pair{"mountains", terrain_.make_mountains()}}) {
      writer_.model(name, model);
      writer_.world_shape(name);
    }
    for (uint32_t level = 0; level < TownTerrain::kLevels; ++level) build_street(level);
    build_edges();
    build_quay();
    build_pier();
    build_landmarks();
    build_boats();
    build_hillside();
  }

private:
  const std::string& any(const std::vector<std::string>& list) {
    return list[random_.below(static_cast<uint32_t>(list.size()))];
  }

  void put(std::string_view object, DVec3 at, double turn, double scale = 1.0) {
    writer_.instance(object, stand_at(at, turn, scale));
    ++placed_;
  }
  /// Places an object on the ground of a level.
  void put_on(std::string_view object, double angle, double inland, uint32_t level, double turn, double scale = 1.0) {
    put(object, terrain_.place(angle, inland, level), turn, scale);
  }
  bool terraced(double angle, double inland) const { return terrain_.built(angle, inland) > 0.97; }

  /// Whether a flight of stairs from a level's street to the next level is within `margin` metres along the street.
  bool near_stairs(uint32_t level, double angle, double margin) const {
    const double radius = terrain_.quay_radius(angle) + TownTerrain::level_begin(level + 1);
    const double along_street = (angle - kFirstAngle) * radius + level * 11.0;
    const double offset = along_street - std::floor(along_street / kStairSpacing + 0.5) * kStairSpacing;
    return std::abs(offset) < margin;
  }

  void build_street(uint32_t level);
  double build_house(uint32_t level, double angle);
  void build_garden(uint32_t level, double angle);
  void decorate(const HouseStyle& style, const DAffine& frame);
  void build_edges();
  void build_stairs(uint32_t level);
  void build_quay();
  void build_pier();
  void build_landmarks();
  void build_boats();
  void build_hillside();
  void put_plant(DVec3 at, double wildness);

  TownConfig config_;
  SceneWriter& writer_;
  TownTerrain terrain_;
  TownObjects objects_;
  Random random_{config_.seed, 100};
  uint32_t placed_ = 0;
  uint32_t last_paint_ = 0, last_style_ = 0;
};

void TownBuilder::build_street(uint32_t level) {
  build_stairs(level);
  const double back = TownTerrain::level_begin(level + 1);
  double angle = kFirstAngle - radians(5.0) + radians(random_.uniform(0.0, 4.0));
  while (angle < kLastAngle) {
    const double radius = terrain_.quay_radius(angle) + back - 6.0;
    const double ahead = angle + 4.0 / radius;
    const bool room = terraced(angle, back - 2.0) && terraced(ahead, back - 2.0);
    const double wild = 0.06 + 0.045 * level;
    if (!room) { // too narrow for houses: gardens at the ends of the terrace
      if (terrain_.built(angle, back - 3.0) > 0.6) build_garden(level, angle);
      angle += 3.0 / radius;
    } else if (level + 1 < TownTerrain::kLevels && near_stairs(level, ahead, 5.5)) {
      angle += 1.0 / radius;
    } else if (random_.chance(wild)) {
      build_garden(level, angle + 1.8 / radius);
      angle += 4.2 / radius;
    } else {
      angle += (build_house(level, angle) + random_.uniform(0.7, 1.3)) / radius;
    }
  }
}

/// Builds a house whose left wall is at `angle` and returns its width.
double TownBuilder::build_house(uint32_t level, double angle) {
  uint32_t style_index = random_.below(static_cast<uint32_t>(objects_.houses.size()));
  if (style_index == last_style_) style_index = (style_index + 1) % static_cast<uint32_t>(objects_.houses.size());
  if (level == 0 && random_.chance(0.5)) style_index = random_.chance(0.6) ? 3 : 7; // arcades line the quay
  uint32_t paint = random_.below(kHousePaints);
  if (paint == last_paint_) paint = (paint + 1) % kHousePaints;
  last_style_ = style_index, last_paint_ = paint;
  const HouseStyle& style = objects_.houses[style_index];
  const double back = TownTerrain::level_begin(level + 1), inland = back - style.config.depth - 0.2;
  const double middle = angle + style.config.width * 0.5 / (terrain_.quay_radius(angle) + inland);
  const DAffine frame = stand_at(terrain_.place(middle, inland, level), middle);
  writer_.instance(fmt::format("{}_{}", style.name, paint), frame);
  ++placed_;
  decorate(style, frame);
  return style.config.width;
}

/// Adds flowers at the windows, pots and barrels by the door, and sometimes a washing line.
void TownBuilder::decorate(const HouseStyle& style, const DAffine& frame) {
  const auto add = [&](std::string_view object, DVec3 at, double turn, double scale) {
    writer_.instance(object, compose(frame, stand_at(at, turn, scale)));
    ++placed_;
  };
  for (const DVec3& sill : style.sills) {
    if (random_.chance(0.3)) add(any(objects_.boxes), sill, 0.0, 1.0);
  }
  const double half = style.config.width / 2;
  for (const double side : {-1.0, 1.0}) {
    if (style.config.arcade || !random_.chance(0.55)) continue;
    const DVec3 corner{side * (half - 0.4), 0.0, -0.45};
    if (random_.chance(0.65))
      add(any(objects_.pots), corner, random_.uniform(0.0, 6.0), 1.0);
    else if (random_.chance(0.5))
      add("barrel", corner, 0.0, 0.85);
    else
      add(any(objects_.blossoms), corner + DVec3(0, 0, 0.2), 0.0, 1.1);
  }
  if (style.config.floors > 1 && !style.config.balcony && random_.chance(0.22)) {
    add(any(objects_.laundry), {-half + 0.5, kFloorHeight * 2.0 - 0.35, -0.45}, 0.0, (style.config.width - 1.0) / 4.0);
  }
}

void TownBuilder::build_garden(uint32_t level, double angle) {
  const double back = TownTerrain::level_begin(level + 1), radius = terrain_.quay_radius(angle) + back;
  const auto& tree = random_.chance(0.4)   ? objects_.cypresses
                     : random_.chance(0.5) ? objects_.broadleaves
                                           : objects_.olives;
  const double size = random_.uniform(0.75, 1.0);
  put_on(any(tree), angle, back - 2.4, level, random_.uniform(0.0, 6.0), size);
  for (int i = 0; i < 4; ++i) {
    const double inland = back - random_.uniform(0.8, 4.5);
    const double beside = angle + random_.uniform(-1.5, 1.5) / radius;
    put_on(any(random_.chance(0.4) ? objects_.blossoms : objects_.bushes), beside, inland, level,
           random_.uniform(0.0, 6.0));
  }
}

void TownBuilder::build_stairs(uint32_t level) {
  if (level + 1 >= TownTerrain::kLevels) return;
  const double top = TownTerrain::level_begin(level + 1);
  const auto last = static_cast<int>((kLastAngle - kFirstAngle) * 120.0 / kStairSpacing) + 1;
  for (int i = 0; i <= last; ++i) {
    // Finds the angle at which near_stairs() measures no offset, by fixed-point iteration, as the radius depends on it.
    double angle = 0.0;
    for (int step = 0; step < 12; ++step) {
      angle = kFirstAngle + (kStairSpacing * i - level * 11.0) / (terrain_.quay_radius(angle) + top);
    }
    if (angle < kFirstAngle || angle > kLastAngle || !terraced(angle, top)) continue;
    const double run = 21 * 0.27;
    const double radius = terrain_.quay_radius(angle);
    const auto [s, c] = sin_cos(angle);
    const DVec3 foot((radius + top - run) * s, TownTerrain::level_height(level), (radius + top - run) * c);
    put("stairs", foot, angle);
    for (const double side : {-1.6, 1.6}) {
      if (random_.chance(0.7))
        put(any(objects_.pots), foot + DVec3(c * side, 0.0, -s * side), random_.uniform(0.0, 6.0));
    }
  }
}

/// Builds retaining walls under every terrace, and a parapet, railing or fence along its edge.
void TownBuilder::build_edges() {
  for (uint32_t level = 0; level <= TownTerrain::kLevels; ++level) {
    const double edge = TownTerrain::level_begin(level);
    double angle = kFirstAngle - radians(5);
    for (uint32_t piece = 0; angle < kLastAngle + radians(5); ++piece) {
      const double radius = terrain_.quay_radius(angle) + edge, step = kWallModule / radius;
      const double middle = angle + step / 2;
      angle += step;
      if (terrain_.built(middle, edge) < 0.9) continue;
      const auto [s, c] = sin_cos(middle);
      const double r = terrain_.quay_radius(middle) + edge;
      // The edge is not exactly a circle, so each piece is turned along it (small angles).
      const double slope =
          (terrain_.quay_radius(middle + step / 2) - terrain_.quay_radius(middle - step / 2)) / kWallModule;
      const double turn = middle - slope;
      const DVec3 top(r * s, TownTerrain::level_height(level), r * c);
      if (level == 0) {
        put(any(objects_.quay), top, turn);
        continue;
      }
      put(any(objects_.walls), top - DVec3(0, TownTerrain::kRiser, 0), turn);
      if (near_stairs(level - 1, middle, 2.3) || level == TownTerrain::kLevels) continue;
      const DVec3 inside = top + DVec3(s, 0, c) * 0.12;
      const uint64_t run = hash_bits(config_.seed + level * 1000 + piece / 4) % 5;
      if (run < 2 && level < 6)
        put("railing", inside, turn);
      else if (run < 2)
        put(any(objects_.fences), inside, turn);
      else if (run < 4)
        put(any(objects_.parapets), inside, turn);
      else
        put(any(objects_.pots), inside + DVec3(s, 0, c) * 0.3, random_.uniform(0.0, 6.0), 1.1);
    }
  }
}

void TownBuilder::build_quay() {
  const auto along_quay = [&](double spacing, double inland, const auto& place) {
    for (double angle = kFirstAngle + 0.05; angle < kLastAngle;
         angle += spacing / (terrain_.quay_radius(angle) + inland)) {
      if (terraced(angle, inland)) place(angle);
    }
  };
  along_quay(9.0, 1.2, [&](double angle) { put_on("lamp_post", angle, 1.2, 0, angle); });
  along_quay(5.0, 0.55, [&](double angle) { put_on("bollard", angle, 0.55, 0, angle); });
  along_quay(17.0, 1.9,
             [&](double angle) { put_on(any(objects_.palms), angle + 0.05, 1.9, 0, random_.uniform(0.0, 6.0), 0.95); });
  along_quay(6.3, 2.6, [&](double angle) {
    const double pick = random_.uniform();
    const double turn = angle + random_.uniform(-0.3, 0.3);
    if (pick < 0.3) {
      put_on(any(objects_.tables), angle, 3.4, 0, turn);
    } else if (pick < 0.5) {
      put_on(any(objects_.stalls), angle, 3.0, 0, turn);
    } else if (pick < 0.72) { // unloaded goods
      put_on(any(objects_.crates), angle, 1.8, 0, turn);
      put_on(any(objects_.crates), angle + 0.026, 1.9, 0, turn + 0.4);
      put(any(objects_.crates), terrain_.place(angle + 0.012, 1.85, 0) + DVec3(0, 0.8, 0), turn + 0.7);
      put_on("barrel", angle - 0.03, 2.0, 0, turn);
      put_on("rope_coil", angle - 0.02, 1.1, 0, turn);
    } else if (pick < 0.86) {
      put_on(any(objects_.palms), angle, 2.6, 0, random_.uniform(0.0, 6.0), random_.uniform(0.85, 1.15));
    } else if (pick < 0.93) {
      put_on(any(objects_.racks), angle, 2.4, 0, turn);
    } else {
      put_on("bench", angle, 2.2, 0, angle);
    }
  });
}

void TownBuilder::build_pier() {
  const DVec3 from(-33.0, TownTerrain::kQuayHeight, -44.0);
  const double landing = radians(-9);
  const auto [ls, lc] = sin_cos(landing);
  const DVec3 to = DVec3(ls, 0, lc) * (terrain_.quay_radius(landing) + 0.5) + DVec3(0, TownTerrain::kQuayHeight, 0);
  const DVec3 way = glm::normalize(to - from), right(way.z, 0, -way.x);
  const double turn = radians(21.0); // relative to the pier's direction; objects on a pier are never quite straight
  const auto pieces = static_cast<uint32_t>(glm::length(to - from) / kWallModule);
  const DAffine heading(right, DVec3(0, 1, 0), way, DVec3(0.0));
  for (uint32_t i = 0; i < pieces; ++i) {
    const DVec3 at = from + way * (i * kWallModule);
    writer_.instance(any(objects_.piers), compose(translation(at), heading));
    ++placed_;
    if (i % 6 == 2) put("lamp_post", at + right * (i % 12 == 2 ? -1.75 : 1.75), turn);
    if (i % 4 == 1) put("bollard", at + right * 1.7, turn, 0.8);
    if (i % 3 == 0 && random_.chance(0.75)) {
      const DVec3 side = right * (random_.chance(0.5) ? 1.25 : -1.25);
      const double pick = random_.uniform();
      if (pick < 0.45) {
        put(any(objects_.crates), at + side, turn + random_.uniform(-0.3, 0.3));
        put("barrel", at + side + way * 0.95, turn, 0.9);
        if (random_.chance(0.6)) put(any(objects_.crates), at + side + DVec3(0, 0.8, 0), turn + 0.5, 0.8);
      } else if (pick < 0.7) {
        put("barrel", at + side, turn);
        put("rope_coil", at + side * 0.8 - way * 0.9, turn);
      } else {
        put(any(objects_.racks), at + side, turn + kPi / 2, 0.9);
      }
    }
    if (i % 5 == 3) { // boats moored alongside, mostly on the harbour side
      const DVec3 berth = at + right * (random_.chance(0.75) ? 3.3 : -3.3);
      put(any(objects_.rowing_boats), {berth.x, 0.0, berth.z}, turn + random_.uniform(-0.15, 0.15));
    }
  }
}

void TownBuilder::build_landmarks() {
  const uint32_t top = TownTerrain::kLevels;
  const double church = radians(9);
  put("church", terrain_.place(church, TownTerrain::level_begin(top) + 3.0, top) + DVec3(0, 0.6, 0), church);
  const double mill = radians(-13);
  put("windmill", terrain_.place(mill, 128.0) - DVec3(0, 0.4, 0), mill - 0.3, 1.3);
  const DVec3 islet(-74.0, 0.0, 92.0); // the lighthouse stands on a heap of boulders
  for (int i = 0; i < 26; ++i) {
    const auto [s, c] = sin_cos(i * 2.4);
    const double out = 1.7 * std::sqrt(static_cast<double>(i));
    put(any(objects_.shore_rocks), islet + DVec3(s * out, 1.4 - 0.24 * out, c * out), i * 1.3,
        random_.uniform(5.0, 8.0));
  }
  put("lighthouse", islet + DVec3(0, 3.6, 0), radians(10));
  static constexpr double kClouds[][4] = {{-215, 118, 400, 2.0}, {-150, 152, 430, 1.5}, {-250, 168, 440, 1.2},
                                          {15, 150, 420, 2.1},   {60, 132, 440, 1.5},   {215, 158, 430, 1.9},
                                          {-95, 128, 450, 1.3},  {150, 182, 440, 1.4}};
  for (const auto& cloud : kClouds) {
    put(any(objects_.clouds), {cloud[0], cloud[1], cloud[2]}, random_.uniform(-0.4, 0.4), cloud[3]);
  }
  for (int i = 0; i < 18; ++i) {
    const DVec3 at{random_.uniform(-45.0, 35.0), random_.uniform(11.0, 26.0), random_.uniform(0.0, 45.0)};
    put(any(objects_.gulls), at, random_.uniform(0.0, 6.0), 1.2);
  }
}

void TownBuilder::build_boats() {
  for (double angle = kFirstAngle + 0.06; angle < kLastAngle;
       angle += 5.2 / terrain_.quay_radius(angle)) { // at the quay
    const bool large = random_.chance(0.35);
    const double out = large ? -3.2 : -2.2;
    const DVec3 at = terrain_.place(angle, out - (large ? 2.8 : 1.0), 0);
    const double turn = angle + kPi * (random_.chance(0.7) ? 1.0 : 0.0) + random_.uniform(-0.12, 0.12);
    if (terrain_.built(angle, 1.0) > 0.9)
      put(any(large ? objects_.fishing_boats : objects_.rowing_boats), {at.x, 0.0, at.z}, turn);
    if (large) angle += 1.0 / terrain_.quay_radius(angle);
  }
  static constexpr double kMoored[][3] = {{3, -6, 0.9},  {13, 6, 2.2}, {-4, 14, 0.4},
                                          {22, -3, 1.4}, {8, 18, 2.9}, {-28, 26, 0.7}};
  for (const auto& boat : kMoored) {
    put(any(objects_.rowing_boats), {boat[0], 0, boat[1]}, boat[2]);
    put("buoy", DVec3(boat[0] + 3.0, 0, boat[1] + 1.0), boat[2]);
  }
  put(objects_.fishing_boats[1], {-3.5, 0, -9.0}, radians(-28));
  put(objects_.fishing_boats[2], {16.0, 0, 12.0}, radians(75));
  put("sailing_boat", {-46.0, 0, 62.0}, radians(64));
  put("sailing_boat", {-110.0, 0, 190.0}, radians(-70), 1.2);
  put("sailing_boat", {27.0, 0, 8.0}, radians(20), 0.9);
}

void TownBuilder::put_plant(DVec3 at, double wildness) {
  const double turn = random_.uniform(0.0, 2.0 * kPi), size = random_.uniform(0.7, 1.2);
  const double patch = fractal_noise(at * 0.045, config_.seed + 60, 2);
  if (wildness > 0.75)
    put(any(objects_.rocks), at, turn, size * 1.8);
  else if (patch > 0.28)
    put(any(objects_.pines), at, turn, size);
  else if (patch > 0.05)
    put(any(objects_.broadleaves), at, turn, size);
  else if (patch > -0.22)
    put(any(objects_.olives), at, turn, size);
  else
    put(any(objects_.cypresses), at, turn, size);
}

/// Places trees on a coarse jittered grid, then undergrowth until the total number of instances is reached.
void TownBuilder::build_hillside() {
  const double from = radians(-40), to = radians(98), deepest = 205.0;
  const auto open_ground = [&](double angle, double inland, DVec3& at) {
    if (terrain_.built(angle, inland) > 0.02) return false;
    at = terrain_.place(angle, inland);
    return at.y > 0.8;
  };
  for (double inland = 1.0; inland < deepest; inland += 4.4) {
    for (double angle = from; angle < to; angle += 4.4 / (terrain_.quay_radius(angle) + inland)) {
      DVec3 at;
      const double a = angle + random_.uniform(-1.2, 1.2) / (terrain_.quay_radius(angle) + inland);
      const double s = inland + random_.uniform(-1.2, 1.2), wildness = random_.uniform();
      if (!open_ground(a, s, at)) continue;
      const bool shore = at.y < 3.5;
      const double density = 0.5 + 0.45 * fractal_noise(at * 0.05, config_.seed + 61, 3);
      if (shore)
        put(any(objects_.shore_rocks), at, wildness * 6.0, random_.uniform(1.5, 3.5));
      else if (wildness < density)
        put_plant(at - DVec3(0, 0.15, 0), wildness);
    }
  }
  const uint32_t wanted = config_.instances > placed_ ? config_.instances - placed_ : 0;
  uint64_t misses = 0;
  for (uint32_t done = 0; done < wanted && misses < 64ull * wanted + 1000;) {
    const double angle = random_.uniform(from, to);
    const double t = random_.uniform();
    DVec3 at;
    if (!open_ground(angle, 150.0 * t, at) || at.y < 2.0) {
      ++misses;
      continue;
    }
    ++done;
    const double pick = random_.uniform(), turn = random_.uniform(0.0, 2.0 * kPi), size = random_.uniform(0.8, 1.7);
    put(any(pick < 0.45  ? objects_.tufts
            : pick < 0.9 ? objects_.bushes
                         : objects_.rocks),
        at - DVec3(0, 0.05, 0), turn, size);
  }
}

} // namespace

SceneTotals generate_town(const TownConfig& config, const OutputConfig& output) {
  if (config.instances < 3000 || config.instances > 20'000'000) {
    throw Error(ErrorKind::kUsage, fmt::format("--instances {}: a town takes 3000 to 20000000", config.instances));
  }
  SceneWriter writer(output, "town", kComment, kView);
  write_town_materials(writer);
  TownBuilder(config, writer).build();
  return writer.finish();
}

} // namespace packtrace::scenegen
