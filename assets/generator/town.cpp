#include "assets/generator/town.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "assets/generator/masonry.h"
#include "assets/generator/noise.h"
#include "assets/generator/placement.h"
#include "assets/generator/town_builder.h"
#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

constexpr const char* kTownComment =
    "# A harbour town on a terraced hillside: houses, stairs, boats and trees, all instances of small PLY meshes.\n"
    "# To be seen: detail at every scale under ambient light: eaves, shutters, arches, foliage, crates on the pier.\n"
    "# Made by packtrace_scenegen town; pbrt-v3 renders it as it stands.\n\n";

const ViewConfig kView{{-22.0, 6.4, -42.0}, {-12.5, 13.0, 50.0}, 37.0, 1280, 720};

} // namespace

void TownBuilder::build() {
  for (const auto& [name, model] : {std::pair{"ground", terrain_.make_ground()}, std::pair{"sea", terrain_.make_sea()},
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
             [&](double angle) { put_any_on(objects_.palms, angle + 0.05, 1.9, 0, random_.uniform(0.0, 6.0), 0.95); });
  along_quay(6.3, 2.6, [&](double angle) {
    const double pick = random_.uniform();
    const double turn = angle + random_.uniform(-0.3, 0.3);
    if (pick < 0.3) {
      put_any_on(objects_.tables, angle, 3.4, 0, turn);
    } else if (pick < 0.5) {
      put_any_on(objects_.stalls, angle, 3.0, 0, turn);
    } else if (pick < 0.72) { // unloaded goods
      put_any_on(objects_.crates, angle, 1.8, 0, turn);
      put_any_on(objects_.crates, angle + 0.026, 1.9, 0, turn + 0.4);
      put_any(objects_.crates, terrain_.place(angle + 0.012, 1.85, 0) + DVec3(0, 0.8, 0), turn + 0.7);
      put_on("barrel", angle - 0.03, 2.0, 0, turn);
      put_on("rope_coil", angle - 0.02, 1.1, 0, turn);
    } else if (pick < 0.86) {
      const double size = random_.uniform(0.85, 1.15);
      put_any_on(objects_.palms, angle, 2.6, 0, random_.uniform(0.0, 6.0), size);
    } else if (pick < 0.93) {
      put_any_on(objects_.racks, angle, 2.4, 0, turn);
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
        put_any(objects_.crates, at + side, turn + random_.uniform(-0.3, 0.3));
        put("barrel", at + side + way * 0.95, turn, 0.9);
        if (random_.chance(0.6)) put_any(objects_.crates, at + side + DVec3(0, 0.8, 0), turn + 0.5, 0.8);
      } else if (pick < 0.7) {
        put("barrel", at + side, turn);
        put("rope_coil", at + side * 0.8 - way * 0.9, turn);
      } else {
        put_any(objects_.racks, at + side, turn + kPi / 2, 0.9);
      }
    }
    if (i % 5 == 3) { // boats moored alongside, mostly on the harbour side
      const DVec3 berth = at + right * (random_.chance(0.75) ? 3.3 : -3.3);
      put_any(objects_.rowing_boats, {berth.x, 0.0, berth.z}, turn + random_.uniform(-0.15, 0.15));
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
    put_any(objects_.shore_rocks, islet + DVec3(s * out, 1.4 - 0.24 * out, c * out), i * 1.3,
            random_.uniform(5.0, 8.0));
  }
  put("lighthouse", islet + DVec3(0, 3.6, 0), radians(10));
  static constexpr double kClouds[][4] = {{-215, 118, 400, 2.0}, {-150, 152, 430, 1.5}, {-250, 168, 440, 1.2},
                                          {15, 150, 420, 2.1},   {60, 132, 440, 1.5},   {215, 158, 430, 1.9},
                                          {-95, 128, 450, 1.3},  {150, 182, 440, 1.4}};
  for (const auto& cloud : kClouds) {
    put_any(objects_.clouds, {cloud[0], cloud[1], cloud[2]}, random_.uniform(-0.4, 0.4), cloud[3]);
  }
  for (int i = 0; i < 18; ++i) {
    const DVec3 at{random_.uniform(-45.0, 35.0), random_.uniform(11.0, 26.0), random_.uniform(0.0, 45.0)};
    put_any(objects_.gulls, at, random_.uniform(0.0, 6.0), 1.2);
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
      put_any(large ? objects_.fishing_boats : objects_.rowing_boats, {at.x, 0.0, at.z}, turn);
    if (large) angle += 1.0 / terrain_.quay_radius(angle);
  }
  static constexpr double kMoored[][3] = {{3, -6, 0.9},  {13, 6, 2.2}, {-4, 14, 0.4},
                                          {22, -3, 1.4}, {8, 18, 2.9}, {-28, 26, 0.7}};
  for (const auto& boat : kMoored) {
    put_any(objects_.rowing_boats, {boat[0], 0, boat[1]}, boat[2]);
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
    put_any(objects_.rocks, at, turn, size * 1.8);
  else if (patch > 0.28)
    put_any(objects_.pines, at, turn, size);
  else if (patch > 0.05)
    put_any(objects_.broadleaves, at, turn, size);
  else if (patch > -0.22)
    put_any(objects_.olives, at, turn, size);
  else
    put_any(objects_.cypresses, at, turn, size);
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
        put_any(objects_.shore_rocks, at, wildness * 6.0, random_.uniform(1.5, 3.5));
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
    put_any(pick < 0.45  ? objects_.tufts
            : pick < 0.9 ? objects_.bushes
                         : objects_.rocks,
            at - DVec3(0, 0.05, 0), turn, size);
  }
}

SceneTotals generate_town(const TownConfig& config, const OutputConfig& output) {
  if (config.instances < 3000 || config.instances > 20'000'000) {
    throw Error(ErrorKind::kUsage, fmt::format("--instances {}: a town takes 3000 to 20000000", config.instances));
  }
  SceneWriter writer(output, "town", kTownComment, kView);
  write_town_materials(writer);
  TownBuilder(config, writer).build();
  return writer.finish();
}

} // namespace packtrace::scenegen
