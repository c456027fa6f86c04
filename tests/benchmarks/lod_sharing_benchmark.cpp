// Measures sharing of BLASes: how many are built, how many triangles are traced for it and how long planning takes.
// Documented in docs/lod_runtime.md.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/lod/blas_residency.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/packing_benchmark_machine.h"
#include "tests/benchmarks/packing_benchmark_mesh.h"
#include "tests/benchmarks/thread_cpu_time.h"
#include "tests/runtime/lod/lod_records.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct Options {
  fs::path scenes, json_file;
  uint64_t triangles = 70'000;
  uint32_t repeats = 15, frames = 300, growth = 1'000'000;
  double triangle_bytes = 64.0, scale = 1.0;
};

struct Scheme {
  const char* name;
  SharingConfig config;
};

std::vector<Scheme> schemes() {
  SharingConfig one_provider, steps_alone, steps, merged;
  one_provider.scheme = SharingScheme::kOneProvider;
  steps_alone.traced_ratio = 0.0;
  steps_alone.own_cut_ratio = 1.25;
  merged.merge_own_cuts = true;
  return {{"per instance", test::own_cuts()},
          {"one provider", one_provider},
          {"steps, each alone", steps_alone},
          {"steps, balanced", steps},
          {"steps, own cuts merged", merged}};
}

struct SceneCase {
  std::string name;
  uint32_t instances, geometries;
  double half_size, largest_scale;
};

/// Wall time and CPU time of this thread, in milliseconds.
struct Times {
  double wall = 1e30, cpu = 1e30;
};

/// Minimum wall time and minimum CPU time.
class LeastTimes {
public:
  template <typename Call>
  void time(const Call& call) {
    const double cpu = thread_cpu_seconds();
    const auto start = Clock::now();
    call();
    least_.wall = std::min(least_.wall, std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    least_.cpu = std::min(least_.cpu, 1e3 * (thread_cpu_seconds() - cpu));
  }
  const Times& least() const { return least_; }

private:
  Times least_;
};

/// Instances whose geometries are normalised to a diagonal of 1 and then scaled as the scene says.
std::vector<LodInstance> instances_of(const SceneCase& scene, std::span<const LodGeometry> geometries) {
  std::vector<LodInstance> instances =
      test::random_instances(scene.instances, scene.geometries, scene.half_size, scene.largest_scale, 1);
  for (LodInstance& instance : instances)
    for (int column = 0; column < 3; ++column)
      instance.world_from_object[column] /= 2.0 * geometries[instance.geometry].ball().radius;
  return instances;
}

/// Error limit of 1 pixel at 1080p and 60 degrees.
DetailView view_from(DVec3 eye) { return make_detail_view(eye, 0.01, std::numbers::pi / 3.0, 1080.0, 1.0); }

/// Camera path through the scene, 0.05 diagonals per frame.
DVec3 flight(uint32_t frame) {
  const double t = 0.05 * frame;
  return {t - 7.5, 2.0 * std::sin(0.3 * t), 1.5 * std::cos(0.4 * t)};
}

/// Counts instances whose BLAS is coarser somewhere than their own cut.
uint64_t count_under_detailed(const LodSharing& sharing, std::span<const LodInstance> instances, const LodPlan& plan,
                              const DetailView& view) {
  std::vector<std::vector<uint64_t>> passed; // per planned BLAS
  for (const PlannedBlas& blas : plan.blas)
    passed.push_back(passed_of_blas(sharing.geometries()[blas.geometry], sharing.steps(blas.geometry), plan, blas));
  uint64_t count = 0;
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const LodGeometry& geometry = sharing.geometries()[instances[i].geometry];
    const DAffine& m = instances[i].world_from_object;
    const InstanceMetric metric(view, m, largest_stretch(m), geometry.reach());
    bool enough = true;
    for (uint32_t rank = 0; rank < geometry.rank_count() && enough; ++rank)
      enough = !rank_passes(passed[plan.blas_of_instance[i]], rank) || metric.passes(geometry.ranks(), rank);
    count += !enough;
  }
  return count;
}

/// Time of one plan with a moving camera.
Times time_plan(std::span<const LodGeometry> geometries, std::span<const LodInstance> instances,
                const SharingConfig& config, uint32_t repeats, size_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  LodSharing sharing(geometries, instances, config);
  LodPlan plan;
  LeastTimes times;
  sharing.plan(view_from(flight(149)), {}, plan); // allocates memory
  for (uint32_t i = 0; i < repeats; ++i) times.time([&] { sharing.plan(view_from(flight(150 + i)), {}, plan); });
  return times.least();
}

