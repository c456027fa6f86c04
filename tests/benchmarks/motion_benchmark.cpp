// Instances that move: place_instances() against making the tracer anew, and rays among moved instances against rays
// through a tree that was built for their places.

#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/packing_benchmark_machine.h"
#include "tests/benchmarks/trace_benchmark_inputs.h"
#include "tests/benchmarks/trace_benchmark_rays.h"
#include "tests/runtime/trace/moving_scenes.h"

namespace packtrace {
namespace {

struct MotionOptions {
  std::string scene = "town";
  uint32_t frames = 20;
  uint32_t repeats = 15;
  ImageSize size{480, 270};
  size_t threads = 2;
};

double median_of(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// The instances that do not share the tree of the world.
std::vector<uint32_t> free_instances(const TraceInput& input) {
  const PackedTracer tracer(input.file, input.source);
  std::vector<uint8_t> in_world(input.source.geometry_count(), 0);
  for (uint32_t g = 0; g < input.source.geometry_count(); ++g) in_world[g] = 1;
  for (const baked::TreeRecord& tree : tracer.tree_records())
    if (tree.geometry < in_world.size()) in_world[tree.geometry] = 0;
  std::vector<uint32_t> result;
  for (uint32_t i = 0; i < input.source.instances().size(); ++i)
    if (in_world[input.source.instances()[i].geometry] == 0) result.push_back(i);
  return result;
}

/// Every n-th of the instances, so that there are about `count`.
std::vector<uint32_t> some_of(const std::vector<uint32_t>& instances, size_t count) {
  std::vector<uint32_t> result;
  for (size_t i = 0; i < std::min(count, instances.size()); ++i)
    result.push_back(instances[i * instances.size() / count]);
  return result;
}

/// Places at a time: each instance turns about its own vertical axis and circles around its place.
std::vector<Affine> places(const SceneSource& source, std::span<const uint32_t> instances, double time, double radius) {
  std::vector<Affine> result;
  for (const uint32_t i : instances) {
    const double phase = time * (1.0 + i % 7) + i;
    DAffine place(source.instances()[i].world_from_object);
    const DVec3 at = place[3];
    place[3] = DVec3(0.0);
    const DVec3 circle(radius * std::cos(phase), 0.0, radius * std::sin(phase));
    const DAffine turn = test::placed(DVec3(0.0), DVec3(1.0), 60.0 * time);
    place = compose(turn, place);
    place[3] = at + circle;
    result.push_back(Affine(place));
  }
  return result;
}

struct Timing {
  double place_ms = 0.0, anew_ms = 0.0;
  double ray_ratio = 0.0; ///< time of any-hit rays after the moves, per time in a new tracer without movers
  uint64_t different = 0; ///< rays
};

/// Times frames of a backend. Rays are those of the first frame.
Timing time_motion(const TraceInput& input, Backend backend, const Movers& movers, std::span<const uint32_t> moving,
                   const MotionOptions& options, double radius) {
  TracerConfig config, still;
  config.backend = still.backend = backend;
  config.movers = movers;
  const auto tracer = make_tracer(input.source, &input.file, config);
  std::vector<double> placing, anew, ratios;
  std::vector<Affine> now = test::transforms_of(input.source);
  for (uint32_t frame = 1; frame <= options.frames; ++frame) {
    const std::vector<Affine> moved = places(input.source, moving, 0.05 * frame, radius);
    const Stopwatch watch;
    tracer->place_instances(moving, moved);
    placing.push_back(watch.seconds());
    for (size_t i = 0; i < moving.size(); ++i) now[moving[i]] = moved[i];
  }
  const test::MovedSource there(input.source, now);
  for (int repeat = 0; repeat < 3; ++repeat) {
    const Stopwatch watch;
    const auto again = make_tracer(there, &input.file, config);
    anew.push_back(watch.seconds());
  }
  // A tracer without movers builds its tree as slowly and as well as it can.
  const auto fresh = make_tracer(there, &input.file, still);
  const RecordedFrame of_moved = record_frame(there, *tracer, "0", options.size);
  const auto of_fresh = packtrace::moved(of_moved.phases, tracer->space(), fresh->space());
  uint64_t different = 0;
  for (size_t p = 0; p < of_fresh.size(); ++p) {
    if (!of_fresh[p].any) continue;
    RayResults a, b;
    for (uint32_t repeat = 0; repeat < options.repeats; ++repeat) {
      const double moved_s = replay(of_moved.phases[p], *tracer, a, false),
                   fresh_s = replay(of_fresh[p], *fresh, b, false);
      ratios.push_back(moved_s / fresh_s);
    }
    different += mismatches(of_moved.phases[p], a, b, tracer->space().scale() / fresh->space().scale());
  }
  return {1e3 * median_of(placing), 1e3 * median_of(anew), median_of(ratios), different};
}

nlohmann::ordered_json measure(const TraceInput& input, const MotionOptions& options) {
  Movers movers{free_instances(input), input.source.world_bounds()};
  const double radius = 0.005 * movers.world.diagonal();
  movers.world.lo -= DVec3(2.0 * radius), movers.world.hi += DVec3(2.0 * radius);
  fmt::print("{}: {} of {} instances may move; {} threads, {} frames\n", input.name, movers.instances.size(),
             input.source.instances().size(), options.threads, options.frames);
  fmt::print("{:>8} {:>7} {:>10} {:>10} {:>15} {:>15}\n", "backend", "moving", "place, ms", "anew, ms", "any-hit time",
             "different rays");
  nlohmann::ordered_json figures;
  for (const Backend backend : {Backend::kPacked, Backend::kEmbree})
    for (const size_t count : {size_t{500}, movers.instances.size()}) {
      const std::vector<uint32_t> moving = some_of(movers.instances, count);
      const Timing t = time_motion(input, backend, movers, moving, options, radius);
      const char* name = backend == Backend::kPacked ? "packed" : "embree";
      fmt::print("{:>8} {:>7} {:>10.3f} {:>10.2f} {:>15.3f} {:>15}\n", name, moving.size(), t.place_ms, t.anew_ms,
                 t.ray_ratio, t.different);
      figures.push_back({{"backend", name},
                         {"moving", moving.size()},
                         {"place_ms", t.place_ms},
                         {"anew_ms", t.anew_ms},
                         {"any_hit_time_ratio", t.ray_ratio},
                         {"different_rays", t.different}});
      if (backend == Backend::kPacked && t.different > 0)
        throw Error(ErrorKind::kLimitExceeded, "rays among moved instances differ from those of a new tracer");
    }
  return figures;
}

int run(int argc, char** argv) {
  MotionOptions options;
  std::string json_file;
  BenchmarkOptions command_line{
      "Times RayTracer::place_instances(), and rays among moved instances against those of a new tracer."};
  command_line.add("--frames", options.frames, "moves, of which the median counts").show_default().range(1, 10000);
  command_line.add("--width", options.size.width, "pixels").show_default();
  command_line.add("--height", options.size.height, "pixels").show_default();
  command_line.add("--repeats", options.repeats, "of rays, of which the median counts").show_default().range(1, 1000);
  command_line.add("--threads", options.threads).show_default().range(1, 1024);
  command_line.add("--json", json_file, "writes all figures here");
  command_line.add("INPUT", options.scene, "as for trace_benchmark").show_default();
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  FiguresFile file(json_file);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, options.threads);
  nlohmann::json json = describe_machine();
  const std::unique_ptr<TraceInput> input = load_trace_input(options.scene, {});
  json["figures"] = measure(*input, options);
  file.write(json);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("motion_benchmark", packtrace::run, argc, argv); }
