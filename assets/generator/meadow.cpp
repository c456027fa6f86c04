#include "assets/generator/meadow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "assets/generator/flowers.h"
#include "assets/generator/foliage.h"
#include "assets/generator/grass_files.h"
#include "assets/generator/house.h"
#include "assets/generator/masonry.h"
#include "assets/generator/meadow_terrain.h"
#include "assets/generator/noise.h"
#include "assets/generator/parameter_check.h"
#include "assets/generator/placement.h"
#include "assets/generator/props.h"
#include "assets/generator/town_terrain.h"
#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

constexpr double kCell = MeadowTerrain::kCell;
constexpr DVec3 kEye(-3.4, 1.55, -3.0); ///< y above the ground
constexpr DVec3 kTarget(6.5, 0.0, 60.0);
/// Materials are "grass_TONE", textures grass_TONE.png, objects "grass_LOD_TONE".
constexpr const char* kTones[] = {"lush", "meadow", "dry"};

std::string comment_of(const MeadowConfig& config) {
  std::string text =
      "# A meadow in the wind: instances of a patch of grass at five levels of detail, a lane, a fence and a "
      "windmill.\n"
      "# To be seen: gusts that travel over the grass, dark between the blades; poppies, daisies and cornflowers.\n"
      "# Made by packtrace_scenegen meadow; pbrt-v3 renders its first frame as it stands.\n";
  if (config.frames == 1) return text + "\n";
  text +=
      "# geometry/grass_N_%04d.ply are the frames of level N; the mill's sails and the birds move too:\n#   packtrace "
      "bake meadow.pbrt -o meadow.ptk";
  text += fmt::format(" --sequence-fps {}", config.frames_per_second);
  const char* patch = config.tile == 1 ? "" : "_P";
  for (uint32_t lod = 0; lod + 1 < kGrassLods; ++lod)
    text += fmt::format(" \\\n#     --sequence 'geometry/grass_{}{}_%04d.ply'", lod, patch);
  text += " \\\n#     --distance-levels meadow_levels.json";
  if (config.tile > 1) text += fmt::format("\n# for each patch P of the tile, 0 to {}", config.tile * config.tile - 1);
  return text + "\n\n";
}

ViewConfig meadow_view(const MeadowConfig& config) {
  const MeadowTerrain terrain(config.seed);
  ViewConfig view;
  view.eye = terrain.place(kEye.x, kEye.z) + DVec3(0, kEye.y, 0);
  view.target = {kTarget.x, view.eye.y + 0.6, kTarget.z};
  view.fov_degrees = 40.0;
  view.end_time_s = config.frames / config.frames_per_second;
  return view;
}

/// A cell of the ground that grass is placed on.
struct GrassCell {
  double distance = 0.0; ///< from the eye to its middle
  int64_t row = 0, column = 0;
};

/// Cells in and beside the view, nearest first.
std::vector<GrassCell> cells_in_view() {
  const glm::dvec2 eye(kEye.x, kEye.z), ahead = glm::normalize(glm::dvec2(kTarget.x, kTarget.z) - eye);
  const glm::dvec2 apex = eye - ahead * 6.0; // behind the eye, so that the grass around it shades what is seen
  std::vector<GrassCell> cells;
  const auto reach = static_cast<int64_t>(MeadowTerrain::kGrassReach / kCell);
  for (int64_t row = -4; row < reach; ++row) {
    for (int64_t column = -reach; column < reach; ++column) {
      const glm::dvec2 middle((static_cast<double>(column) + 0.5) * kCell, (static_cast<double>(row) + 0.5) * kCell);
      const glm::dvec2 to = middle - apex;
      const double distance = glm::length(middle - eye);
      const bool in_view = glm::dot(to, ahead) > 0.8 * glm::length(to); // 37 degrees to each side
      if (column != MeadowTerrain::kLaneColumn && in_view && distance < MeadowTerrain::kGrassReach)
        cells.push_back({distance, row, column});
    }
  }
  std::sort(cells.begin(), cells.end(), [](const GrassCell& a, const GrassCell& b) {
    return std::tie(a.distance, a.row, a.column) < std::tie(b.distance, b.row, b.column);
  });
  return cells;
}

