#pragma once

#include <cstdint>
#include <vector>

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

enum class RoofKind : uint32_t { kGable, kGableToFront, kHip, kTerrace };

/// Style of a house. Sizes in metres.
struct HouseConfig {
  double width = 6.0; ///< along the street
  double depth = 6.0;
  uint32_t floors = 2;
  uint32_t columns = 3; ///< of windows per floor
  RoofKind roof = RoofKind::kGable;
  bool balcony = false; ///< on the top floor
  bool arcade = false;  ///< arches on the ground floor
  bool shutters = true;
};

inline constexpr double kFloorHeight = 2.9;
inline constexpr double kPlinthDepth = 2.0; ///< depth of the foundations below y = 0

/// A house with its door towards -z, centred on x = 0, from z = 0 back to z = depth. Materials: those of add_facade()
/// and add_tiles(), "wood" and "pot".
/// add_tiles(), "wood" and "pot".
struct House {
  Model model;
  std::vector<DVec3> sills; ///< centres of the street-side window sills above the ground floor, for flower boxes
};
House make_house(const HouseConfig& config, Random& random);

Model make_church(Random& random);     ///< nave and bell tower, about 24 m tall, 11 m x 20 m
Model make_lighthouse(Random& random); ///< about 17 m
Model make_windmill(Random& random);   ///< about 10 m, sails towards -z
Model make_windmill_tower();           ///< without sails
Model make_windmill_sails();           ///< turn about the z axis through kSailAxle of the tower; 8 alike
inline constexpr DVec3 kSailAxle{0.0, 6.9, -3.0};

} // namespace packtrace::scenegen
