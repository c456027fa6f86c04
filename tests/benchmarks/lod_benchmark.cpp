// Measures LOD levels: build time, stated and measured distance from the source, and the simplifier compared with
// meshoptimizer's and OpenMesh's. Documented in docs/cluster_lod.md.

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "compress/bake/lod/cluster_lod.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/progress.h"
#include "runtime/commands/cli/large_heaps.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/lod_benchmark_groups.h"
#include "tests/benchmarks/lod_benchmark_newest.h"
#include "tests/benchmarks/lod_benchmark_simplifiers.h"
#include "tests/benchmarks/packing_benchmark_machine.h"
#include "tests/benchmarks/packing_benchmark_mesh.h"
#include "tests/compress/lod/lod_class_meshes.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/lod/surface_distance.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Options {
  PackingInputs inputs;
  fs::path json_file;
  size_t samples = 500'000;
  uint32_t repeats = 3;
  bool simplifiers = true;
  bool levels = true;
  std::vector<std::string> classes; ///< or names of their meshes
  fs::path newest;                  ///< node_modules/meshoptimizer; empty: left out
};

struct Times {
  double cpu = 0.0, wall = 0.0; ///< seconds
};

template <typename Call>
Times timed(const Call& call) {
  const auto wall = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  call();
  return {static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count()};
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

double diagonal(const std::vector<DVec3>& positions) {
  DVec3 lo(1e300), hi(-1e300);
  for (const DVec3& p : positions) lo = glm::min(lo, p), hi = glm::max(hi, p);
  return glm::length(hi - lo);
}

std::vector<DVec3> lattice_points(const QuantizedGeometry& geometry, const std::vector<LatticePoint>& positions) {
  std::vector<DVec3> points;
  for (const LatticePoint& q : positions) {
    DVec3 p;
    for (size_t axis = 0; axis < 3; ++axis)
      p[static_cast<int>(axis)] = static_cast<double>(q[axis] - geometry.origin[axis]);
    points.push_back(p);
  }
  return points;
}

/// Distance between two surfaces, in both directions; lattice steps.
struct Distance {
  double rms = 0.0, max = 0.0;
};
Distance between(const BareMesh& a, const SurfaceDistance& to_a, const BareMesh& b, const SurfaceDistance& to_b,
                 size_t samples) {
  const DistanceStats from_a = surface_distance(a.positions, a.triangles, to_b, samples);
  const DistanceStats from_b = surface_distance(b.positions, b.triangles, to_a, samples);
  return {std::max(from_a.rms, from_b.rms), std::max(from_a.max, from_b.max)};
}

/// Number of triangles of the cut for an error limit: the cost that users pay for it.
uint64_t cut_triangles(const ClusterLod& lod, double error) {
  uint64_t count = 0;
  for (const uint32_t c : test::cut_clusters(lod, error)) count += lod.clusters[c].range.triangle_count;
  return count;
}

Json measure_cuts(const ClusterLod& lod, double size) {
  Json cuts = Json::array();
  const auto all = static_cast<double>(cut_triangles(lod, 0.0));
  fmt::print("\nCuts, triangles by the error allowed (% of diagonal):");
  for (const double percent : {0.03, 0.1, 0.3, 1.0, 3.0, 10.0}) {
    const uint64_t triangles = cut_triangles(lod, percent / 100 * size);
    fmt::print(" {}: {} ({:.2f} %)", percent, triangles, 100 * static_cast<double>(triangles) / all);
    cuts.push_back({{"error", percent / 100}, {"triangles", triangles}});
  }
  const uint64_t coarsest = cut_triangles(lod, std::numeric_limits<double>::max());
  fmt::print(" any: {} ({:.3f} %)\n", coarsest, 100 * static_cast<double>(coarsest) / all);
  cuts.push_back({{"error", nullptr}, {"triangles", coarsest}});
  return cuts;
}

Json measure_levels(const test::BuiltLod& built, const Options& options) {
  const ClusterLod& lod = built.lod;
  BareMesh base, level_mesh;
  base.positions = lattice_points(built.geometry, lod.positions);
  for (const LodCluster& c : lod.clusters)
    if (c.level == 0) append_points(lod, c, base.triangles);
  level_mesh.positions = base.positions;
  const SurfaceDistance to_base(base.positions, base.triangles);
  const double size = diagonal(base.positions);

  Json levels = Json::array();
  GroupSurfaces groups(lod, base.positions);
  std::vector<double> all_ratios, all_ratios_to_largest;
  double stated = 0.0; // largest error of all groups up to this level
  fmt::print(
      "\n| level | triangles | clusters | terminal groups | stated error, median / largest (% of diagonal) | measured "
      "rms / largest | stated : measured, all / median group / the same, largest below counted "
      "|\n|---|---|---|---|---|---|---|\n");
  for (uint32_t level = 0; level < lod.level_count; ++level) {
    level_mesh.triangles.clear();
    uint64_t clusters = 0, terminal = 0;
    for (const LodCluster& c : lod.clusters)
      if (c.level == level || (c.level < level && lod.groups[c.group].terminal))
        append_points(lod, c, level_mesh.triangles), ++clusters;
    std::vector<double> errors;
    for (const LodGroup& g : lod.groups) {
      if (g.level == level) terminal += g.terminal;
      if (g.level + 1 == level && !g.terminal) errors.push_back(g.error);
    }
    for (const double e : errors) stated = std::max(stated, e);
    const SurfaceDistance to_level(level_mesh.positions, level_mesh.triangles);
    const Distance d = level == 0 ? Distance{} : between(base, to_base, level_mesh, to_level, options.samples);
    const std::vector<double> ratios = groups.ratios(level);
    const std::vector<double> ratios_to_largest = groups.ratios_to_largest(level);
    const double ratio = median(ratios), ratio_to_largest = median(ratios_to_largest);
    all_ratios.insert(all_ratios.end(), ratios.begin(), ratios.end());
    all_ratios_to_largest.insert(all_ratios_to_largest.end(), ratios_to_largest.begin(), ratios_to_largest.end());
    fmt::print("| {} | {} | {} | {} | {:.4f} / {:.4f} | {:.4f} / {:.4f} | {:.2f} / {:.2f} / {:.2f} |\n", level,
               level_mesh.triangles.size(), clusters, terminal, 100 * median(errors) / size, 100 * stated / size,
               100 * d.rms / size, 100 * d.max / size, d.max > 0.0 ? stated / d.max : 1.0, ratio, ratio_to_largest);
    levels.push_back({{"triangles", level_mesh.triangles.size()},
                      {"clusters", clusters},
                      {"terminal_groups", terminal},
                      {"median_stated_error", median(errors) / size},
                      {"stated_error", stated / size},
                      {"measured_rms", d.rms / size},
                      {"measured_max", d.max / size},
                      {"median_group_stated_to_measured", ratio},
                      {"median_group_stated_to_largest_measured_below", ratio_to_largest}});
  }
  const auto largest = [](const std::vector<double>& ratios) {
    return ratios.empty() ? 1.0 : *std::max_element(ratios.begin(), ratios.end());
  };
  fmt::print(
      "\nStated : measured, median of all {} groups: {:.2f}, largest below counted {:.2f}; of the worst group: {:.2f}, "
      "{:.2f}\n",
      all_ratios.size(), median(all_ratios), median(all_ratios_to_largest), largest(all_ratios),
      largest(all_ratios_to_largest));
  return {{"levels", std::move(levels)},
          {"largest_group_excess", groups.excess() / size},
          {"groups_stated_to_measured", median(all_ratios)},
          {"groups_stated_to_largest_measured_below", median(all_ratios_to_largest)},
          {"worst_group_stated_to_measured", largest(all_ratios)},
          {"worst_group_stated_to_largest_measured_below", largest(all_ratios_to_largest)},
          {"cuts", measure_cuts(lod, size)}};
}

Json measure_simplifiers(const test::BuiltLod& built, const Options& options) {
  BareMesh base;
  base.positions = lattice_points(built.geometry, built.geometry.positions);
  for (const Triangle& t : built.geometry.triangles)
    base.triangles.emplace_back(built.geometry.vertices[t.x].position, built.geometry.vertices[t.y].position,
                                built.geometry.vertices[t.z].position);
  const SurfaceDistance to_base(base.positions, base.triangles);
  const double size = diagonal(base.positions);
  struct Simplifier {
    const char* name;
    std::function<SimplifierResult(const BareMesh&, uint32_t)> run;
  };
  std::vector<Simplifier> simplifiers = {{"packtrace", simplify_with_packtrace},
                                         {"meshoptimizer", simplify_with_meshoptimizer},
                                         {"OpenMesh", simplify_with_openmesh}};
  if (!options.newest.empty())
    simplifiers.push_back({"meshoptimizer, newest", [&](const BareMesh& mesh, uint32_t target) {
                             return simplify_with_newest_meshoptimizer(mesh, target, options.newest);
                           }});
  Json rows = Json::array();
  fmt::print("\n| the whole mesh, one thread | kept | triangles | rms (% of diagonal) | largest | Mtri/s "
             "|\n|---|---|---|---|---|---|\n");
  for (const double kept : {0.5, 0.1, 0.01})
    for (const Simplifier& s : simplifiers) {
      const auto target = static_cast<uint32_t>(kept * static_cast<double>(base.triangles.size()));
      const SimplifierResult r = s.run(base, target);
      if (r.mesh.triangles.empty()) {
        fmt::print("| {} | {} % | does not take the mesh | | | |\n", s.name, 100 * kept);
        continue;
      }
      const Distance d =
          between(base, to_base, r.mesh, SurfaceDistance(r.mesh.positions, r.mesh.triangles), options.samples);
      const double speed = r.seconds > 0.0 ? static_cast<double>(base.triangles.size()) / r.seconds * 1e-6 : 0.0;
      fmt::print("| {} | {} % | {}{} | {:.5f} | {:.4f} | {:.2f} |\n", s.name, 100 * kept, r.mesh.triangles.size(),
                 r.lost_triangles > 0 ? fmt::format(" ({} not taken)", r.lost_triangles) : "", 100 * d.rms / size,
                 100 * d.max / size, speed);
      rows.push_back({{"simplifier", s.name},
                      {"kept", kept},
                      {"triangles", r.mesh.triangles.size()},
                      {"lost_triangles", r.lost_triangles},
                      {"rms", d.rms / size},
                      {"max", d.max / size},
                      {"mtri_per_s", speed}});
    }
  return rows;
}

Json measure_input(const std::string& name, const Mesh& mesh, const Options& options) {
  test::BuiltLod built;
  fmt::print("\n## {}\n\n", name);
  Json json{{"name", name}, {"triangles", mesh.triangles.size()}};
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    built = test::build_lod(mesh);
  }
  const auto triangles = static_cast<double>(built.base.triangles.size());
  std::array<std::vector<double>, 2> walls, cpus; // of one and of two threads, in turn
  for (uint32_t repeat = 0; repeat < options.repeats; ++repeat)
    for (const size_t threads : {size_t{1}, size_t{2}}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const Times times = timed([&] {
        Progress progress;
        built.lod = build_cluster_lod(built.geometry, built.base, progress);
      });
      walls[threads - 1].push_back(times.wall), cpus[threads - 1].push_back(times.cpu);
    }
  for (const size_t threads : {size_t{1}, size_t{2}}) {
    const double wall = median(walls[threads - 1]), cpu = median(cpus[threads - 1]);
    fmt::print("{} threads: {:.2f} Mtri/s of wall time, {:.2f} of CPU time\n", threads, triangles / wall * 1e-6,
               triangles / cpu * 1e-6);
    json["build"].push_back({{"threads", threads}, {"wall_s", wall}, {"cpu_s", cpu}});
  }
  if (options.levels) json.update(measure_levels(built, options));
  if (options.levels && options.simplifiers) json["simplifiers"] = measure_simplifiers(built, options);
  return json;
}

