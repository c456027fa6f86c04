#pragma once

#include <array>
#include <string>
#include <vector>

#include "assets/generator/house.h"
#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

inline constexpr uint32_t kHousePaints = 8; ///< objects of each house style: "house_STYLE_PAINT"

struct HouseStyle {
  std::string name;
  HouseConfig config;
  std::vector<DVec3> sills;
};

/// What can be placed in the town, by object name; each list holds variants of one thing.
struct TownObjects {
  std::vector<HouseStyle> houses;
  std::vector<std::string> walls, quay, parapets, fences, piers, rocks, shore_rocks;
  std::vector<std::string> broadleaves, olives, pines, cypresses, palms, bushes, blossoms, tufts;
  std::vector<std::string> crates, stalls, tables, pots, boxes, laundry, racks, gulls, rowing_boats, fishing_boats,
      clouds;
};

/// Named materials of every town model, and those that objects swap in.
void write_town_materials(SceneWriter& writer);

/// Makes and stores all models but the ground. Single things are objects under the names "barrel", "rope_coil",
/// "bollard", "lamp_post", "bench", "buoy", "stairs", "railing", "church", "lighthouse", "windmill", "sailing_boat".
TownObjects write_town_objects(SceneWriter& writer, uint64_t seed);

} // namespace packtrace::scenegen
