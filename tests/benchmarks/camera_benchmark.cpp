// Compares the camera rays of a frame, with all that the G-buffer holds, with tracing the same rays alone.

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/world_view.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/camera/tiles.h"
#include "runtime/frame/camera_path.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/thread_cpu_time.h"

namespace packtrace {
namespace {

struct Options {
  std::vector<std::string> files;
  uint32_t width = 960, height = 540, repeats = 9;
};

/// The rays of an image in blocks of 4 x 4 pixels. Unlike trace_primary(), it leaves the origins of distant cameras
/// alone.
std::vector<Ray> camera_rays(const PrimaryCamera& camera, const UnitSpace& space) {
  constexpr uint32_t kBlock = 4;
  std::vector<Ray> rays;
  for (uint32_t y = 0; y + kBlock <= camera.size().height; y += kBlock)
    for (uint32_t x = 0; x + kBlock <= camera.size().width; x += kBlock)
      for (uint32_t i = 0; i < kBlock * kBlock; ++i) {
        const CameraRay ray = camera.ray(x + i % kBlock, y + i / kBlock);
        rays.push_back(
            {Vec3(space.to_unit(ray.origin)), 0.0f, Vec3(ray.direction), std::numeric_limits<float>::infinity()});
      }
  return rays;
}

/// Traces rays as PrimaryTracer does: 128 at a time.
void trace(const RayTracer& tracer, const std::vector<Ray>& rays, std::vector<RayHit>& hits) {
  constexpr size_t kBatch = 128;
  hits.resize(rays.size());
  for (size_t i = 0; i < rays.size(); i += kBatch) {
    const size_t count = std::min(kBatch, rays.size() - i);
    tracer.closest_hits(std::span(rays).subspan(i, count), kCameraRays, RayOrder::kCoherent,
                        std::span(hits).subspan(i, count));
  }
}

void compare(const std::string& name, const Options& options) {
  const BakedFile file = BakedFile::open(name);
  const PackedSource source(file);
  const ImageSize size{options.width, options.height};
  const Camera camera = source.cameras().empty() ? framing_camera(source.world_bounds(), size, source.cameras())
                                                 : source.cameras().front();
  const PrimaryCamera now(camera, size);
  const PrimaryCamera before(
      orbited(camera, source.world_bounds().centre(), estimate_world_view(source.cameras()).up, 0.5), size);
  TracerConfig config;
  config.backend = Backend::kPacked;
  const auto tracer = make_tracer(source, &file, config);
  const std::vector<Ray> rays = camera_rays(now, tracer->space());
  std::vector<RayHit> hits;
  GBuffer still, moving;
  Progress unseen;
  const std::vector<double> ms = median_cpu_ms({[&] { trace(*tracer, rays, hits); },
                                                [&] { trace_primary(source, *tracer, now, now, still, unseen); },
                                                [&] { trace_primary(source, *tracer, now, before, moving, unseen); }},
                                               options.repeats);
  const auto seen = std::count_if(hits.begin(), hits.end(), [](const RayHit& hit) { return hit.valid(); });
  fmt::print("{}: {} x {} pixels, {:.1f} % hit\n  rays alone {:.1f} CPU ms; with G-buffer: still {:.1f} ({:.2f} x), "
             "moving {:.1f} ({:.2f} x)\n",
             name, size.width, size.height, 100.0 * static_cast<double>(seen) / static_cast<double>(hits.size()), ms[0],
             ms[1], ms[1] / ms[0], ms[2], ms[2] / ms[0]);
}

int run(int argc, char** argv) {
  Options options;
  BenchmarkOptions command_line(
      "Compares the camera rays of a frame, with all that the G-buffer holds, with tracing the same rays "
      "alone, by CPU time of one thread");
  command_line.add("FILE", options.files, ".ptk files").required();
  command_line.add("--width", options.width).show_default();
  command_line.add("--height", options.height).show_default();
  command_line.add("--repeats", options.repeats, "Frames to time").show_default();
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  for (const std::string& file : options.files) compare(file, options);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("camera_benchmark", packtrace::run, argc, argv); }