/// Totals over the frames of a flight, without the first, in which everything is built.
struct Flown {
  double update_ms = 0.0; ///< mean CPU time
  uint64_t builds = 0, triangles = 0, coarse_frames = 0;
  uint64_t largest_triangles = 0; ///< largest total of all BLASes alive at one time
};

Flown fly(std::span<const LodGeometry> geometries, std::span<const LodInstance> instances, const SharingConfig& config,
          uint32_t frames) {
  LodSharing sharing(geometries, instances, config);
  BlasResidency residency(sharing, {});
  LodPlan plan;
  Flown flown;
  for (uint32_t frame = 0; frame < frames; ++frame) {
    sharing.plan(view_from(flight(frame)), {}, plan);
    const double cpu = thread_cpu_seconds();
    const ResidencyFrame& result = residency.update(plan);
    const double used = thread_cpu_seconds() - cpu;
    flown.largest_triangles = std::max(flown.largest_triangles, residency.live_triangles());
    if (frame == 0) continue;
    flown.update_ms += 1e3 * used / (frames - 1);
    flown.builds += result.built.size();
    flown.triangles += result.built_triangles;
    flown.coarse_frames += result.coarse_instances > 0;
  }
  return flown;
}

Json run_scene(const SceneCase& scene, std::span<const LodGeometry> geometries, const Options& options) {
  const std::vector<LodInstance> instances = instances_of(scene, geometries);
  const DetailView view = view_from(DVec3(0.0));
  Json rows = Json::array();
  fmt::print("\n### {}\n\n| scheme | builds | against per instance | MiB at {} B a triangle | traced : own cuts "
             "| under-detailed | plan: CPU / wall of 2 threads (ms) | moving: update (ms) | builds a frame "
             "| thousand triangles a frame | frames short of detail |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
             scene.name, options.triangle_bytes);
  uint64_t reference = 0;
  for (const Scheme& scheme : schemes()) {
    SharingConfig measured = scheme.config;
    measured.measure = true;
    LodSharing sharing(geometries, instances, measured);
    const LodPlan plan = sharing.plan(view);
    if (reference == 0) reference = plan.builds;
    const uint64_t under = count_under_detailed(sharing, instances, plan, view);
    const Times one = time_plan(geometries, instances, scheme.config, options.repeats, 1);
    const Times two = time_plan(geometries, instances, scheme.config, options.repeats, 2);
    const Flown flown = fly(geometries, instances, scheme.config, options.frames);
    const double against =
        static_cast<double>(plan.builds) / static_cast<double>(std::max<uint64_t>(reference, 1)) - 1.0;
    const double traced = static_cast<double>(plan.traced_triangles) / static_cast<double>(plan.own.traced_triangles);
    const double mib = static_cast<double>(plan.built_triangles) * options.triangle_bytes / (1 << 20);
    const double frames = std::max(1.0, static_cast<double>(options.frames) - 1.0);
    fmt::print("| {} | {} | {:.1f} % | {:.2f} | {:.3f} | {} | {:.3f} / {:.3f} | {:.3f} | {:.2f} | {:.1f} | {} |\n",
               scheme.name, plan.builds, 100.0 * against, mib, traced, under, one.cpu, two.wall, flown.update_ms,
               static_cast<double>(flown.builds) / frames, 1e-3 * static_cast<double>(flown.triangles) / frames,
               flown.coarse_frames);
    rows.push_back({{"scheme", scheme.name},
                    {"builds", plan.builds},
                    {"against_per_instance", against},
                    {"own_cuts", plan.category_counts[static_cast<size_t>(InstanceCategory::kOwn)]},
                    {"lowest", plan.category_counts[static_cast<size_t>(InstanceCategory::kCoarsest)]},
                    {"built_triangles", plan.built_triangles},
                    {"built_clusters", plan.built_clusters},
                    {"built_mib", mib},
                    {"traced_of_own", traced},
                    {"under_detailed", under},
                    {"plan", {{"cpu_ms", one.cpu}, {"wall_ms", {one.wall, two.wall}}}},
                    {"moving",
                     {{"update_ms", flown.update_ms},
                      {"builds", flown.builds},
                      {"triangles", flown.triangles},
                      {"coarse_frames", flown.coarse_frames},
                      {"largest_triangles", flown.largest_triangles}}}});
  }
  return {{"name", scene.name}, {"instances", scene.instances}, {"geometries", scene.geometries}, {"schemes", rows}};
}

