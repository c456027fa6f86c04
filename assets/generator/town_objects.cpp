#include "assets/generator/town_objects.h"

#include <functional>

#include <fmt/format.h>

#include "assets/generator/boats.h"
#include "assets/generator/foliage.h"
#include "assets/generator/masonry.h"
#include "assets/generator/props.h"
#include "assets/generator/town_terrain.h"

namespace packtrace::scenegen {
namespace {

struct Paint {
  const char* name;
  float r, g, b; ///< linear sRGB reflectance
};

constexpr Paint kPaints[] = {
    {"wall", 0.86f, 0.83f, 0.76f},         {"wall_cream", 0.86f, 0.73f, 0.49f},  {"wall_ochre", 0.80f, 0.52f, 0.21f},
    {"wall_rose", 0.82f, 0.46f, 0.36f},    {"wall_coral", 0.74f, 0.29f, 0.18f},  {"wall_sky", 0.46f, 0.63f, 0.73f},
    {"wall_lemon", 0.89f, 0.76f, 0.36f},   {"shutter", 0.05f, 0.21f, 0.42f},     {"shutter_green", 0.05f, 0.24f, 0.13f},
    {"shutter_teal", 0.05f, 0.34f, 0.36f}, {"shutter_red", 0.32f, 0.05f, 0.04f}, {"door", 0.21f, 0.10f, 0.05f},
    {"door_blue", 0.06f, 0.22f, 0.40f},    {"trim", 0.85f, 0.82f, 0.76f},        {"glass", 0.05f, 0.08f, 0.11f},
    {"lamp", 1.0f, 0.78f, 0.36f},          {"tile_a", 0.62f, 0.23f, 0.11f},      {"tile_b", 0.50f, 0.16f, 0.08f},
    {"tile_c", 0.72f, 0.34f, 0.18f},       {"stone", 0.56f, 0.51f, 0.42f},       {"stone_b", 0.46f, 0.42f, 0.35f},
    {"stone_c", 0.36f, 0.33f, 0.28f},      {"wood", 0.43f, 0.27f, 0.15f},        {"wood_dark", 0.21f, 0.14f, 0.09f},
    {"iron", 0.04f, 0.045f, 0.05f},        {"pot", 0.60f, 0.26f, 0.14f},         {"brass", 0.72f, 0.50f, 0.18f},
    {"bark", 0.20f, 0.14f, 0.10f},         {"leaf_light", 0.32f, 0.47f, 0.11f},  {"leaf_dark", 0.11f, 0.23f, 0.06f},
    {"leaf_yellow", 0.56f, 0.52f, 0.12f},  {"cypress", 0.08f, 0.21f, 0.08f},     {"olive", 0.37f, 0.43f, 0.25f},
    {"pine", 0.16f, 0.32f, 0.11f},         {"palm", 0.23f, 0.41f, 0.10f},        {"blossom", 0.82f, 0.13f, 0.40f},
    {"blossom_red", 0.80f, 0.10f, 0.06f},  {"grass_a", 0.23f, 0.35f, 0.10f},     {"grass_b", 0.31f, 0.41f, 0.13f},
    {"grass_c", 0.45f, 0.43f, 0.19f},      {"rock_a", 0.45f, 0.40f, 0.33f},      {"rock_b", 0.35f, 0.31f, 0.27f},
    {"paving_a", 0.60f, 0.54f, 0.45f},     {"paving_b", 0.53f, 0.47f, 0.39f},    {"sand", 0.67f, 0.58f, 0.40f},
    {"foam", 0.72f, 0.87f, 0.84f},         {"mountain_a", 0.38f, 0.50f, 0.58f},  {"mountain_b", 0.56f, 0.67f, 0.78f},
    {"white", 0.88f, 0.87f, 0.84f},        {"red", 0.64f, 0.09f, 0.05f},         {"canvas_a", 0.88f, 0.84f, 0.76f},
    {"canvas_b", 0.68f, 0.11f, 0.08f},     {"canvas_blue", 0.08f, 0.28f, 0.50f}, {"cloth_a", 0.76f, 0.27f, 0.16f},
    {"cloth_b", 0.21f, 0.40f, 0.62f},      {"cloth_c", 0.86f, 0.71f, 0.32f},     {"fruit_a", 0.82f, 0.38f, 0.04f},
    {"fruit_b", 0.66f, 0.07f, 0.05f},      {"fruit_c", 0.42f, 0.56f, 0.08f},     {"hull", 0.84f, 0.82f, 0.76f},
    {"hull_blue", 0.06f, 0.27f, 0.48f},    {"hull_red", 0.62f, 0.09f, 0.06f},    {"hull_green", 0.10f, 0.40f, 0.30f},
    {"hull_low", 0.32f, 0.07f, 0.05f},     {"rope", 0.60f, 0.50f, 0.33f},        {"sail", 0.88f, 0.84f, 0.74f},
    {"cloud", 0.93f, 0.94f, 0.96f}};

constexpr HouseConfig kHouses[] = {{6.4, 5.4, 2, 3, RoofKind::kGable, false, false, true},
                                   {5.4, 5.6, 3, 2, RoofKind::kGableToFront, false, false, true},
                                   {7.6, 5.6, 2, 3, RoofKind::kHip, true, false, true},
                                   {8.4, 5.8, 3, 4, RoofKind::kGable, true, true, true},
                                   {4.8, 5.2, 2, 2, RoofKind::kGable, false, false, false},
                                   {6.6, 5.4, 2, 3, RoofKind::kTerrace, false, false, false},
                                   {6.0, 5.8, 3, 3, RoofKind::kHip, true, false, true},
                                   {9.2, 5.8, 2, 4, RoofKind::kHip, false, true, false},
                                   {5.2, 5.4, 1, 3, RoofKind::kGableToFront, false, false, true}};

const std::array<MaterialChoice, kHousePaints> kHouseColours{
    MaterialChoice{{"shutter", "shutter_teal"}, {"door", "door_blue"}},
    MaterialChoice{{"wall", "wall_cream"}, {"shutter", "shutter_green"}},
    MaterialChoice{{"wall", "wall_ochre"}, {"shutter", "shutter_green"}},
    MaterialChoice{{"wall", "wall_rose"}, {"door", "door_blue"}},
    MaterialChoice{{"wall", "wall_lemon"}, {"shutter", "shutter_teal"}},
    MaterialChoice{{"wall", "wall_coral"}, {"shutter", "shutter_teal"}},
    MaterialChoice{{"shutter", "shutter_red"}},
    MaterialChoice{{"wall", "wall_sky"}, {"shutter", "white"}}};

/// Makes `count` variants, stores each as an object and returns their names.
std::vector<std::string> variants(SceneWriter& writer, const char* name, uint32_t count, Random& random,
                                  const std::function<Model(Random&)>& make) {
  std::vector<std::string> names;
  for (uint32_t i = 0; i < count; ++i) {
    names.push_back(fmt::format("{}_{}", name, i));
    writer.object(names.back(), make(random));
  }
  return names;
}

/// Adds objects that use a stored model with other materials, one per choice; returns their names.
std::vector<std::string> recoloured(SceneWriter& writer, const std::string& model,
                                    std::initializer_list<MaterialChoice> choices) {
  std::vector<std::string> names;
  for (const MaterialChoice& choice : choices) {
    names.push_back(fmt::format("{}_{}", model, static_cast<char>('a' + names.size())));
    writer.object(names.back(), model, choice);
  }
  return names;
}

void append(std::vector<std::string>& list, const std::vector<std::string>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

void write_houses(SceneWriter& writer, TownObjects& objects, Random& random) {
  for (const HouseConfig& config : kHouses) {
    HouseStyle style{fmt::format("house_{}", objects.houses.size()), config, {}};
    House house = make_house(config, random);
    style.sills = std::move(house.sills);
    writer.model(style.name, house.model);
    for (uint32_t i = 0; i < kHousePaints; ++i)
      writer.object(fmt::format("{}_{}", style.name, i), style.name, kHouseColours[i]);
    objects.houses.push_back(std::move(style));
  }
  writer.object("church", make_church(random));
  writer.object("lighthouse", make_lighthouse(random));
  writer.object("windmill", make_windmill(random));
}

void write_masonry(SceneWriter& writer, TownObjects& objects, Random& random) {
  objects.walls =
      variants(writer, "wall", 3, random, [](Random& r) { return make_stone_wall(TownTerrain::kRiser, r); });
  objects.quay = variants(writer, "quay", 2, random, [](Random& r) { return make_quay_wall(3.0, r); });
  objects.parapets = variants(writer, "parapet", 2, random, make_parapet);
  objects.fences = variants(writer, "fence", 2, random, make_wooden_fence);
  objects.piers = variants(writer, "pier", 3, random, make_pier);
  objects.rocks = variants(writer, "rock", 3, random, [](Random& r) { return make_rock("rock_a", r); });
  for (const std::string& rock : objects.rocks)
    append(objects.shore_rocks, recoloured(writer, rock, {{{"rock_a", "rock_b"}}}));
  writer.object("railing", make_iron_railing());
  constexpr uint32_t kSteps = 21;
  writer.object("stairs", make_stairs(kSteps, TownTerrain::kRiser / kSteps, 0.27, 2.2));
}

void write_plants(SceneWriter& writer, TownObjects& objects, Random& random) {
  constexpr double kDetail = 0.8;
  const auto plants = [&](const char* name, uint32_t count, Model (*make)(Random&, double)) {
    return variants(writer, name, count, random, [make](Random& r) { return make(r, kDetail); });
  };
  objects.broadleaves = plants("broadleaf", 2, make_broadleaf);
  append(objects.broadleaves,
         recoloured(writer, "broadleaf_0",
                    {{{"leaf_light", "pine"}}, {{"leaf_light", "leaf_yellow"}, {"leaf_dark", "olive"}}}));
  objects.olives = plants("olive", 2, make_olive);
  objects.pines = plants("pine", 2, make_umbrella_pine);
  objects.cypresses = plants("cypress", 2, make_cypress);
  objects.palms = plants("palm", 1, make_palm);
  objects.bushes = plants("bush", 2, make_bush);
  append(objects.bushes, recoloured(writer, "bush_0", {{{"leaf_light", "olive"}}, {{"leaf_light", "pine"}}}));
  objects.blossoms = plants("blossom", 1, make_blossom_bush);
  append(objects.blossoms, recoloured(writer, "blossom_0", {{{"blossom", "blossom_red"}}, {{"blossom", "white"}}}));
  objects.tufts = plants("tuft", 2, make_grass_tuft);
}

void write_props(SceneWriter& writer, TownObjects& objects, Random& random) {
  objects.crates = variants(writer, "crate", 2, random, make_crate);
  objects.stalls = variants(writer, "stall", 1, random, make_market_stall);
  append(objects.stalls, recoloured(writer, "stall_0", {{{"canvas_b", "canvas_blue"}}, {{"canvas_b", "hull_green"}}}));
  objects.tables = variants(writer, "table", 1, random, make_cafe_table);
  append(objects.tables, recoloured(writer, "table_0", {{{"canvas_b", "wall_ochre"}}, {{"canvas_b", "canvas_a"}}}));
  objects.pots = variants(writer, "pot", 1, random, make_flower_pot);
  append(objects.pots, recoloured(writer, "pot_0",
                                  {{{"blossom", "blossom_red"}}, {{"blossom", "white"}}, {{"blossom", "wall_lemon"}}}));
  objects.boxes = variants(writer, "box", 1, random, make_flower_box);
  append(objects.boxes, recoloured(writer, "box_0", {{{"blossom", "blossom_red"}}}));
  objects.laundry = variants(writer, "laundry", 2, random, make_laundry);
  objects.racks = variants(writer, "rack", 1, random, make_fish_rack);
  objects.gulls = variants(writer, "gull", 2, random, make_gull);
  objects.clouds = variants(writer, "cloud", 2, random, make_cloud);
  writer.object("barrel", make_barrel());
  writer.object("rope_coil", make_rope_coil());
  writer.object("bollard", make_bollard());
  writer.object("lamp_post", make_lamp_post());
  writer.object("bench", make_bench());
  writer.object("buoy", make_buoy());
  objects.rowing_boats = variants(writer, "rowing_boat", 1, random, make_rowing_boat);
  append(objects.rowing_boats, recoloured(writer, "rowing_boat_0",
                                          {{{"hull", "hull_blue"}},
                                           {{"hull", "hull_red"}, {"hull_low", "hull_blue"}},
                                           {{"hull", "hull_green"}},
                                           {{"hull", "cloth_c"}}}));
  objects.fishing_boats = variants(writer, "fishing_boat", 1, random, make_fishing_boat);
  append(
      objects.fishing_boats,
      recoloured(writer, "fishing_boat_0",
                 {{{"hull", "hull_blue"}}, {{"hull", "hull_red"}, {"hull_low", "stone_c"}}, {{"hull", "hull_green"}}}));
  writer.object("sailing_boat", make_sailing_boat(random));
}

} // namespace

void write_town_materials(SceneWriter& writer) {
  for (const Paint& paint : kPaints) writer.material(paint.name, Vec3(paint.r, paint.g, paint.b));
  for (int i = 0; i < TownTerrain::kSeaShades; ++i) { // green at the shore to blue in the distance
    const float t = static_cast<float>(i) / (TownTerrain::kSeaShades - 1);
    const Vec3 shallow(0.30f, 0.68f, 0.64f), middle(0.09f, 0.44f, 0.52f), deep(0.05f, 0.27f, 0.43f);
    const Vec3 shade = t < 0.5f ? glm::mix(shallow, middle, 2.0f * t) : glm::mix(middle, deep, 2.0f * t - 1.0f);
    writer.material(fmt::format("water_{}", i), glm::round(shade * 1000.0f) / 1000.0f);
  }
}

TownObjects write_town_objects(SceneWriter& writer, uint64_t seed) {
  TownObjects objects;
  Random houses(seed, 1), masonry(seed, 2), plants(seed, 3), props(seed, 4);
  write_houses(writer, objects, houses);
  write_masonry(writer, objects, masonry);
  write_plants(writer, objects, plants);
  write_props(writer, objects, props);
  return objects;
}

} // namespace packtrace::scenegen
