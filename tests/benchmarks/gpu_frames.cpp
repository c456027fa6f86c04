#include "tests/benchmarks/gpu_frames.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "runtime/frame/frame_loop.h"
#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/kernel.h"
#include "runtime/gpu/shaders/spirv.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/gpu/gpu_tracer.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

/// A kernel that copies.
class CopyFloor {
public:
  explicit CopyFloor(const GpuConfig& config)
      : device_(gpu::Device::share(config)), kernel_(device_, gpu::spirv::copy(), {}, 2, sizeof(uint32_t)) {}

  /// Median time of reading half of the bytes and writing the other half.
  double ms(uint64_t bytes) {
    const gpu::Buffer from(device_, bytes / 2, gpu::BufferPlace::kDevice, "bytes to copy"),
        to(device_, bytes / 2, gpu::BufferPlace::kDevice, "copied bytes");
    device_->fill(from, 1);
    kernel_.bind(0, from), kernel_.bind(1, to);
    const auto vectors = static_cast<uint32_t>(bytes / 32);
    std::vector<double> times;
    for (int i = 0; i < 9; ++i)
      times.push_back(
          device_->run(kernel_, std::as_bytes(std::span(&vectors, 1)), std::clamp(vectors / 256, 1u, 16384u)));
    return median(times);
  }

private:
  std::shared_ptr<gpu::Device> device_;
  gpu::Kernel kernel_;
};

/// Times of some frames.
struct Times {
  std::map<std::string, std::vector<double>> passes;
  std::map<std::string, uint32_t> bytes;
  std::vector<std::string> order;
  std::vector<double> frame, primary, ao, denoise, resolve, passes_together;

  void add(const FrameLoop& loop, const FrameReport& report, const PictureReport& picture, double frame_s) {
    double sum = 0.0;
    for (const DenoiserPassTime& pass : loop.denoiser().pass_times()) {
      if (!passes.contains(pass.name)) order.emplace_back(pass.name);
      passes[pass.name].push_back(pass.ms);
      bytes[pass.name] = pass.bytes_per_pixel;
      sum += pass.ms;
    }
    passes_together.push_back(sum);
    frame.push_back(frame_s * 1e3);
    primary.push_back(report.times.primary_s * 1e3), ao.push_back(report.times.ao_s * 1e3);
    denoise.push_back((report.times.denoise_s + picture.times.denoise_s) * 1e3);
    resolve.push_back((report.times.resolve_s + picture.times.resolve_s) * 1e3);
  }

  Json json(CopyFloor& floor, uint64_t pixels) const {
    Json out{{"frame_ms", median(frame)},     {"primary_ms", median(primary)}, {"ao_ms", median(ao)},
             {"denoise_ms", median(denoise)}, {"resolve_ms", median(resolve)}, {"passes_ms", median(passes_together)}};
    uint64_t together = 0;
    for (const std::string& name : order) {
      const uint64_t of_pass = bytes.at(name);
      together += of_pass;
      Json row{{"pass", name}, {"ms", median(passes.at(name))}, {"bytes_per_pixel", of_pass}};
      if (of_pass > 0) row["copy_ms"] = floor.ms(of_pass * pixels);
      out["passes"].push_back(row);
    }
    out["bytes_per_pixel"] = together;
    if (together > 0) out["copy_ms"] = floor.ms(together * pixels);
    return out;
  }
};

/// How the pictures of two backends differ: the worst frame counts.
struct Differences {
  double worst_rms = 0.0, largest = 0.0;
  uint64_t pixels = 0;          ///< that differ by more than kPixelTolerance, of all frames
  uint64_t fewest_hits = ~0ull; ///< pixels with a surface

  void add(const std::vector<float>& ao, const std::vector<float>& expected, uint64_t hits) {
    double squares = 0.0;
    for (size_t i = 0; i < ao.size(); ++i) {
      const double difference = std::abs(double{ao[i]} - double{expected[i]});
      pixels += difference <= kPixelTolerance ? 0 : 1;
      largest = std::max(largest, difference), squares += difference * difference;
    }
    worst_rms = std::max(worst_rms, std::sqrt(squares / static_cast<double>(std::max<size_t>(ao.size(), 1))));
    fewest_hits = std::min(fewest_hits, hits);
  }
  bool within_limits() const { return fewest_hits > 0 && pixels == 0 && worst_rms <= kRmsTolerance; }
  Json json() const {
    return {{"largest", largest}, {"worst_rms", worst_rms}, {"pixels_above_0.01", pixels}, {"hits", fewest_hits}};
  }

  static constexpr double kPixelTolerance = 0.01, kRmsTolerance = 1e-4;
};