Json run_growth(std::span<const LodGeometry> geometries, const Options& options) {
  Json rows = Json::array();
  fmt::print("\n### Growth: {} geometries, the same density, steps balanced\n\n| instances | plan: CPU / wall of 2 "
             "threads (ms) | ns an "
             "instance |\n|---|---|---|\n",
             geometries.size());
  for (uint32_t count = 1000; count <= options.growth; count *= 10) {
    const double half_size = 30.0 * std::cbrt(count / 58'000.0);
    const std::vector<LodInstance> instances =
        instances_of({"", count, static_cast<uint32_t>(geometries.size()), half_size, 1.0}, geometries);
    const Times one = time_plan(geometries, instances, {}, options.repeats, 1);
    const Times two = time_plan(geometries, instances, {}, options.repeats, 2);
    fmt::print("| {} | {:.3f} / {:.3f} | {:.0f} |\n", count, one.cpu, two.wall, 1e6 * one.cpu / count);
    rows.push_back({{"instances", count}, {"cpu_ms", one.cpu}, {"wall_ms", {one.wall, two.wall}}});
  }
  return rows;
}

void add_options(BenchmarkOptions& command_line, Options& options) {
  command_line.add("--scenes", options.scenes, "holds the bunny").environment("PACKTRACE_SCENES");
  command_line.add("--triangles", options.triangles, "of the generated meshes").show_default();
  command_line.add("--repeats", options.repeats, "plans that are timed; the fastest counts").show_default();
  command_line.add("--frames", options.frames, "of the moving camera").show_default();
  command_line.add("--growth", options.growth, "instances up to which growth is measured; 0: not").show_default();
  command_line.add("--triangle-bytes", options.triangle_bytes, "of a BLAS, for its MiB").show_default();
  command_line.add("--scale", options.scale, "of the numbers of instances, for tests").range(0.001, 1.0).show_default();
  command_line.add("--json", options.json_file, "writes all figures here");
}

/// Meshes whose LOD levels are built: the bunny if available, the generated mesh, and a torus with seams.
std::vector<std::pair<std::string, LodGeometry>> build_meshes(const Options& options) {
  std::vector<std::pair<std::string, LodGeometry>> meshes;
  const auto add = [&](const char* name, const Mesh& mesh) {
    meshes.emplace_back(name, test::records_of(test::build_lod(mesh)).geometry());
  };
  if (!options.scenes.empty()) add("bunny", weld_positions(find_packing_input("bunny", options.scenes, 0).mesh));
  add("generated", weld_positions(find_packing_input("generated", options.scenes, options.triangles).mesh));
  const auto around = static_cast<uint32_t>(std::sqrt(static_cast<double>(options.triangles)));
  add("torus", test::half_faceted(test::torus_mesh(around, std::max(3u, around / 2))));
  return meshes;
}

int run(int argc, char** argv) {
  Options options;
  BenchmarkOptions command_line{
      "Shares BLASes of levels of detail between instances by several schemes, and says what is built, what is "
      "traced and how long the choice takes; see docs/lod_runtime.md."};
  add_options(command_line, options);
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  FiguresFile figures(options.json_file);
  Json json = describe_machine();
  const auto meshes = build_meshes(options);
  const auto count = [&](uint32_t instances) { return std::max(1u, static_cast<uint32_t>(options.scale * instances)); };
  for (const auto& [name, mesh] : meshes) {
    if (name == "torus") continue; // used only among the 500 geometries
    for (const SceneCase& scene :
         {SceneCase{"2,000 instances, +-10 diagonals", count(2000), 1, 10.0, 1.0},
          SceneCase{"2,000 instances, +-40 diagonals", count(2000), 1, 40.0, 1.0},
          SceneCase{"200 instances, +-10 diagonals, scales up to 8 : 1", count(200), 1, 10.0, 8.0}}) {
      SceneCase named = scene;
      named.name = name + ": " + scene.name;
      json["scenes"].push_back(run_scene(named, {&mesh, 1}, options));
    }
  }
  std::vector<LodGeometry> many;
  for (size_t i = 0; i < 500; ++i) many.push_back(meshes[i % meshes.size()].second);
  json["scenes"].push_back(
      run_scene({"58,000 instances of 500 geometries, +-30 diagonals", count(58'000), 500, 30.0, 1.0}, many, options));
  if (options.growth > 0) json["growth"] = run_growth(many, options);
  figures.write(json);
  for (const Json& scene : json["scenes"])
    for (const Json& row : scene["schemes"])
      if (row["under_detailed"].get<uint64_t>() > 0)
        throw Error(ErrorKind::kLimitExceeded, scene["name"].get<std::string>() + ", " +
                                                   row["scheme"].get<std::string>() + ": less detail than the own cut");
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) {
  return packtrace::benchmark_main("lod_sharing_benchmark", packtrace::run, argc, argv);
}
