#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "assets/generator/placement.h"
#include "assets/generator/random.h"
#include "assets/generator/town.h"
#include "assets/generator/town_objects.h"
#include "assets/generator/town_terrain.h"

namespace packtrace::scenegen {

inline constexpr double kFirstAngle = radians(-22), kLastAngle = radians(90);
inline constexpr double kStairSpacing = 30.0; ///< metres of street between two flights of stairs

/// Lays out the town street by street and writes every placement.
class TownBuilder {
public:
  TownBuilder(const TownConfig& config, SceneWriter& writer)
      : config_(config), writer_(writer), terrain_(config.seed), objects_(write_town_objects(writer, config.seed)) {}

  void build();

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
  /// The same with one of several objects. It is drawn after the arguments were evaluated, so a call that draws one of
  /// them has one order with every compiler.
  void put_any(const std::vector<std::string>& objects, DVec3 at, double turn, double scale = 1.0) {
    put(any(objects), at, turn, scale);
  }
  void put_any_on(const std::vector<std::string>& objects, double angle, double inland, uint32_t level, double turn,
                  double scale = 1.0) {
    put_on(any(objects), angle, inland, level, turn, scale);
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

} // namespace packtrace::scenegen
