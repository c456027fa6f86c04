#pragma once

#include <cstdint>

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

inline constexpr double kWallModule = 2.0; ///< metres along x of every wall, railing, fence and quay piece

/// Rubble retaining wall: faces -z at z = 0, x in +-kWallModule/2, from y = 0 up. Materials: "stone", "stone_b",
/// "stone_c".
Model make_stone_wall(double height, Random& random);
/// Large dressed blocks with a coping at y = 0 and a fender pile, down to y = -depth.
Model make_quay_wall(double depth, Random& random);
/// Steps that climb towards +z from y = 0, with side walls. Materials: "stone", "stone_b".
Model make_stairs(uint32_t steps, double rise, double run, double width);
Model make_parapet(Random& random);      ///< 0.9 m of masonry on y = 0
Model make_iron_railing();               ///< 1 m
Model make_wooden_fence(Random& random); ///< 1 m
/// Planks on beams and piles, 4 m x kWallModule, deck at y = 0, piles down to y = -4. Material: "wood", "wood_dark".
Model make_pier(Random& random);
/// Boulder about 1 m across, lower third meant to be buried. Material: as named.
Model make_rock(std::string_view material, Random& random);

} // namespace packtrace::scenegen
