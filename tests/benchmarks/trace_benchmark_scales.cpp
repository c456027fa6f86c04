#include "tests/benchmarks/trace_benchmark_scales.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/make_tracer.h"
#include "tests/benchmarks/trace_benchmark_embree.h"
#include "tests/benchmarks/trace_benchmark_exact.h"
#include "tests/benchmarks/trace_benchmark_raw.h"
#include "tests/benchmarks/trace_benchmark_rays.h"

namespace packtrace {
namespace {

using Json = nlohmann::ordered_json;

/// Scales all sizes and distances of a scene.
/// @param scale a power of two
Scene scaled(Scene scene, double scale) {
  const auto by = static_cast<float>(scale);
  for (Mesh& mesh : scene.meshes)
    for (Vec3& p : mesh.positions) p *= by;
  const auto move = [&](std::vector<Shape>& shapes) {
    for (Shape& shape : shapes) shape.parent_from_mesh[3] *= scale;
  };
  move(scene.shapes);
  for (Object& object : scene.objects) move(object.shapes);
  for (Instance& instance : scene.instances) instance.world_from_object[3] *= by;
  return scene;
}

struct ScaledSystem {
  const char* name;
  std::unique_ptr<RayTracer> tracer;
};

std::vector<ScaledSystem> make_scaled_systems(const TraceInput& input) {
  std::vector<ScaledSystem> systems;
  systems.push_back({"Embree, rays and triangles in the world", raw_embree(input.source, false)});
  systems.push_back({"Embree robust, likewise", raw_embree(input.source, true)});
  systems.push_back({"embree", make_tracer(input.source, &input.file, {})});
  systems.push_back({"packed", make_tracer(input.source, &input.file, {Backend::kPacked, {}})});
  return systems;
}

/// Transforms rays from one space to the space of a system whose scene is `scale` times as large.
RecordedRays moved_to_scale(RecordedRays rays, const UnitSpace& from, const UnitSpace& to, double scale) {
  const double lengths = to.scale() * scale / from.scale();
  for (Ray& ray : rays.rays) {
    ray.origin = Vec3(to.to_unit(from.from_unit(DVec3(ray.origin)) * scale));
    if (!(ray.tnear <= ray.tfar)) continue;
    ray.tnear = static_cast<float>(ray.tnear * lengths), ray.tfar = static_cast<float>(ray.tfar * lengths);
  }
  return rays;
}

/// Results of one system at one scale, per phase; t in the recorder's space.
std::vector<RayResults> results_at(const RecordedFrame& frame, const UnitSpace& recorded, const RayTracer& tracer,
                                   double scale) {
  std::vector<RayResults> results(frame.phases.size());
  const double lengths = tracer.space().scale() * scale / recorded.scale();
  for (size_t phase = 0; phase < results.size(); ++phase) {
    replay(moved_to_scale(frame.phases[phase], recorded, tracer.space(), scale), tracer, results[phase], false);
    for (RayHit& hit : results[phase].hits) hit.t = static_cast<float>(double{hit.t} / lengths);
  }
  return results;
}

} // namespace

Json measure_scales(const std::string& name, const TraceInputOptions& options, const std::string& camera,
                    ImageSize size, std::span<const double> scales) {
  const Scene scene = load_trace_scene(name, options);
  const TraceInput unscaled(name, bake_trace_scene(scene, name));
  const EmbreeTracer recorder(unscaled.source, {});
  const RecordedFrame frame = record_frame(unscaled.source, recorder, camera, size);
  std::vector<std::vector<RayResults>> expected; // per system and phase
  for (const ScaledSystem& system : make_scaled_systems(unscaled))
    expected.push_back(results_at(frame, recorder.space(), *system.tracer, 1.0));

  fmt::print("\n## {} at other scales: hits that are not those at scale 1, of {} / {} / {} rays\n\n"
             "| scale | system | primary | ao any | ao closest |\n|---|---|---|---|---|\n",
             name, frame.phases[0].count(), frame.phases[1].count(), frame.phases[2].count());
  Json json{{"name", name}, {"rows", Json::array()}};
  for (const double wanted : scales) {
    const double scale = std::exp2(std::round(std::log2(wanted)));
    const TraceInput input(name, bake_trace_scene(scaled(scene, scale), name));
    const std::vector<ScaledSystem> systems = make_scaled_systems(input);
    for (size_t s = 0; s < systems.size(); ++s) {
      const std::vector<RayResults> results = results_at(frame, recorder.space(), *systems[s].tracer, scale);
      Json row{{"scale", scale}, {"system", systems[s].name}};
      fmt::print("| {:.0e} | {} |", wanted, systems[s].name);
      for (size_t phase = 0; phase < results.size(); ++phase) {
        const uint64_t wrong = mismatches(frame.phases[phase], expected[s][phase], results[phase], 1.0);
        row["mismatches"][std::string(frame.phases[phase].name)] = wrong;
        fmt::print(" {} |", wrong);
      }
      fmt::print("\n");
      std::fflush(stdout);
      json["rows"].push_back(std::move(row));
    }
  }
  return json;
}

namespace {

/// A generated mesh, its rays and its tracers.
struct GrowingMesh {
  GrowingMesh(const TraceInputOptions& options, const std::string& camera, ImageSize size)
      : input("mesh", bake_trace_scene(load_trace_scene("mesh", options), "mesh")),
        trees(input.source, {BvhQuality::kMedium, false, false}) {
    const EmbreeTracer recorder(input.source, {});
    frame = record_frame(input.source, recorder, camera, size).phases;
    add("Embree default, 1", direct_embree(trees, EmbreeCall::kSingle), recorder);
    add("Embree default, 16", direct_embree(trees, EmbreeCall::kPacket16), recorder);
    add("Embree default, 1M", direct_embree(trees, EmbreeCall::kStream), recorder);
    add("packed", make_tracer(input.source, &input.file, {Backend::kPacked, {}}), recorder);
  }

