// The town's terraces: streets, houses, gardens, stairs and the edges of the levels.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "assets/generator/masonry.h"
#include "assets/generator/town_builder.h"

namespace packtrace::scenegen {

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
    if (random_.chance(0.65)) {
      const double turn = random_.uniform(0.0, 6.0);
      add(any(objects_.pots), corner, turn, 1.0);
    } else if (random_.chance(0.5)) {
      add("barrel", corner, 0.0, 0.85);
    } else {
      add(any(objects_.blossoms), corner + DVec3(0, 0, 0.2), 0.0, 1.1);
    }
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
  put_any_on(tree, angle, back - 2.4, level, random_.uniform(0.0, 6.0), size);
  for (int i = 0; i < 4; ++i) {
    const double inland = back - random_.uniform(0.8, 4.5);
    const double beside = angle + random_.uniform(-1.5, 1.5) / radius;
    const double turn = random_.uniform(0.0, 6.0);
    put_any_on(random_.chance(0.4) ? objects_.blossoms : objects_.bushes, beside, inland, level, turn);
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
        put_any(objects_.pots, foot + DVec3(c * side, 0.0, -s * side), random_.uniform(0.0, 6.0));
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
        put_any(objects_.quay, top, turn);
        continue;
      }
      put_any(objects_.walls, top - DVec3(0, TownTerrain::kRiser, 0), turn);
      if (near_stairs(level - 1, middle, 2.3) || level == TownTerrain::kLevels) continue;
      const DVec3 inside = top + DVec3(s, 0, c) * 0.12;
      const uint64_t run = hash_bits(config_.seed + level * 1000 + piece / 4) % 5;
      if (run < 2 && level < 6)
        put("railing", inside, turn);
      else if (run < 2)
        put_any(objects_.fences, inside, turn);
      else if (run < 4)
        put_any(objects_.parapets, inside, turn);
      else
        put_any(objects_.pots, inside + DVec3(s, 0, c) * 0.3, random_.uniform(0.0, 6.0), 1.1);
    }
  }
}

} // namespace packtrace::scenegen
