#pragma once

#include <cstdint>

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

/// Shape of the harbour town's hill: an amphitheatre of terraces around a bay centred on the origin. Positions are
/// (angle, inland): the angle from +z towards +x in radians, and metres inland from the quay's edge. Sea level is y =
/// 0.
class TownTerrain {
public:
  static constexpr uint32_t kLevels = 8; ///< level 0 is the quay
  static constexpr double kQuayHeight = 1.3;
  static constexpr double kQuayWidth = 12.0;
  static constexpr double kTerraceWidth = 9.6;
  static constexpr double kRiser = 4.2;
  static constexpr int kSeaShades = 10;

  explicit TownTerrain(uint64_t seed) : seed_(seed) {}

  /// Distance of the quay's edge from the origin, in metres.
  double quay_radius(double angle_rad) const;
  /// Inland distance at which a level begins; level kLevels is the open hillside.
  static constexpr double level_begin(uint32_t level) {
    return level == 0 ? 0.0 : kQuayWidth + (level - 1) * kTerraceWidth;
  }
  static constexpr double level_height(uint32_t level) { return kQuayHeight + level * kRiser; }

  /// 1 where the ground is terraced, 0 where it is natural, and between in transitions.
  double built(double angle_rad, double inland) const;
  /// Ground height at a position, taken as part of the given level (its side of the retaining wall).
  double height(double angle_rad, double inland, uint32_t level) const;
  /// Ground height at a position; the level follows from the position.
  double height(double angle_rad, double inland) const;
  /// World position on the ground.
  DVec3 place(double angle_rad, double inland) const;
  /// World position on the ground of the given level.
  DVec3 place(double angle_rad, double inland, uint32_t level) const;

  /// Ground mesh. Materials: "grass_a".."grass_c", "rock_a", "rock_b", "paving_a", "paving_b", "sand".
  Model make_ground() const;
  /// Rippled sea around the ground, from shallow to deep. Materials: "foam", and "water_N" for N in [0, kSeaShades).
  Model make_sea() const;
  /// Two ranges of distant mountains: "mountain_a" (near), "mountain_b".
  Model make_mountains() const;

private:
  double nature(double angle_rad, double inland) const;
  double land(double angle_rad, double inland) const;
  uint64_t seed_;
};

} // namespace packtrace::scenegen
