// Who shares whose BLAS: how many are built, what is traced for it, how long the choice takes: docs/lod_runtime.md.

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "pbrt_import/scene/error.h"
#include "runtime/lod/lod_sharing.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/packing_benchmark_machine.h"
#include "tests/benchmarks/packing_benchmark_mesh.h"
#include "tests/runtime/lod/lod_records.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct Options {
  fs::path scenes, json_file;
  uint64_t triangles = 70'000;
  uint32_t repeats = 15, growth_instances = 1'000'000;
  double error_px = 1.0, height_px = 1080.0, fov_degrees = 60.0;
};

struct Scheme {
  std::string name;
  SharingConfig config;
};

std::vector<Scheme> schemes() {
  SharingConfig base;
  std::vector<Scheme> all;
  const auto add = [&](const char* name, SharingScheme scheme, const auto& change) {
    SharingConfig config = base;
    config.scheme = scheme;
    change(config);
    all.push_back({name, config});
  };
  add("per instance", SharingScheme::kPerInstance, [](SharingConfig&) {});
  add("one provider", SharingScheme::kOneProvider, [](SharingConfig&) {});
  for (const double step : {1.05, 1.1, 1.15, 1.25})
    for (const double ratio : {1.25})
     for (const double own : {4.0})
      add(fmt::format("steps {}, traced {} own {}", step, ratio, own).c_str(), step == 1.0 ? SharingScheme::kLevels : SharingScheme::kSteps, [&](SharingConfig& c) {
        if (step > 1) c.step_ratio = step;
        c.traced_ratio = ratio;
        c.own_cut_ratio = own;
      });
  return all;
}

struct SceneCase {
  std::string name;
  uint32_t instances, geometries;
  double half_size, largest_scale;
};

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// All of one diagonal.
std::vector<LodInstance> instances_of(const SceneCase& scene, std::span<const LodGeometry> geometries) {
  std::vector<LodInstance> instances =
      test::random_instances(scene.instances, scene.geometries, scene.half_size, scene.largest_scale, 1);
  for (LodInstance& instance : instances)
    for (int column = 0; column < 3; ++column)
      instance.world_from_object[column] /= 2.0 * geometries[instance.geometry].ball().radius;
  return instances;
}

Json run_scene(const SceneCase& scene, std::span<const LodGeometry> geometries, const Options& options) {
  const std::vector<LodInstance> instances = instances_of(scene, geometries);
  const DetailView view = make_detail_view(DVec3(0.0), 0.01, options.fov_degrees * 3.14159265358979 / 180.0,
                                           options.height_px, options.error_px);
  fmt::print("\n{}\n\n| scheme | builds | of per instance | own | triangles built | traced : own cuts | ms |\n", scene.name);
  uint64_t reference = 0;
  for (const Scheme& scheme : schemes()) {
    SharingConfig measured = scheme.config;
    measured.measure = true;
    const LodPlan plan = LodSharing(geometries, instances, measured).plan(view);
    if (reference == 0) reference = plan.builds;
    double ms[2];
    for (const size_t threads : {size_t{1}, size_t{2}}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      LodSharing sharing(geometries, instances, scheme.config);
      LodPlan again;
      std::vector<double> times;
      for (uint32_t i = 0; i < options.repeats; ++i) {
        const auto start = Clock::now();
        sharing.plan(view, {}, again);
        times.push_back(ms_since(start));
      }
      ms[threads - 1] = median(times);
    }
    fmt::print("| {} | {} | {:.1f} % | {} | {:.2f} M | {:.3f} | {:.2f} {:.2f} |  lowest {}\n", scheme.name, plan.builds,
               100.0 * (static_cast<double>(plan.builds) / static_cast<double>(reference) - 1.0),
               plan.category_counts[3], static_cast<double>(plan.built_triangles) * 1e-6,
               static_cast<double>(plan.traced_triangles) / static_cast<double>(plan.own_triangles), ms[0], ms[1], plan.category_counts[0]);
  }
  return {};
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app{"x"};
  app.add_option("--scenes", options.scenes, "holds the bunny")->envname("PACKTRACE_SCENES");
  app.add_option("--triangles", options.triangles, "of the generated mesh")->capture_default_str();
  app.add_option("--error-px", options.error_px, "")->capture_default_str();
  app.add_option("--json", options.json_file, "writes all figures here");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorKind::kUsage);
  }
  std::vector<LodGeometry> meshes;
  const auto add = [&](const Mesh& mesh) { meshes.push_back(test::records_of(test::build_lod(mesh)).geometry()); };
  if (!options.scenes.empty()) add(weld_positions(find_packing_input("bunny", options.scenes, 0).mesh));
  add(weld_positions(find_packing_input("generated", options.scenes, options.triangles).mesh));
  const std::vector<SceneCase> cases = {{"2,000 +-10", 2000, 1, 10.0, 1.0}, {"2,000 +-40", 2000, 1, 40.0, 1.0}, {"200 +-10 8:1", 200, 1, 10.0, 8.0},
     {"58,000 of 500", 58000, 500, 30.0, 1.0}};
  std::vector<LodGeometry> many;
  for (size_t i = 0; i < 500; ++i) many.push_back(meshes[i % meshes.size()]);
  for (const LodGeometry& m : meshes) {
    for (const LodLevel& l : m.levels()) fmt::print("{} {} {} | ", l.group_count, l.triangles, l.error / m.ball().radius/2);
    fmt::print("\n");
  for (const SceneCase& scene : cases)
      if (scene.geometries == 1) run_scene(scene, {&m, 1}, options);
  }
  run_scene(cases[3], many, options);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("lod_sharing_benchmark", packtrace::run, argc, argv); }