class MeadowBuilder {
public:
  MeadowBuilder(const MeadowConfig& config, const OutputConfig& output, SceneWriter& writer)
      : config_(config), output_(output), writer_(writer), terrain_(config.seed),
        grass_(make_grass_field(meadow_grass(config))) {}

  void build() {
    write_materials();
    write_models();
    build_grass();
    build_flowers();
    build_lane();
    build_trees();
    build_movers();
  }

private:
  void write_materials();
  void write_models();
  std::string declare_grass(const GrassVariant& variant);
  void build_grass();
  void complete_levels();
  void build_flowers();
  void build_lane();
  void build_trees();
  void build_movers();
  void put(std::string_view object, double x, double z, double turn, double scale = 1.0, double sink = 0.0) {
    writer_.instance(object, stand_at(terrain_.place(x, z) - DVec3(0, sink, 0), turn, scale));
  }

  MeadowConfig config_;
  OutputConfig output_;
  SceneWriter& writer_;
  MeadowTerrain terrain_;
  GrassField grass_;
  std::map<GrassVariant, std::string> grass_objects_; ///< by variant that is written: an object that shows it
  Random random_{config_.seed, 300};
};

void MeadowBuilder::write_materials() {
  const std::pair<const char*, Vec3> paints[] = {
      {"turf_near", {0.085f, 0.115f, 0.035f}}, {"turf_a", {0.095f, 0.15f, 0.04f}},
      {"turf_b", {0.125f, 0.175f, 0.05f}},     {"lane", {0.24f, 0.24f, 0.11f}},
      {"lane_rut", {0.40f, 0.32f, 0.21f}},     {"lane_middle", {0.20f, 0.24f, 0.08f}},
      {"stem", {0.13f, 0.24f, 0.05f}},         {"poppy", {0.78f, 0.05f, 0.02f}},
      {"daisy", {0.90f, 0.89f, 0.86f}},        {"daisy_eye", {0.85f, 0.55f, 0.03f}},
      {"cornflower", {0.10f, 0.14f, 0.70f}},   {"bark", {0.20f, 0.14f, 0.10f}},
      {"leaf_light", {0.30f, 0.44f, 0.10f}},   {"leaf_dark", {0.11f, 0.23f, 0.06f}},
      {"cypress", {0.09f, 0.20f, 0.09f}},      {"olive", {0.33f, 0.42f, 0.16f}},
      {"rock_a", {0.45f, 0.42f, 0.37f}},       {"wood", {0.40f, 0.31f, 0.22f}},
      {"wall", {0.86f, 0.83f, 0.76f}},         {"door", {0.05f, 0.22f, 0.30f}},
      {"glass", {0.05f, 0.08f, 0.11f}},        {"white", {0.90f, 0.88f, 0.83f}},
      {"bird", {0.05f, 0.05f, 0.07f}},         {"cloud", {0.93f, 0.94f, 0.96f}},
      {"mountain_a", {0.38f, 0.50f, 0.56f}},   {"mountain_b", {0.56f, 0.67f, 0.78f}}};
  for (const auto& [name, albedo] : paints) writer_.material(name, albedo);
  constexpr double kStraw[] = {0.05, 0.14, 0.34};
  for (size_t i = 0; i < std::size(kTones); ++i) {
    const std::string material = fmt::format("grass_{}", kTones[i]), file = material + ".png";
    write_grass_texture(file, kStraw[i], output_);
    writer_.textured_material(material, file);
  }
}

