#include <cstdio>
#include <exception>
#include <functional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "assets/generator/asteroids.h"
#include "assets/generator/displaced_mesh.h"
#include "assets/generator/extreme.h"
#include "assets/generator/forest.h"
#include "assets/generator/leaf_mask.h"
#include "assets/generator/meadow.h"
#include "assets/generator/town.h"
#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

int run(int argc, char** argv) {
  CLI::App app{"Writes pbrt-v3 scenes of any size. The same options give the same bytes on every machine."};
  app.require_subcommand(1);
  OutputConfig output;
  TownConfig town;
  ForestConfig forest;
  AsteroidsConfig asteroids;
  DisplacedMeshConfig mesh;
  ExtremeConfig extreme;
  MeadowConfig meadow;
  std::function<SceneTotals()> generate;
  const auto add_verb = [&](const char* name, const char* about, std::function<SceneTotals()> make) {
    CLI::App* verb = app.add_subcommand(name, about);
    verb->add_option("-o,--output", output.folder, "folder to write into; made if missing")->required();
    verb->add_flag("--force", output.overwrite, "overwrite files that exist");
    verb->callback([&generate, chosen = std::move(make)] { generate = chosen; });
    return verb;
  };
  const auto add_seed = [](CLI::App* verb, uint64_t& seed) {
    verb->add_option("--seed", seed, "chooses everything that is left to chance")->capture_default_str();
  };

  CLI::App* verb =
      add_verb("town", "a harbour town on a terraced hillside", [&] { return generate_town(town, output); });
  add_seed(verb, town.seed);
  verb->add_option("--instances", town.instances, "about how many [3000, 20000000]")->capture_default_str();

  verb = add_verb("forest", "instanced trees up to any count", [&] { return generate_forest(forest, output); });
  add_seed(verb, forest.seed);
  CLI::Option* triangles = verb->add_option("--triangles", forest.triangles, "placed, at least [100000, 1e11]");
  triangles->capture_default_str();
  verb->add_option("--instances", forest.instances, "this many plants instead [100, 50000000]")->excludes(triangles);

  verb = add_verb("asteroids", "many geometries, each instanced near and far",
                  [&] { return generate_asteroids(asteroids, output); });
  add_seed(verb, asteroids.seed);
  verb->add_option("--geometries", asteroids.geometries, "of about 4000 triangles each [1, 5000]")
      ->capture_default_str();
  verb->add_option("--instances", asteroids.instances, "at least one of each [1, 50000000]")->capture_default_str();

  verb = add_verb("mesh", "one unique displaced mesh", [&] { return generate_displaced_mesh(mesh, output); });
  verb->alias("grid");
  add_seed(verb, mesh.seed);
  verb->add_option("--triangles", mesh.triangles, "at least [100, 2000000000]")->capture_default_str();

  verb = add_verb("extreme", "sizes from 1e-6 to 1e6 side by side", [&] { return generate_extreme(extreme, output); });
  add_seed(verb, extreme.seed);

  verb = add_verb("meadow", "grass that moves in the wind, one PLY file a frame",
                  [&] { return generate_meadow(meadow, output); });
  add_seed(verb, meadow.seed);
  verb->add_option("--patches", meadow.patches, "placed, nearest first [1, 5000]")->capture_default_str();
  verb->add_option("--blades", meadow.blades, "of the finest patch, a square number [1, 1000000]")
      ->capture_default_str();
  verb->add_option("--tile", meadow.tile, "patches per axis until blades and wind repeat [1, 16]")
      ->capture_default_str();
  verb->add_option("--frames", meadow.frames, "after which all motion repeats [1, 10000]")->capture_default_str();
  verb->add_option("--fps", meadow.frames_per_second, "frames per second [1, 240]")->capture_default_str();
  verb->add_option("--wind", meadow.wind, "strength; 1 is a breeze [0, 4]")->capture_default_str();

  add_verb("leaf", "the alpha mask of assets/room's plant", [&] {
    generate_leaf_mask(output);
    return SceneTotals{};
  });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorKind::kUsage);
  }

  const SceneTotals totals = generate();
  fmt::print("{} instances, {} unique triangles, {} placed triangles\n", totals.instances, totals.unique_triangles,
             totals.placed_triangles);
  return 0;
}

} // namespace
} // namespace packtrace::scenegen

int main(int argc, char** argv) {
  try {
    return packtrace::scenegen::run(argc, argv);
  } catch (const packtrace::Error& error) {
    fmt::print(stderr, "packtrace_scenegen: {}\n", error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    fmt::print(stderr, "packtrace_scenegen: {}\n", error.what());
    return 1;
  }
}