Camera moved(Camera camera, double step) {
  camera.world_from_camera[3] += camera.world_from_camera[0] * step;
  return camera;
}

} // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[values.size() / 2];
}

Json measure_gpu_frames(const BakedFile& file, const PackedSource& source, const Camera& camera, ImageSize size,
                        const GpuConfig& device, uint32_t repeats, bool& within_limits) {
  FrameScene scene{&source, &file, {}};
  scene.backend.backend = Backend::kGpu, scene.backend.gpu = device;
  FrameConfig config;
  config.size = size;
  config.jitter = false;
  config.plain_layers = 0, config.all_channels = false; // as a window that shows ambient occlusion
  FrameLoop loop(scene, config);
  scene.backend.backend = Backend::kPacked;
  FrameLoop packed(scene, config);
  const Bounds world = source.world_bounds();
  const double step = 2e-4 * glm::length(world.hi - world.lo);
  constexpr uint32_t kCompared = 4;
  Times moving, still;
  Progress progress;
  RenderedImage image, expected;
  PictureReport picture;
  Differences of_moving, of_still;
  const auto next = [&](FrameLoop& frames, const Camera& view, RenderedImage& out) {
    picture = {};
    const FrameReport report = frames.next_frame(view, 0.0, progress);
    frames.resolve(out, picture);
    return report;
  };
  const auto compare = [&](const Camera& view, Differences& differences) {
    next(loop, view, image);
    const uint64_t hits = next(packed, view, expected).hit_pixels;
    differences.add(image.ao, expected.ao, hits);
  };
  for (uint32_t f = 0; f < kCompared; ++f) compare(moved(camera, step * f), of_moving);
  loop.reset(), packed.reset(); // so that still frames begin anew in both
  for (uint32_t f = 0; f < kCompared; ++f) compare(camera, of_still);
  // Warms the device up: its clock is low until it has been busy for a while, as it is while a window is open.
  uint32_t f = 0;
  for (const Stopwatch warming; f < 3 || warming.seconds() < 1.0; ++f) next(loop, moved(camera, step * f), image);
  const auto measure = [&](const Camera& view, Times& times) {
    const Stopwatch watch;
    const FrameReport report = next(loop, view, image);
    times.add(loop, report, picture, watch.seconds());
  };
  for (const uint32_t end = f + repeats; f < end; ++f) measure(moved(camera, step * f), moving);
  const Camera last = moved(camera, step * (f - 1));
  for (uint32_t i = 0; i < repeats; ++i) measure(last, still);
  CopyFloor floor(device);
  Json out{{"moving", moving.json(floor, size.pixels())}, {"still", still.json(floor, size.pixels())}};
  out["moving"]["difference"] = of_moving.json(), out["still"]["difference"] = of_still.json();
  within_limits = of_moving.within_limits() && of_still.within_limits();
  return out;
}

Json measure_gpu_placements(const BakedFile& file, const PackedSource& source, const GpuConfig& device,
                            uint32_t repeats) {
  const auto instances = source.instances();
  std::map<uint32_t, uint32_t> uses;
  for (const PlacedGeometry& instance : instances) ++uses[instance.geometry];
  std::vector<size_t> movable; // Geometry that is placed once may be in the world's tree.
  for (size_t i = 0; i < instances.size(); ++i)
    if (uses[instances[i].geometry] > 1) movable.push_back(i);
  if (movable.empty()) return nullptr;
  Movers movers;
  const size_t moving = std::max<size_t>(movable.size() / 100, 1);
  std::vector<Affine> places;
  for (size_t i = 0; i < moving; ++i) {
    const size_t instance = movable[i * movable.size() / moving];
    movers.instances.push_back(static_cast<uint32_t>(instance));
    places.push_back(instances[instance].world_from_object);
  }
  movers.world = source.world_bounds();
  GpuTracer tracer(file, source, device, movers);
  const uint64_t all_bytes = tracer.scene().uploaded_bytes();
  std::vector<double> ms, bytes;
  const float step = static_cast<float>(1e-5 * glm::length(movers.world.hi - movers.world.lo));
  for (uint32_t i = 0; i < repeats; ++i) {
    for (Affine& place : places) place[3].x += step;
    const Stopwatch watch;
    tracer.place_instances(movers.instances, places);
    ms.push_back(watch.seconds() * 1e3);
    bytes.push_back(static_cast<double>(tracer.scene().uploaded_bytes()));
  }
  return {{"instances", instances.size()},
          {"moved", moving},
          {"all_bytes", all_bytes},
          {"uploaded_bytes", median(bytes)},
          {"place_ms", median(ms)}};
}

} // namespace packtrace