void MeadowBuilder::write_models() {
  Random random(config_.seed, 301);
  const auto add = [&](const std::string& name, Model model) { writer_.object(name, std::move(model)); };
  for (int i = 0; i < 3; ++i) {
    add(fmt::format("poppy_{}", i), make_poppy(random));
    add(fmt::format("daisy_{}", i), make_daisy(random));
    add(fmt::format("cornflower_{}", i), make_cornflower(random));
    add(fmt::format("tuft_{}", i), make_grass_tuft(random, 2.0));
    add(fmt::format("rock_{}", i), make_rock("rock_a", random));
    add(fmt::format("fence_{}", i), make_wooden_fence(random));
  }
  add("broadleaf", make_broadleaf(random, 3.0));
  add("conifer", make_conifer(random, 1.0));
  add("bush", make_bush(random, 2.0));
  add("cloud", make_cloud(random));
  add("mill", make_windmill_tower());
  add("sails", make_windmill_sails());
  writer_.model("bird", make_gull(random));
  writer_.object("bird", "bird", {{"white", "bird"}, {"stone_c", "bird"}});
  writer_.model("ground", terrain_.make_ground());
  writer_.world_shape("ground");
  add("mountains", TownTerrain(config_.seed).make_mountains());
}

/// Writes the meshes of a patch and declares its objects. Returns its name.
std::string MeadowBuilder::declare_grass(const GrassVariant& variant) {
  std::string name = grass_name(grass_.config, variant);
  const std::string file = write_grass_frames(grass_, variant, config_.frames, output_);
  writer_.ply_model(name, file, "grass", uint64_t{kBladeTriangles} * grass_blade_count(grass_.config, variant.lod));
  for (const std::string tone : kTones) writer_.object(name + "_" + tone, name, {{"grass", "grass_" + tone}});
  return name;
}

void MeadowBuilder::build_grass() {
  std::vector<GrassCell> cells = cells_in_view();
  if (cells.size() < config_.patches) throw Error(ErrorKind::kUsage, "--patches: the meadow is too small for them");
  cells.resize(config_.patches);
  const GrassConfig& grass = grass_.config;
  for (const GrassCell& cell : cells) {
    const auto wrap = [&](int64_t i) {
      return static_cast<uint32_t>(((i % grass.tile_patches) + grass.tile_patches) % grass.tile_patches);
    };
    const GrassVariant variant{grass_lod(grass, cell.distance), wrap(cell.column), wrap(cell.row)};
    const bool first = !grass_objects_.contains(variant);
    const std::string name = first ? declare_grass(variant) : grass_name(grass, variant);
    const double x = static_cast<double>(cell.column) * kCell, z = static_cast<double>(cell.row) * kCell;
    const double dry =
        fractal_noise({x * 0.035, 0.0, z * 0.035}, config_.seed + 31, 2) + 0.5 * smooth_step(6.0, 60.0, cell.distance);
    const double tone = 0.55 + 1.5 * dry + random_.uniform(-0.5, 0.5);
    const double tall = fractal_noise({x * 0.06, 0.0, z * 0.06}, config_.seed + 32, 2);
    const double scale = 0.9 + 0.4 * tall + random_.uniform(-0.07, 0.07);
    const auto chosen = static_cast<size_t>(std::clamp(tone, 0.0, 2.9));
    const std::string object = fmt::format("{}_{}", name, kTones[chosen]);
    if (first) grass_objects_[variant] = object;
    writer_.instance(object, terrain_.shear_to_ground(x, z, kCell, kCell, scale));
  }
  complete_levels();
}

/// Writes all levels of the patches in use, and the file that chains them.
void MeadowBuilder::complete_levels() {
  std::set<std::pair<uint32_t, uint32_t>> patches;
  for (const auto& [variant, object] : grass_objects_) patches.emplace(variant.row, variant.column);
  std::vector<std::array<std::string, kGrassLods>> chains;
  for (const auto& [row, column] : patches) {
    auto& chain = chains.emplace_back();
    for (uint32_t lod = 0; lod < kGrassLods; ++lod) {
      const GrassVariant variant{lod, column, row};
      if (const auto found = grass_objects_.find(variant); found != grass_objects_.end()) {
        chain[lod] = found->second;
        continue;
      }
      chain[lod] = fmt::format("{}_{}", declare_grass(variant), kTones[1]);
      writer_.write_object(chain[lod]);
    }
  }
  write_grass_levels("meadow_levels.json", grass_.config, chains, output_);
}

