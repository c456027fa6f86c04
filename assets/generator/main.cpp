#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "assets/generator/town.h"
#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

int run(int argc, char** argv) {
  CLI::App app{"Writes pbrt-v3 scenes of any size. The same options give the same bytes on every machine."};
  app.require_subcommand(1);
  OutputConfig output;
  TownConfig town;
  const auto add_verb = [&](const char* name, const char* about) {
    CLI::App* verb = app.add_subcommand(name, about);
    verb->add_option("-o,--output", output.folder, "folder to write into; made if missing")->required();
    verb->add_flag("--force", output.overwrite, "overwrite files that exist");
    return verb;
  };
  CLI::App* town_verb = add_verb("town", "a harbour town on a terraced hillside");
  town_verb->add_option("--seed", town.seed, "chooses everything that is left to chance")->capture_default_str();
  town_verb->add_option("--instances", town.instances, "about how many [3000, 20000000]")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  SceneTotals totals;
  if (town_verb->parsed()) totals = generate_town(town, output);
  fmt::print("{} instances, {} unique triangles, {} placed triangles\n", totals.instances, totals.unique_triangles,
             totals.placed_triangles);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) {
  try {
    return packtrace::run(argc, argv);
  } catch (const packtrace::Error& error) {
    fmt::print(stderr, "packtrace_scenegen: {}\n", error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    fmt::print(stderr, "packtrace_scenegen: {}\n", error.what());
    return 1;
  }
}