int run(int argc, char** argv) {
  prepare_heaps(); // as the program does
  Options options;
  BenchmarkOptions command_line{
      "Builds levels of detail and measures them, and simplifies with this project and others; see "
      "docs/cluster_lod.md."};
  options.inputs.add_to(command_line);
  command_line.add("--samples", options.samples, "points at which surfaces are compared, each way").show_default();
  command_line.add("--repeats", options.repeats, "builds per number of threads; medians are printed")
      .range(1u, 1000u)
      .show_default();
  command_line.flag("!--levels-only", options.simplifiers, "leaves the other programs' simplifiers out");
  command_line.flag("!--times-only", options.levels, "only builds, and measures no distance");
  std::vector<std::string> class_names = {"all"};
  for (const test::ClassMesh& mesh : test::class_meshes())
    class_names.push_back(mesh.of_class), class_names.push_back(mesh.name);
  command_line
      .add("--class", options.classes, "measures generated meshes of a class that is hard to simplify, or one of them")
      .one_of(class_names);
  command_line
      .add("--newest-meshoptimizer", options.newest,
           "folder of the npm package (node_modules/meshoptimizer), to compare with it too; needs node")
      .existing_folder();
  command_line.add("--json", options.json_file, "writes all figures here");
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  if (options.classes.empty() || !options.inputs.names.empty()) options.inputs.choose();
  FiguresFile figures(options.json_file);
  Json json = describe_machine();
  for (const std::string& name : options.inputs.names)
    json["inputs"].push_back(measure_input(name, weld_positions(options.inputs.find(name).mesh), options));
  for (const test::ClassMesh& mesh : test::class_meshes()) {
    const auto is_wanted = [&](const std::string& name) {
      return name == "all" || name == mesh.of_class || name == mesh.name;
    };
    if (std::ranges::none_of(options.classes, is_wanted)) continue;
    json["inputs"].push_back(measure_input(mesh.name, weld_positions(mesh.make()), options));
    json["inputs"].back()["class"] = mesh.of_class;
  }
  figures.write(json);
  for (const Json& input : json["inputs"]) {
    if (input.value("largest_group_excess", 0.0) > 1e-9)
      throw Error(ErrorKind::kLimitExceeded,
                  input["name"].get<std::string>() + ": a group is further from the source than it says");
    for (const Json& level : input.value("levels", Json::array()))
      if (level["measured_max"].get<double>() > level["stated_error"].get<double>() * (1.0 + 1e-6) + 1e-9)
        throw Error(ErrorKind::kLimitExceeded,
                    input["name"].get<std::string>() + ": a level is further from the source than it says");
  }
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("lod_benchmark", packtrace::run, argc, argv); }