/// Drifts of flowers beside the lane, denser near the eye.
void MeadowBuilder::build_flowers() {
  constexpr const char* kKinds[] = {"poppy", "daisy", "cornflower"};
  for (uint32_t i = 0; i < 2600; ++i) {
    const double away = 1.5 + 34.0 * random_.uniform() * random_.uniform(), angle = random_.uniform(-0.62, 0.75);
    const auto [s, c] = sin_cos(angle);
    const double x = kEye.x + away * s, z = kEye.z + away * c, size = random_.uniform(0.8, 1.2);
    const double turn = random_.uniform(0.0, 2.0 * kPi), luck = random_.uniform();
    const uint32_t kind = random_.below(3), shape = random_.below(3);
    const double drift = fractal_noise({x * 0.22, 5.0 * kind, z * 0.22}, config_.seed + 33 + kind, 2);
    if (drift < 0.12 + 0.2 * luck || (x > -0.15 && x < kCell + 0.15)) continue;
    put(fmt::format("{}_{}", kKinds[kind], shape), x, z, turn, size);
  }
}

/// Tufts along the edges of the lane, a fence, and rocks.
void MeadowBuilder::build_lane() {
  for (double z = -6.0; z < 70.0; z += 0.42) {
    for (const double edge : {-0.02, kCell + 0.02, 1.5}) {
      const double x = edge + random_.uniform(-0.14, 0.14), size = random_.uniform(0.5, 1.0);
      const double turn = random_.uniform(0.0, 2.0 * kPi);
      const uint32_t shape = random_.below(3);
      if (random_.chance(edge == 1.5 ? 0.2 : 0.1)) continue;
      put(fmt::format("tuft_{}", shape), x, z, turn, edge == 1.5 ? 0.42 * size : 0.85 * size);
    }
  }
  for (int i = 0; i < 48; ++i) { // the fence's modules run along x before they are turned
    const double z = 3.0 + i * kWallModule;
    DAffine frame = terrain_.shear_to_ground(kCell + 0.6, z - 1.0, 0.1, kWallModule, 1.0);
    const double slope = frame[2].y;
    frame = DAffine(DVec3(0, slope, 1), DVec3(0, 1, 0), DVec3(-1, 0, 0), terrain_.place(kCell + 0.6, z));
    if (i != 9) writer_.instance(fmt::format("fence_{}", i % 3), frame);
  }
  constexpr double kRocks[][3] = {{-1.3, 5.2, 0.9},  {-2.0, 6.0, 0.55}, {4.7, 14.0, 1.3},  {-9.5, 13.0, 1.9},
                                  {-8.2, 14.3, 1.1}, {9.0, 22.0, 1.6},  {-0.8, 24.0, 0.8}, {16.0, 40.0, 2.4}};
  for (size_t i = 0; i < std::size(kRocks); ++i)
    put(fmt::format("rock_{}", i % 3), kRocks[i][0], kRocks[i][1], 1.7 * static_cast<double>(i), kRocks[i][2], 0.08);
}

void MeadowBuilder::build_trees() {
  constexpr double kBroadleaves[][3] = {{-13.0, 27.0, 1.35}, {-21.0, 34.0, 1.1}, {29.0, 58.0, 1.3}, {36.0, 66.0, 1.1},
                                        {-36.0, 78.0, 1.3},  {24.0, 116.0, 1.2}, {-5.0, 98.0, 1.0}, {52.0, 96.0, 1.4}};
  for (const auto& at : kBroadleaves) put("broadleaf", at[0], at[1], at[0] * 1.9, at[2], 0.15);
  for (const auto& at : kBroadleaves) {
    const double nearer = random_.uniform(1.0, 2.5), aside = random_.uniform(1.5, 3.0);
    put("bush", at[0] + aside, at[1] - nearer, at[1], 1.5, 0.1);
  }
  for (int i = 0; i < 420; ++i) { // woods on the hills
    const double x = random_.uniform(-190.0, 240.0), z = random_.uniform(90.0, 300.0), turn = random_.uniform(0.0, 6.0);
    const double size = random_.uniform(0.8, 1.35), luck = random_.uniform(-0.15, 0.15);
    const double wood = fractal_noise({x * 0.02, 0.0, z * 0.02}, config_.seed + 34, 2) + 0.4 * smooth_step(150, 300, z);
    const bool before_mill = std::abs(x - MeadowTerrain::kMillPlace.x) < 26.0 && z < 170.0;
    if (wood + luck < 0.22 || before_mill) continue;
    put(random_.chance(0.7) ? "conifer" : "broadleaf", x, z, turn, size, 0.3);
  }
  writer_.instance("mountains", scaling({1.0, 1.7, 1.0}));
  constexpr double kClouds[][4] = {{-190, 118, 400, 2.1}, {-70, 150, 430, 1.6}, {70, 120, 420, 1.9},
                                   {170, 156, 440, 1.6},  {270, 128, 430, 2.2}, {10, 176, 440, 1.2}};
  for (const auto& cloud : kClouds)
    writer_.instance("cloud", stand_at({cloud[0], cloud[1], cloud[2]}, random_.uniform(-0.4, 0.4), cloud[3]));
}

