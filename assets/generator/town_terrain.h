#pragma once

#include <cstdint>

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

/// The shape of the harbour town's hill: an amphitheatre of terraces around a bay whose middle is the origin. Places
/// are (angle, inland): angle from +z towards +x in radians, metres inland from the quay's edge. Sea level is y = 0.
class TownTerrain {
public:
  static constexpr uint32_t kLevels = 8; ///< level 0 is the quay
  static constexpr double kQuayHeight = 1.3;
  static constexpr double kQuayWidth = 12.0;
  static constexpr double kTerraceWidth = 9.6;
  static constexpr double kRiser = 4.2;
  static constexpr int kSeaShades = 10;

  explicit TownTerrain(uint64_t seed) : seed_(seed) {}

  double quay_radius(double angle_rad) const;
  /// Inland distance where a level begins; level kLevels is where the open hillside does.
  static constexpr double level_begin(uint32_t level) {
    return level == 0 ? 0.0 : kQuayWidth + (level - 1) * kTerraceWidth;
  }
  static constexpr double level_height(uint32_t level) { return kQuayHeight + level * kRiser; }

  /// 1 where the ground is terraced, 0 where it is nature's.
  double built(double angle_rad, double inland) const;
  /// Ground height on a level's side of its retaining wall.
  double height(double angle_rad, double inland, uint32_t level) const;
  /// Ground height with the level found from the place.
  double height(double angle_rad, double inland) const;
  DVec3 place(double angle_rad, double inland) const;
  DVec3 place(double angle_rad, double inland, uint32_t level) const;

  /// Ground mesh. Materials: "grass_a".."grass_c", "rock_a", "rock_b", "paving_a", "paving_b", "sand".
  Model make_ground() const;
  /// Rippled sea around it, shallow to deep: "foam", "water_0", ... below kSeaShades.
  Model make_sea() const;
  /// Two ranges of distant mountains: "mountain_a" (near), "mountain_b".
  Model make_mountains() const;

private:
  double nature(double angle_rad, double inland) const;
  double land(double angle_rad, double inland) const;
  uint64_t seed_;
};

} // namespace packtrace::scenegen
