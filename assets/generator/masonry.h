#pragma once

#include <cstdint>

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

inline constexpr double kWallModule = 2.0; ///< metres along x of each wall, railing, fence and quay piece

/// Rubble retaining wall: faces -z at z = 0, x in +-kWallModule/2, rises from y = 0. Materials: "stone", "stone_b",
/// "stone_c".
Model make_stone_wall(double height, Random& random);
/// Quay wall of large dressed blocks, from a coping at y = 0 down to y = -depth, with a fender pile.
Model make_quay_wall(double depth, Random& random);
/// Steps that climb towards +z from y = 0, with side walls. Materials: "stone", "stone_b".
Model make_stairs(uint32_t steps, double rise, double run, double width);
Model make_parapet(Random& random);      ///< masonry, 0.9 m high, standing on y = 0
Model make_iron_railing();               ///< 1 m high
Model make_wooden_fence(Random& random); ///< 1 m high
/// Planks on beams and piles, 4 m x kWallModule, deck at y = 0, piles down to y = -4. Materials: "wood", "wood_dark".
Model make_pier(Random& random);
/// Boulder about 1 m across; its lower third is meant to be buried.
Model make_rock(std::string_view material, Random& random);

} // namespace packtrace::scenegen