void MeadowBuilder::build_movers() {
  constexpr double kMillScale = 1.25;
  const DVec3 place = terrain_.place(MeadowTerrain::kMillPlace.x, MeadowTerrain::kMillPlace.z) - DVec3(0, 0.3, 0);
  const DAffine mill = stand_at(place, radians(16), kMillScale);
  writer_.instance("mill", mill);
  const DAffine axle = compose(mill, translation(kSailAxle));
  // An eighth of a turn per loop, or several: the sails end as they began.
  const double eighths = std::max(1.0, std::floor(config_.frames / config_.frames_per_second * 0.8 + 0.5));
  const double turn = radians(45) * std::min(eighths, 3.0); // an interpolated rotation takes the shorter way
  writer_.moving_instance("sails", compose(axle, rotation_z(0.25)), compose(axle, rotation_z(0.25 + turn)));
  const double seconds = config_.frames / config_.frames_per_second;
  for (int i = 0; i < 9; ++i) {
    const double z = random_.uniform(38.0, 58.0), y = 15.5 + random_.uniform(-1.5, 4.5),
                 x = random_.uniform(-12.0, 26.0);
    const DVec3 at(x, y, z);
    const double heading = radians(70) + random_.uniform(-0.25, 0.25), size = random_.uniform(0.8, 1.1);
    const auto [s, c] = sin_cos(heading);
    const DVec3 end = at + DVec3(s, 0.06, c) * (4.5 * seconds);
    const DAffine bank = rotation_z(random_.uniform(-0.4, 0.4));
    writer_.moving_instance("bird", compose(stand_at(at, heading, size), bank),
                            compose(stand_at(end, heading, size), bank));
  }
}

} // namespace

GrassConfig meadow_grass(const MeadowConfig& config) {
  check_parameter("--patches", config.patches, 1u, 5000u);
  check_parameter("--blades", config.blades, 1u, 1'000'000u);
  check_parameter("--tile", config.tile, 1u, 16u);
  check_parameter("--frames", config.frames, 1u, 10'000u);
  check_parameter("--fps", config.frames_per_second, 1.0, 240.0);
  check_parameter("--wind", config.wind, 0.0, 4.0);
  const auto side = static_cast<uint32_t>(std::floor(std::sqrt(static_cast<double>(config.blades)) + 0.5));
  if (side * side != config.blades)
    throw Error(ErrorKind::kUsage,
                fmt::format("--blades {}: it must be a square number, such as {}", config.blades, side * side));
  GrassConfig grass;
  grass.seed = config.seed;
  grass.blades_per_side = side;
  grass.patch_size = MeadowTerrain::kCell;
  grass.tile_patches = config.tile;
  grass.wind.strength *= config.wind;
  grass.wind.gust_length = grass.patch_size * std::min(config.tile, 3u);
  grass.wind.period_s = config.frames / config.frames_per_second;
  return grass;
}

SceneTotals generate_meadow(const MeadowConfig& config, const OutputConfig& output) {
  make_grass_field(meadow_grass(config)); // rejects bad parameters before anything is written
  SceneWriter writer(output, "meadow", comment_of(config), meadow_view(config));
  MeadowBuilder(config, output, writer).build();
  return writer.finish();
}

} // namespace packtrace::scenegen
