#pragma once

#include <array>
#include <string>
#include <vector>

#include "assets/generator/house.h"
#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

inline constexpr uint32_t kHousePaints = 8; ///< objects per house style: "house_STYLE_PAINT"

struct HouseStyle {
  std::string name;
  HouseConfig config;
  std::vector<DVec3> sills;
};

/// Names of the objects that can be placed in the town; each list holds variants of one kind of object.
struct TownObjects {
  std::vector<HouseStyle> houses;
  std::vector<std::string> walls, quay, parapets, fences, piers, rocks, shore_rocks;
  std::vector<std::string> broadleaves, olives, pines, cypresses, palms, bushes, blossoms, tufts;
  std::vector<std::string> crates, stalls, tables, pots, boxes, laundry, racks, gulls, rowing_boats, fishing_boats,
      clouds;
};

/// Writes the materials of all town models, including those that objects substitute.
void write_town_materials(SceneWriter& writer);

/// Makes and stores all models except the ground. Objects without variants have the names "barrel", "rope_coil",
/// "bollard", "lamp_post", "bench", "buoy", "stairs", "railing", "church", "lighthouse", "windmill", "sailing_boat".
TownObjects write_town_objects(SceneWriter& writer, uint64_t seed);

} // namespace packtrace::scenegen
