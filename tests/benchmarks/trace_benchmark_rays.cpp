#include "tests/benchmarks/trace_benchmark_rays.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>
#include <limits>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/base/error.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/stopwatch.h"
#include "tests/benchmarks/trace_benchmark_exact.h"

namespace packtrace {
namespace {

class Clock {
public:
  explicit Clock(bool cpu) : cpu_(cpu) {}
  double seconds() const {
    return cpu_ ? static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC : wall_.seconds();
  }

private:
  bool cpu_;
  std::clock_t start_ = std::clock();
  Stopwatch wall_;
};

/// Forwards rays to another tracer and records them. Not thread-safe.
class RecordingTracer final : public RayTracer {
public:
  RecordingTracer(const RayTracer& tracer, RecordedRays& out) : tracer_(tracer), out_(out) {}
  std::string_view name() const override { return tracer_.name(); }
  const UnitSpace& space() const override { return tracer_.space(); }
  HitSurface resolve(const RayHit& hit) const override { return tracer_.resolve(hit); }
  std::vector<ResidentPart> resident() const override { return tracer_.resident(); }

  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override {
    record(rays, ray_class, order, false);
    tracer_.closest_hits(rays, ray_class, order, hits);
  }
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override {
    record(rays, ray_class, order, true);
    tracer_.any_hits(rays, ray_class, order, occluded);
  }

private:
  void record(std::span<const Ray> rays, uint32_t ray_class, RayOrder order, bool any) const {
    out_.ray_class = ray_class, out_.order = order, out_.any = any;
    out_.rays.insert(out_.rays.end(), rays.begin(), rays.end());
    out_.ends.push_back(out_.rays.size());
  }

  const RayTracer& tracer_;
  RecordedRays& out_;
};

bool differ(const Ray& ray, const RayHit& a, const RayHit& b, double t_scale) {
  if (a.valid() != b.valid()) return true;
  if (!a.valid()) return false;
  const double ta = double(a.t), tb = double(b.t) * t_scale;
  return std::abs(ta - tb) > t_tolerance(ray, std::max(ta, tb));
}

Camera choose_camera(const SceneSource& source, const std::string& camera, ImageSize size) {
  if (camera == "auto" || (camera == "0" && source.cameras().empty()))
    return framing_camera(source.world_bounds(), size, source.cameras());
  uint32_t index = 0;
  const char* const end = camera.data() + camera.size();
  if (std::from_chars(camera.data(), end, index).ptr != end || index >= source.cameras().size())
    throw Error(ErrorKind::kUsage, "--camera " + camera + ": there is no such camera");
  return source.cameras()[index];
}

std::vector<RecordedRays> record_phases(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera,
                                        float ao_radius) {
  // One thread keeps tiles in order.
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<RecordedRays> frame(3);
  frame[0].name = "primary", frame[1].name = "ao any", frame[2].name = "ao closest";
  Progress progress;
  GBuffer gbuffer;
  trace_primary(source, RecordingTracer(tracer, frame[0]), camera, camera, gbuffer, progress);
  AoConfig config;
  config.radius = ao_radius;
  AoFrame ao;
  for (const bool falloff : {false, true}) {
    config.falloff = falloff;
    trace_ao(source, RecordingTracer(tracer, frame[falloff ? 2 : 1]), gbuffer, config, 0, ao, progress);
  }
  return frame;
}

} // namespace

uint64_t RecordedRays::count() const {
  return static_cast<uint64_t>(std::count_if(rays.begin(), rays.end(), [](const Ray& ray) { return !is_gap(ray); }));
}

RecordedFrame record_frame(const SceneSource& source, const RayTracer& tracer, const std::string& camera,
                           ImageSize size) {
  RecordedFrame frame{
      PrimaryCamera(choose_camera(source, camera, size), size), ao_radius({}, source.world_bounds()), {}};
  frame.phases = record_phases(source, tracer, frame.camera, frame.ao_radius);
  if (frame.phases[1].count() == 0 && camera == "0") { // the camera looks past the scene
    frame.camera = PrimaryCamera(framing_camera(source.world_bounds(), size, source.cameras()), size);
    frame.phases = record_phases(source, tracer, frame.camera, frame.ao_radius);
  }
  if (frame.phases[1].count() == 0) throw Error(ErrorKind::kInput, "the camera sees nothing");
  return frame;
}

std::vector<double> time_passes(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera,
                                float ao_radius, uint32_t repeats, bool cpu_clock) {
  std::vector<double> least(3, std::numeric_limits<double>::infinity());
  Progress progress;
  GBuffer gbuffer;
  AoConfig config;
  config.radius = ao_radius;
  AoFrame ao;
  for (uint32_t repeat = 0; repeat <= repeats; ++repeat) { // the first run allocates memory
    const auto take = [&](size_t phase, const auto& pass) {
      const Clock watch(cpu_clock);
      pass();
      if (repeat > 0) least[phase] = std::min(least[phase], watch.seconds());
    };
    take(0, [&] { trace_primary(source, tracer, camera, camera, gbuffer, progress); });
    config.falloff = false;
    take(1, [&] { trace_ao(source, tracer, gbuffer, config, 0, ao, progress); });
    config.falloff = true;
    take(2, [&] { trace_ao(source, tracer, gbuffer, config, 0, ao, progress); });
  }
  return least;
}

std::vector<RecordedRays> moved(std::vector<RecordedRays> recorded, const UnitSpace& from, const UnitSpace& to) {
  if (from == to) return recorded;
  const double scale = to.scale() / from.scale();
  for (RecordedRays& phase : recorded)
    for (Ray& ray : phase.rays) {
      ray.origin = Vec3(to.to_unit(from.from_unit(DVec3(ray.origin))));
      if (is_gap(ray)) continue;
      ray.tnear = static_cast<float>(ray.tnear * scale), ray.tfar = static_cast<float>(ray.tfar * scale);
    }
  return recorded;
}

double replay(const RecordedRays& recorded, const RayTracer& tracer, RayResults& results, bool cpu_clock) {
  if (recorded.any)
    results.occluded.resize(recorded.rays.size());
  else
    results.hits.resize(recorded.rays.size());
  const Clock watch(cpu_clock);
  tbb::parallel_for(size_t{0}, recorded.ends.size(), [&](size_t i) {
    const size_t first = i == 0 ? 0 : recorded.ends[i - 1], count = recorded.ends[i] - first;
    const std::span rays(recorded.rays.data() + first, count);
    if (recorded.any)
      tracer.any_hits(rays, recorded.ray_class, recorded.order, {results.occluded.data() + first, count});
    else
      tracer.closest_hits(rays, recorded.ray_class, recorded.order, {results.hits.data() + first, count});
  });
  return watch.seconds();
}

uint64_t mismatches(const RecordedRays& recorded, const RayResults& a, const RayResults& b, double t_scale) {
  uint64_t count = 0;
  for (size_t i = 0; i < recorded.rays.size(); ++i)
    count += recorded.any ? a.occluded[i] != b.occluded[i] : differ(recorded.rays[i], a.hits[i], b.hits[i], t_scale);
  return count;
}

} // namespace packtrace
