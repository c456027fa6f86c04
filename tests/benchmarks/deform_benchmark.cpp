// Bakes generated meshes that move, plays them, and prints sizes, decoding speed, refitting speed and tracing costs,
// each beside those of the same frames baked alone. Usage:
//
//   build/release/bin/deform_benchmark [--mesh cloth|grass] [--triangles N] [--frames N] [--threads N] [--json FILE]

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "compress/bake/bake_scene.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/packed/scene/mesh_motion.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/deforming_meshes.h"

namespace packtrace {
namespace {

constexpr double kFramesPerSecond = 24.0;

struct DeformOptions {
  std::string mesh = "both";
  uint32_t triangles = 400000, frames = 48, group = 8, repeats = 5, samples = 5, rays = 200000;
  size_t threads = 2;
  double max_growth = 1.5;
  std::string json;
};

class GeneratedFrames final : public MeshFrames {
public:
  GeneratedFrames(const test::DeformingMesh& mesh, uint32_t count) : mesh_(mesh), count_(count) {}
  uint32_t count() const override { return count_; }
  std::vector<Vec3> positions(uint32_t frame) const override { return mesh_.positions(frame / kFramesPerSecond); }
  std::string name(uint32_t frame) const override { return "frame " + std::to_string(frame); }

private:
  const test::DeformingMesh& mesh_;
  const uint32_t count_;
};

BakedFile bake_mesh(Mesh mesh, const BakeConfig& config) {
  Scene scene;
  scene.materials.emplace_back();
  scene.meshes.push_back(std::move(mesh));
  scene.shapes.emplace_back(0, 0, false, DAffine(1.0));
  Diagnostics diagnostics;
  Progress progress;
  return BakedFile::from_bytes(bake_to_bytes(scene, config, diagnostics, progress).bytes);
}

/// Rays in world space: from around the mesh, and from its surface.
struct WorldRays {
  std::vector<DVec3> from, to;
};

std::vector<Ray> in_unit_space(const WorldRays& rays, const UnitSpace& space) {
  std::vector<Ray> out(rays.from.size());
  for (size_t i = 0; i < out.size(); ++i) {
    out[i].origin = Vec3(space.to_unit(rays.from[i]));
    out[i].direction = Vec3(space.to_unit(rays.to[i]) - DVec3(out[i].origin));
  }
  return out;
}

WorldRays rays_around(const Bounds& box, uint32_t count) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> along(0.0, 1.0);
  WorldRays rays;
  const DVec3 size = box.extent();
  const auto point = [&] {
    const double x = along(generator), y = along(generator), z = along(generator);
    return DVec3(x, y, z);
  };
  for (uint32_t i = 0; i < count; ++i) { // from a box three times as large to points in the box
    rays.from.push_back(box.lo + size * (point() * 3.0 - 1.0));
    rays.to.push_back(box.lo + size * point());
  }
  return rays;
}

/// Rays that start just above what `rays` hit, in random directions of the side that was hit.
WorldRays rays_above(const PackedTracer& tracer, const WorldRays& rays, double length) {
  const std::vector<Ray> unit = in_unit_space(rays, tracer.space());
  std::vector<RayHit> hits(unit.size());
  tracer.closest_hits(unit, kCameraRays, RayOrder::kIncoherent, hits);
  std::mt19937 generator(2);
  std::normal_distribution<double> normal;
  WorldRays out;
  for (size_t i = 0; i < hits.size(); ++i) {
    const double x = normal(generator), y = normal(generator), z = normal(generator);
    if (!hits[i].valid()) continue;
    const HitSurface hit = tracer.resolve(hits[i]);
    const DVec3 cross = hit.placement->surface_normal *
                        glm::cross(DVec3(hit.vertices[1] - hit.vertices[0]), DVec3(hit.vertices[2] - hit.vertices[0]));
    const DVec3 along = glm::normalize(rays.to[i] - rays.from[i]);
    DVec3 face = glm::normalize(cross), direction = glm::normalize(DVec3(x, y, z));
    if (glm::dot(face, along) > 0.0) face = -face;
    if (glm::dot(direction, face) < 0.0) direction = -direction;
    const DVec3 at = rays.from[i] + (rays.to[i] - rays.from[i]) * double{hits[i].t} + face * (1e-4 * length);
    out.from.push_back(at), out.to.push_back(at + direction * length);
  }
  return out;
}

struct TraceCost {
  double seconds = 0.0, nodes = 0.0, triangles = 0.0;
};

/// Costs of tracing both kinds of rays on this thread; nodes and triangles per ray.
class CostMeter {
public:
  CostMeter(const PackedTracer& tracer, const WorldRays& camera, const WorldRays& ambient)
      : tracer_(tracer), camera_(in_unit_space(camera, tracer.space())),
        ambient_(in_unit_space(ambient, tracer.space())), hits_(camera_.size()), occluded_(ambient_.size()) {
    for (Ray& ray : ambient_) ray.tfar = 1.0f;
  }
  void trace() {
    for (size_t at = 0; at < camera_.size(); at += 1024) {
      const size_t count = std::min<size_t>(1024, camera_.size() - at);
      tracer_.closest_hits({&camera_[at], count}, kCameraRays, RayOrder::kIncoherent, {&hits_[at], count});
    }
    for (size_t at = 0; at < ambient_.size(); at += 1024) {
      const size_t count = std::min<size_t>(1024, ambient_.size() - at);
      tracer_.any_hits({&ambient_[at], count}, kOcclusionRays, RayOrder::kIncoherent, {&occluded_[at], count});
    }
  }
  TraceCost counts() {
    packed::KernelCounters counters;
    tracer_.count_closest(camera_, kCameraRays, hits_, counters);
    tracer_.count_any(ambient_, kOcclusionRays, occluded_, counters);
    const auto rays = static_cast<double>(counters.rays);
    return {0.0, static_cast<double>(counters.node_rays) / rays, static_cast<double>(counters.triangles) / rays};
  }

private:
  const PackedTracer& tracer_;
  std::vector<Ray> camera_, ambient_;
  std::vector<RayHit> hits_;
  std::vector<uint8_t> occluded_;
};

/// Wall time and CPU time of all threads, in seconds. On a busy machine only the latter means something.
struct Cost {
  double wall_s = 0.0, cpu_s = 0.0;
};

template <class Work>
Cost cost_of(const Work& work) {
  const Stopwatch wall;
  const std::clock_t begin = std::clock();
  work();
  return {wall.seconds(), static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC};
}

Cost median_cost(std::vector<Cost> costs) {
  const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
  std::ranges::nth_element(costs, middle, {}, &Cost::wall_s);
  Cost result{middle->wall_s, 0.0};
  std::ranges::nth_element(costs, middle, {}, &Cost::cpu_s);
  result.cpu_s = middle->cpu_s;
  return result;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// Compares the tree of the current frame with that of a file baked from the frame.
nlohmann::json compare_with_alone(const PackedTracer& moving, const PackedTracer& alone, const Bounds& box,
                                  const DeformOptions& options) {
  const WorldRays camera = rays_around(box, options.rays), ambient = rays_above(alone, camera, 0.1 * box.diagonal());
  CostMeter a(moving, camera, ambient), b(alone, camera, ambient);
  std::vector<double> ratios;
  for (uint32_t i = 0; i < options.repeats; ++i) { // in turn, so that both see the same load
    const double mine = cost_of([&] { a.trace(); }).cpu_s;
    ratios.push_back(mine / cost_of([&] { b.trace(); }).cpu_s);
  }
  const TraceCost mine = a.counts(), theirs = b.counts();
  return {{"time_ratio", median(ratios)},
          {"nodes_per_ray", {mine.nodes, theirs.nodes}},
          {"triangles_per_ray", {mine.triangles, theirs.triangles}}};
}

nlohmann::json run_mesh(const std::string& name, const test::DeformingMesh& mesh, const DeformOptions& options) {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kEdgeFraction;
  config.sequence_group = options.group;
  config.sequences.push_back({0, std::make_shared<GeneratedFrames>(mesh, options.frames), kFramesPerSecond, 0});
  const Stopwatch baking;
  const BakedFile file = bake_mesh(mesh.mesh(0.0), config);
  const double bake_s = baking.seconds();
  const PackedSource source(file);
  MeshMotion motion(file);
  const baked::DeformationRecord& record = deformation_records(file.sections().deformation)[0];
  const baked::GeometryRecord& geometry = file.geometries()[record.geometry];
  const double step = PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step();
  const double triangles = geometry.triangle_count, source_vertices = static_cast<double>(record.source_vertices);
  PackedTracer tracer(file, source, motion.geometries(), {.max_growth = options.max_growth});

  BakeConfig alone = config;
  alone.sequences.clear();
  alone.precision_kind = PrecisionKind::kAbsolute, alone.precision = step;
  std::vector<double> growth_ratio, node_ratio, alone_bytes;
  std::vector<Cost> decode, refit;
  uint32_t rebuilt = 0;
  DeformationPlayer player(file, 0);
  nlohmann::json samples = nlohmann::json::array();
  for (uint32_t frame = 1; frame < options.frames; ++frame) {
    decode.push_back(cost_of([&] { player.seek(frame); }));
    refit.push_back(cost_of([&] { rebuilt += tracer.deform(record.geometry, player).rebuilt; }));
    if (frame % std::max(1u, (options.frames - 1) / options.samples) != 0) continue;
    const BakedFile still = bake_mesh(mesh.mesh(frame / kFramesPerSecond), alone);
    const PackedSource still_source(still);
    const PackedTracer still_tracer(still, still_source);
    uint64_t bits = 0;
    for (uint32_t c = 0; c < still.clusters(0).size(); ++c) bits += still.cluster(0, c).stream_bits().positions;
    alone_bytes.push_back(static_cast<double>(bits) / 8.0 / source_vertices);
    nlohmann::json sample = compare_with_alone(tracer, still_tracer, still.world_bounds(), options);
    sample["frame"] = frame;
    growth_ratio.push_back(sample["time_ratio"]);
    node_ratio.push_back(sample["nodes_per_ray"][0].get<double>() / sample["nodes_per_ray"][1].get<double>());
    samples.push_back(sample);
  }
  const Stopwatch jumping;
  std::mt19937 generator(3);
  constexpr uint32_t kJumps = 20;
  for (uint32_t i = 0; i < kJumps; ++i) player.seek(static_cast<double>(generator() % options.frames));
  const double jump_s = jumping.seconds() / kJumps;

  const double bytes = static_cast<double>(record.data_bytes) / record.frame_count / source_vertices;
  const double vertices = record.vertex_count;
  fmt::print("{}: {:.0f} triangles, {:.0f} vertices ({:.0f} as stored), {} frames, groups of {}, {} threads\n", name,
             triangles, source_vertices, vertices, record.frame_count, record.group_frames, options.threads);
  fmt::print("  bake {:.2f} s; grid step {:.3g}; position error {:.3f} steps\n", bake_s, step,
             record.max_position_error / step);
  fmt::print("  bytes per vertex and frame: {:.3f}; floats 12; positions of a frame baked alone {:.3f}\n", bytes,
             median(alone_bytes));
  const Cost decoding = median_cost(decode), refitting = median_cost(refit);
  fmt::print("  next frame decoded at {:.0f} Mvertices/s (stored ones), {:.0f} per second of CPU time; any frame in "
             "{:.1f} ms\n",
             vertices / decoding.wall_s * 1e-6, vertices / decoding.cpu_s * 1e-6, jump_s * 1e3);
  fmt::print("  refit {:.1f} Mtriangles/s, {:.1f} per second of CPU time; {:.2f} ms per frame, {} of {} frames "
             "rebuilt\n",
             triangles / refitting.wall_s * 1e-6, triangles / refitting.cpu_s * 1e-6, refitting.wall_s * 1e3, rebuilt,
             options.frames - 1);
  fmt::print("  rays, one thread, against files baked from the frame: time x {:.3f} (worst {:.3f}), nodes x {:.3f} "
             "(worst {:.3f})\n",
             median(growth_ratio), *std::ranges::max_element(growth_ratio), median(node_ratio),
             *std::ranges::max_element(node_ratio));
  return {
      {"mesh", name},
      {"triangles", triangles},
      {"bytes_per_vertex_frame", bytes},
      {"alone_bytes_per_vertex", median(alone_bytes)},
      {"decode_mvertices_s", {{"wall", vertices / decoding.wall_s * 1e-6}, {"cpu", vertices / decoding.cpu_s * 1e-6}}},
      {"refit_mtriangles_s",
       {{"wall", triangles / refitting.wall_s * 1e-6}, {"cpu", triangles / refitting.cpu_s * 1e-6}}},
      {"rebuilt", rebuilt},
      {"position_error_steps", record.max_position_error / step},
      {"samples", samples}};
}

int run_deform_benchmark(int argc, char** argv) {
  DeformOptions options;
  BenchmarkOptions command_line("Plays deforming meshes from packed streams");
  command_line.add("--mesh", options.mesh, "cloth, grass or both").one_of({"cloth", "grass", "both"});
  command_line.add("--triangles", options.triangles).range(500u, 20000000u);
  command_line.add("--frames", options.frames).range(2u, 10000u);
  command_line.add("--group", options.group).range(1u, 64u);
  command_line.add("--threads", options.threads).range(1, 1024);
  command_line.add("--repeats", options.repeats).range(1u, 100u);
  command_line.add("--samples", options.samples, "Frames that are also baked alone").range(1u, 1000u);
  command_line.add("--rays", options.rays).range(100u, 10000000u);
  command_line.add("--max-growth", options.max_growth, "DeformConfig::max_growth").range(1.0, 4.0);
  command_line.add("--json", options.json, "Also write the figures to this file");
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  FiguresFile figures(options.json);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, options.threads);
  nlohmann::json json = nlohmann::json::array();
  if (options.mesh != "grass")
    json.push_back(run_mesh("cloth", test::Cloth(static_cast<uint32_t>(std::sqrt(options.triangles / 2.0))), options));
  if (options.mesh != "cloth") json.push_back(run_mesh("grass", test::Grass(options.triangles / 5), options));
  figures.write(json);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) {
  return packtrace::benchmark_main("deform_benchmark", packtrace::run_deform_benchmark, argc, argv);
}