  struct System {
    const char* name;
    std::unique_ptr<RayTracer> tracer;
    std::vector<RecordedRays> rays;
  };

  TraceInput input;
  EmbreeTracer trees;
  std::vector<RecordedRays> frame;
  std::vector<System> systems;

private:
  void add(const char* name, std::unique_ptr<RayTracer> tracer, const RayTracer& recorder) {
    const UnitSpace space = tracer->space();
    systems.push_back({name, std::move(tracer), moved(frame, recorder.space(), space)});
  }
};

} // namespace

Json measure_growth(const TraceInputOptions& options, const std::string& camera, ImageSize size, uint32_t repeats,
                    bool cpu_clock) {
  constexpr uint64_t kGrowth = 16;
  TraceInputOptions of_small = options;
  of_small.mesh_triangles /= kGrowth;
  const GrowingMesh small(of_small, camera, size), large(options, camera, size);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  Json json{{"small_triangles", small.input.unique_triangles()},
            {"large_triangles", large.input.unique_triangles()},
            {"rows", Json::array()}};
  fmt::print("\n## mesh of {} triangles against one of {}: time a ray, one thread\n\n"
             "| system | primary | ao any | ao closest |\n|---|---|---|---|\n",
             large.input.unique_triangles(), small.input.unique_triangles());
  for (size_t s = 0; s < small.systems.size(); ++s) {
    Json row{{"system", small.systems[s].name}};
    fmt::print("| {} |", small.systems[s].name);
    for (size_t phase = 0; phase < small.frame.size(); ++phase) {
      std::vector<double> ratios;
      RayResults results;
      const auto time_of_ray = [&](const GrowingMesh& mesh) {
        const RecordedRays& rays = mesh.systems[s].rays[phase];
        return replay(rays, *mesh.systems[s].tracer, results, cpu_clock) / static_cast<double>(rays.count());
      };
      for (uint32_t repeat = 0; repeat <= repeats; ++repeat) { // the first run warms up
        const double before = time_of_ray(small), after = time_of_ray(large);
        if (repeat > 0) ratios.push_back(after / before);
      }
      std::nth_element(ratios.begin(), ratios.begin() + static_cast<ptrdiff_t>(ratios.size() / 2), ratios.end());
      const double ratio = ratios[ratios.size() / 2];
      row["time_ratio"][std::string(small.frame[phase].name)] = ratio;
      fmt::print(" {:.2f} |", ratio);
    }
    fmt::print("\n");
    std::fflush(stdout);
    json["rows"].push_back(std::move(row));
  }
  return json;
}

} // namespace packtrace
