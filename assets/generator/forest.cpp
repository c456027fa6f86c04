#include "assets/generator/forest.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "assets/generator/foliage.h"
#include "assets/generator/masonry.h"
#include "assets/generator/noise.h"
#include "assets/generator/placement.h"
#include "assets/generator/primitives.h"
#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

constexpr double kPlantSpacing = 3.6; ///< metres between neighbouring plants
constexpr const char* kForestComment =
    "# A forest of instanced trees with a path into it; its size is the generator's option.\n"
    "# To be seen: leaves against the sky, a path that darkens with depth. Made by packtrace_scenegen forest.\n\n";

struct Species {
  std::string name;
  uint64_t triangles = 0;
  double weight = 0.0; ///< fraction of the cells
  double sink = 0.1;   ///< metres below ground
};

double ground_height(double x, double z, uint64_t seed) {
  return 9.0 * fractal_noise({x * 0.012, 0.0, z * 0.012}, seed, 4) +
         0.25 * fractal_noise({x * 0.35, 1.0, z * 0.35}, seed + 1, 2);
}

double path_x(double z, uint64_t seed) { return 6.0 * value_noise({0.5, 0.5, z * 0.03}, seed + 2); }

class ForestBuilder {
public:
  ForestBuilder(const ForestConfig& config, SceneWriter& writer) : config_(config), writer_(writer) {
    write_materials();
    write_species();
  }

  void build() {
    const double each = mean_triangles();
    const double wanted =
        config_.instances != 0 ? static_cast<double>(config_.instances) : static_cast<double>(config_.triangles) / each;
    const auto side = static_cast<uint64_t>(std::ceil(std::sqrt(wanted * 1.08))) + 4; // the path takes some cells
    write_ground(static_cast<double>(side) * kPlantSpacing);
    uint64_t plants = 0, triangles = 0;
    for (uint64_t row = 0;; ++row) { // until there are enough plants
      for (uint64_t column = 0; column < side; ++column) {
        const bool enough = config_.instances != 0 ? plants >= config_.instances : triangles >= config_.triangles;
        if (enough) return;
        const uint64_t placed = plant(row, static_cast<double>(column) - static_cast<double>(side) * 0.5);
        triangles += placed;
        plants += placed != 0 ? 1 : 0;
      }
    }
  }

private:
  void write_materials();
  void write_species();
  void write_ground(double extent);
  uint64_t plant(uint64_t row, double column);
  double mean_triangles() const {
    double sum = 0.0;
    for (const Species& s : species_) sum += s.weight * static_cast<double>(s.triangles);
    return sum;
  }

  ForestConfig config_;
  SceneWriter& writer_;
  Random random_{config_.seed, 200};
  std::vector<Species> species_;
};

void ForestBuilder::write_materials() {
  const std::pair<const char*, Vec3> paints[] = {
      {"bark", {0.20f, 0.14f, 0.10f}},    {"leaf_light", {0.30f, 0.44f, 0.10f}}, {"leaf_dark", {0.11f, 0.23f, 0.06f}},
      {"cypress", {0.10f, 0.24f, 0.11f}}, {"olive", {0.37f, 0.43f, 0.22f}},      {"rock_a", {0.42f, 0.39f, 0.35f}},
      {"soil", {0.25f, 0.22f, 0.12f}}};
  for (const auto& [name, albedo] : paints) writer_.material(name, albedo);
}

void ForestBuilder::write_species() {
  const auto add = [&](const char* name, double weight, double sink, Model model) {
    species_.push_back({name, model.triangle_count(), weight, sink});
    writer_.object(name, model);
  };
  Random random(config_.seed, 201);
  for (const char* name : {"conifer_0", "conifer_1", "conifer_2"}) add(name, 0.17, 0.1, make_conifer(random, 3.0));
  for (const char* name : {"broadleaf_0", "broadleaf_1"}) add(name, 0.1, 0.1, make_broadleaf(random, 5.0));
  add("bush", 0.12, 0.05, make_bush(random, 3.0));
  add("tuft", 0.11, 0.0, make_grass_tuft(random, 3.0));
  add("rock", 0.06, 0.2, make_rock("rock_a", random));
}

void ForestBuilder::write_ground(double extent) {
  const auto cells = static_cast<size_t>(std::clamp(extent / 2.5, 16.0, 700.0));
  std::vector<DVec3> points;
  const double width = extent + 60.0;
  for (size_t j = 0; j <= cells; ++j) {
    for (size_t i = 0; i <= cells; ++i) {
      const double x = width * (static_cast<double>(i) / static_cast<double>(cells) - 0.5);
      const double z = width * static_cast<double>(j) / static_cast<double>(cells) - 30.0;
      points.emplace_back(x, ground_height(x, z, config_.seed), z);
    }
  }
  Model model;
  PatchBuilder patch(model, points);
  for (size_t j = 0; j < cells; ++j) {
    for (size_t i = 0; i < cells; ++i) {
      const size_t low = j * (cells + 1) + i, high = low + cells + 1;
      patch.quad("soil", {low, high, high + 1, low + 1});
    }
  }
  compute_normals(model.flat("soil"));
  writer_.model("ground", model);
  writer_.world_shape("ground");
}

/// Fills one cell. Returns the number of triangles placed, 0 on the path.
uint64_t ForestBuilder::plant(uint64_t row, double column) {
  const double x = (column + random_.uniform(-0.35, 0.35)) * kPlantSpacing;
  const double z = (static_cast<double>(row) + random_.uniform(-0.35, 0.35)) * kPlantSpacing;
  const double turn = random_.uniform(0.0, 2.0 * kPi), size = random_.uniform(0.7, 1.25);
  double pick = random_.uniform();
  if (std::abs(x - path_x(z, config_.seed)) < 2.6) return 0;
  const Species* chosen = &species_.back();
  for (const Species& s : species_) {
    chosen = &s;
    if ((pick -= s.weight) < 0.0) break;
  }
  writer_.instance(chosen->name, stand_at({x, ground_height(x, z, config_.seed) - chosen->sink, z}, turn, size));
  return chosen->triangles;
}

ViewConfig forest_view(uint64_t seed) {
  ViewConfig view;
  const double z = -9.0, x = path_x(z, seed);
  view.eye = {x, ground_height(x, z, seed) + 2.4, z};
  view.target = {path_x(25.0, seed), view.eye.y + 2.0, 25.0};
  view.fov_degrees = 48.0;
  return view;
}

} // namespace

SceneTotals generate_forest(const ForestConfig& config, const OutputConfig& output) {
  if (config.triangles < 100'000 || config.triangles > 100'000'000'000) {
    throw Error(ErrorKind::kUsage,
                fmt::format("--triangles {}: a forest takes 100000 to 100000000000", config.triangles));
  }
  if (config.instances != 0 && (config.instances < 100 || config.instances > 50'000'000)) {
    throw Error(ErrorKind::kUsage, fmt::format("--instances {}: a forest takes 100 to 50000000", config.instances));
  }
  SceneWriter writer(output, "forest", kForestComment, forest_view(config.seed));
  ForestBuilder(config, writer).build();
  return writer.finish();
}

} // namespace packtrace::scenegen
