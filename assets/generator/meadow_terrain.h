#pragma once

#include <cstdint>

#include "assets/generator/model.h"

namespace packtrace::scenegen {

/// Ground of the meadow: rolling hills, with a straight lane along +z. Heights in metres, y up.
class MeadowTerrain {
public:
  static constexpr double kCell = 3.0;                 ///< the ground's grid and the patches of grass
  static constexpr int64_t kLaneColumn = 0;            ///< of cells; the lane fills it
  static constexpr double kReach = 330.0;              ///< the ground ends there
  static constexpr double kGrassReach = 290.0;         ///< no grass beyond
  static constexpr DVec3 kMillPlace{13.0, 0.0, 112.0}; ///< y is not used

  explicit MeadowTerrain(uint64_t seed) : seed_(seed) {}

  double height(double x, double z) const;
  DVec3 place(double x, double z) const { return {x, height(x, z), z}; }
  /// Shears an object of a size so that it follows the ground: its plane passes through the ground in the middle of its
  /// edges. Horizontal distances and directions stay.
  /// @param x, z the object's origin, a corner
  DAffine shear_to_ground(double x, double z, double size_x, double size_z, double scale_y) const;

  /// Materials: "turf_near", "turf_a", "turf_b", "lane", "lane_rut", "lane_middle".
  Model make_ground() const;

private:
  uint64_t seed_;
};

} // namespace packtrace::scenegen
