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
#include "runtime/frame/frame_config.h"
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

/// Answers the calls of one thread with the hits that the same calls of another tracer found: what is left is the time
/// that the G-buffer takes.
class RecordedHits final : public RayTracer {
public:
  explicit RecordedHits(const RayTracer& tracer) : tracer_(tracer) {}

  void record() { hits_.clear(), recording_ = true; }
  void replay() { next_ = 0, recording_ = false; }

  std::string_view name() const override { return tracer_.name(); }
  const UnitSpace& space() const override { return tracer_.space(); }
  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override {
    if (recording_) {
      tracer_.closest_hits(rays, ray_class, order, hits);
      hits_.insert(hits_.end(), hits.begin(), hits.end());
    } else {
      std::copy_n(hits_.begin() + static_cast<ptrdiff_t>(next_), hits.size(), hits.begin());
      next_ += hits.size();
    }
  }
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override {
    tracer_.any_hits(rays, ray_class, order, occluded);
  }
  HitSurface resolve(const RayHit& hit) const override { return tracer_.resolve(hit); }
  std::vector<ResidentPart> resident() const override { return tracer_.resident(); }

private:
  const RayTracer& tracer_;
  bool recording_ = true;
  mutable std::vector<RayHit> hits_;
  mutable size_t next_ = 0;
};

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
  GBuffer still, moving, shown; // the last one with the channels of a view of ambient occlusion
  shown.keep_channels(gbuffer_channels({}));
  Progress unseen;
  RecordedHits recorded(*tracer);
  median_cpu_ms({[&] { recorded.record(), trace_primary(source, recorded, now, before, shown, unseen); }}, 1);
  const std::vector<double> ms = median_cpu_ms({[&] { trace(*tracer, rays, hits); },
                                                [&] { trace_primary(source, *tracer, now, now, still, unseen); },
                                                [&] { trace_primary(source, *tracer, now, before, moving, unseen); },
                                                [&] {
                                                  recorded.replay();
                                                  trace_primary(source, recorded, now, before, shown, unseen);
                                                }},
                                               options.repeats);
  const auto seen = std::count_if(hits.begin(), hits.end(), [](const RayHit& hit) { return hit.valid(); });
  fmt::print(
      "{}: {} x {} pixels, {:.1f} % hit\n  rays alone {:.1f} CPU ms; with G-buffer: still {:.1f} ({:.2f} x), "
      "moving {:.1f} ({:.2f} x)\n  G-buffer of a moving view of ambient occlusion from given hits: {:.1f} ns per "
      "pixel\n",
      name, size.width, size.height, 100.0 * static_cast<double>(seen) / static_cast<double>(hits.size()), ms[0], ms[1],
      ms[1] / ms[0], ms[2], ms[2] / ms[0], ms[3] * 1e6 / static_cast<double>(size.pixels()));
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
