// Measures backend gpu on baked files, and compares every hit with backend packed: camera rays and ambient occlusion
// that the device makes itself. Prints JSON. Needs no files but those given; exit code 5 if a hit differs,
// or if denoised frames differ by more than measure_gpu_frames() allows. With --structures, the driver's acceleration
// structures trace the same rays; how many hits differ is then a result, not a failure. Usage:
// gpu_benchmark FILE.ptk... [--size 1920x1080] [--spp 1 64 256] [--repeats 5] [--device NAME]
// [--only-frames] [--structures]

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/gpu/device_rays.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/gpu/gpu_tracer.h"
#include "runtime/trace/packed/scene/placed_trees.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/gpu_frames.h"
#include "tests/benchmarks/gpu_structures.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

struct Options {
  std::vector<std::string> files;
  std::string size = "1920x1080";
  std::vector<uint32_t> spp{1, 64, 256};
  uint32_t repeats = 5;
  uint32_t camera = 0;
  double radius = 0.1; ///< of the occlusion rays, in diagonals of the world
  GpuConfig gpu;
  bool exact = false, only_walk = false;
  bool only_frames = false;
  bool structures = false;
};

ImageSize parsed_size(const std::string& text) {
  const size_t at = text.find('x');
  return {static_cast<uint32_t>(std::stoul(text.substr(0, at))),
          static_cast<uint32_t>(std::stoul(text.substr(at + 1)))};
}

/// The camera's rays as linear functions of the pixel, in unit space.
gpu::CameraRecord camera_record(const PrimaryCamera& view, const UnitSpace& space) {
  if (view.projection() != Projection::kPerspective)
    throw Error(ErrorKind::kUnsupported, "gpu_benchmark needs a perspective camera");
  const auto on_film = [&](uint32_t x, uint32_t y) {
    const CameraRay ray = view.ray(x, y);
    return ray.direction / view.view_z(ray.origin + ray.direction);
  };
  const ImageSize size = view.size();
  const DVec3 corner = on_film(0, 0), right = (on_film(size.width - 1, 0) - corner) / double(size.width - 1),
              down = (on_film(0, size.height - 1) - corner) / double(size.height - 1), eye = space.to_unit(view.eye());
  gpu::CameraRecord out{};
  for (int axis = 0; axis < 3; ++axis)
    out.eye[axis] = eye[axis], out.corner[axis] = corner[axis], out.right[axis] = right[axis],
    out.down[axis] = down[axis];
  out.width = size.width, out.height = size.height;
  return out;
}

std::span<const Ray> as_rays(const std::vector<packed::KernelRay>& rays) {
  return {reinterpret_cast<const Ray*>(rays.data()), rays.size()};
}

/// Traces rays with a tracer on all threads.
template <typename Result, typename Query>
std::vector<Result> traced(std::span<const Ray> rays, const Query& query) {
  constexpr size_t kPart = 4096;
  std::vector<Result> results(rays.size());
  tbb::parallel_for(size_t{0}, (rays.size() + kPart - 1) / kPart, [&](size_t part) {
    const size_t first = part * kPart, count = std::min(kPart, rays.size() - first);
    query(rays.subspan(first, count), std::span(results).subspan(first, count));
  });
  return results;
}

class SceneRun {
public:
  SceneRun(const std::string& name, const Options& options)
      : options_(options), file_(BakedFile::open(name)), source_(file_),
        cache_(options.structures ? std::make_shared<StructureCache>(options.gpu) : nullptr),
        tracer_(file_, source_, options.gpu, {}, cache_), rays_(tracer_.scene()) {}

  Json run() {
    Json out;
    out["triangles"] = unique_triangles();
    out["placements"] = tracer_.packed().placed_trees().count();
    const uint64_t bytes = tracer_.scene().bytes() + (cache_ ? cache_->stats().resident_bytes : 0);
    out["device_bytes"] = bytes;
    out["bytes_per_triangle"] = double(bytes) / double(unique_triangles());
    const ImageSize size = parsed_size(options_.size);
    const Camera framed = framing_camera(source_.world_bounds(), size, source_.cameras());
    const bool has_camera = options_.camera < source_.cameras().size();
    const Camera seen = has_camera && sees_something(source_.cameras()[options_.camera], size)
                            ? source_.cameras()[options_.camera]
                            : framed;
    if (cache_) {
      out["structures"] = structure_stats_json(cache_->stats());
      out["orbit"] = measure_structures(file_, source_, seen, size, options_.gpu);
    }
    bool same_frames = true;
    out["frames"] = measure_gpu_frames(file_, source_, seen, size, options_.gpu, options_.repeats, same_frames);
    if (!cache_) same_frames_ = same_frames;
    out["moved_placements"] = measure_gpu_placements(file_, source_, options_.gpu, options_.repeats);
    if (options_.only_frames) return out;
    view_ = camera_record(PrimaryCamera(seen, size), tracer_.space());
    out["camera"] = run_camera();
    rays_.make_points(1.0f);
    std::vector<gpu::PointRecord> points(rays_.point_count());
    rays_.points(points);
    std::erase_if(points, [](const gpu::PointRecord& p) { return p.pixel == gpu::kNoPoint; }); // as pictures do
    if (!points.empty()) rays_.set_points(points);
    points_hit_ = points.size();
    out["points"] = points_hit_;
    for (const auto& [order, key] : {std::pair{gpu::kDirectionOrder, "direction"}, {gpu::kRandomOrder, "random"}}) {
      warm_up([&] { rays_.count_occluded(occlusion_record(order, 0, 64)); }); // single samples leave the clock low
      for (const uint32_t spp : options_.spp) out["occlusion"].push_back(run_occlusion(order, key, spp));
      out["equality"].push_back(compare_occlusion(order, key));
    }
    for (const uint32_t spp : {1u, 16u}) out["nearest"].push_back(run_nearest(spp));
    out["equality"].push_back(compare_nearest());
    for (const auto& [kernel, values] : rays_.kernel_statistics())
      for (const auto& [name, value] : values) out["kernels"][kernel][name] = value;
    return out;
  }

  std::string_view device() const { return tracer_.isa(); }
  uint64_t different() const { return different_; }
  bool same_frames() const { return same_frames_; }

private:
  uint64_t unique_triangles() const {
    uint64_t triangles = 0;
    for (uint32_t g = 0; g < source_.geometry_count(); ++g) triangles += source_.counts(g).triangles;
    return triangles;
  }

  bool sees_something(const Camera& camera, ImageSize size) {
    const PrimaryCamera view(camera, size);
    if (view.projection() != Projection::kPerspective) return true; // Only frames can be measured.
    view_ = camera_record(view, tracer_.space());
    rays_.trace_camera(view_, true);
    std::vector<packed::KernelHit> hits(size.pixels());
    rays_.hits(hits);
    return std::ranges::any_of(hits, [](const packed::KernelHit& hit) { return hit.placement != kNoHit; });
  }

  /// Repeats work until the device's clock is high, and the sizes of dispatches and the choice of kernels are found.
  template <typename Work>
  static void warm_up(const Work& work) {
    const Stopwatch watch;
    for (int times = 0; times < 3 || watch.seconds() < 1.0; ++times) work();
  }

  Json run_camera() {
    std::vector<double> ms;
    warm_up([&] { rays_.trace_camera(view_, false); });
    for (uint32_t i = 0; i < options_.repeats; ++i) ms.push_back(rays_.trace_camera(view_, false).ms);
    rays_.trace_camera(view_, true);
    const size_t pixels = size_t{view_.width} * view_.height;
    std::vector<packed::KernelRay> rays(pixels);
    std::vector<packed::KernelHit> hits(pixels);
    rays_.rays(rays);
    rays_.hits(hits);
    const Stopwatch on_cpu;
    const std::vector<RayHit> expected = traced<RayHit>(as_rays(rays), [&](auto in, auto out) {
      tracer_.packed().closest_hits(in, kCameraRays, RayOrder::kIncoherent, out);
    });
    const double cpu_s = on_cpu.seconds();
    uint64_t hit = 0, other = 0, weights = 0, other_triangle = 0;
    double largest_t = 0.0; // difference on the same triangle, relative
    for (size_t i = 0; i < pixels; ++i) {
      hit += expected[i].valid() ? 1 : 0;
      const bool same_triangle = hits[i].placement == expected[i].placement && hits[i].cluster == expected[i].part &&
                                 hits[i].triangle == expected[i].triangle;
      const bool same = same_triangle && std::memcmp(&hits[i].t, &expected[i].t, sizeof(float)) == 0;
      other += same ? 0 : 1;
      other_triangle += hits[i].placement == kNoHit || same_triangle ? 0 : 1;
      if (same_triangle && expected[i].valid())
        largest_t = std::max(largest_t, std::abs(double{hits[i].t} / double{expected[i].t} - 1.0));
      weights += same && (hits[i].u != expected[i].u || hits[i].v != expected[i].v) ? 1 : 0;
    }
    different_ += other;
    return {{"ms", median(ms)},
            {"mrays_s", double(pixels) / median(ms) * 1e-3},
            {"rays", pixels},
            {"hits", hit},
            {"different", other},
            {"other_triangle", other_triangle},
            {"largest_t_difference", largest_t},
            {"weights_different", weights},
            {"packed_cpu_ms", cpu_s * 1e3}};
  }

  gpu::OcclusionRecord occlusion_record(uint32_t order, uint32_t first, uint32_t count) const {
    gpu::OcclusionRecord record{};
    record.first_sample = first, record.sample_count = count;
    record.per_thread = std::min(count, 16u);
    record.order = order;
    // By direction all lanes start their next samples together; otherwise once a quarter has none.
    const uint32_t lanes = tracer_.scene().subgroup_size();
    record.idle_lanes = order == gpu::kDirectionOrder ? lanes : std::max(lanes / 4, 1u);
    const Bounds world = source_.world_bounds();
    record.tfar = static_cast<float>(options_.radius * glm::length(world.hi - world.lo) * tracer_.space().scale());
    record.inverse_radius = 1.0f / record.tfar, record.parabola = 1.0f, record.end = 1.0f, record.darkening = 1.0f;
    return record;
  }

  Json run_occlusion(uint32_t order, const char* key, uint32_t spp) {
    const gpu::OcclusionRecord record = occlusion_record(order, 0, spp);
    std::vector<double> ms;
    gpu::DeviceTime time;
    warm_up([&] { rays_.count_occluded(record); });
    for (uint32_t i = 0; i < options_.repeats; ++i) {
      time = rays_.count_occluded(record);
      ms.push_back(time.ms);
    }
    std::vector<uint32_t> counts(rays_.point_count());
    rays_.counts(counts);
    uint64_t occluded = 0, hash = 0;
    for (const uint32_t count : counts) occluded += count, hash = hash * 0x9e3779b97f4a7c15u + count;
    const double rays = double(points_hit_) * spp;
    return {{"order", key},
            {"spp", spp},
            {"ms", median(ms)},
            {"mrays_s", rays / median(ms) * 1e-3},
            {"occluded", double(occluded) / rays},
            {"counts_hash", hash},
            {"dispatches", time.dispatches},
            {"longest_dispatch_ms", time.longest_ms}};
  }

  /// Times nearest hits, with samples in the order that pictures use.
  Json run_nearest(uint32_t spp) {
    const gpu::OcclusionRecord record = occlusion_record(gpu::kNetOrder, 0, spp);
    std::vector<double> ms;
    warm_up([&] { rays_.sum_nearest(record); });
    for (uint32_t i = 0; i < options_.repeats; ++i) ms.push_back(rays_.sum_nearest(record).ms);
    return {{"spp", spp}, {"ms", median(ms)}, {"mrays_s", double(points_hit_) * spp / median(ms) * 1e-3}};
  }

  /// Compares the nearest hits of one sample per point with those of backend packed.
  Json compare_nearest() {
    const gpu::OcclusionRecord record = occlusion_record(gpu::kNetOrder, 5, 1);
    std::vector<packed::KernelRay> from(rays_.point_count());
    std::vector<double> sums(2 * from.size());
    rays_.sum_nearest(record);
    rays_.sums(sums);
    rays_.occlusion_rays(record, from);
    const std::vector<RayHit> expected = traced<RayHit>(as_rays(from), [&](auto in, auto out) {
      tracer_.packed().closest_hits(in, kOcclusionRays, RayOrder::kIncoherent, out);
    });
    const double tolerance = cache_ ? 1e-3 : 0.0; // the driver's structures give nearly the same distances
    uint64_t rays = 0, other = 0;
    for (size_t i = 0; i < from.size(); ++i) {
      if (!(from[i].tfar > 0.0f)) continue;
      const float way = expected[i].valid() ? std::min(expected[i].t * record.inverse_radius, 1.0f) : 1.0f;
      ++rays, other += std::abs(sums[2 * i + 1] - double{way}) <= tolerance ? 0 : 1;
    }
    different_ += other;
    return {{"order", "net, nearest"}, {"rays", rays}, {"different", other}};
  }

  /// Compares the counts of single samples of all points with packed's any hits, and their sum with the counts.
  Json compare_occlusion(uint32_t order, const char* key) {
    const std::vector<uint32_t> samples{0, 37, 200};
    uint64_t rays = 0, other = 0;
    std::vector<packed::KernelRay> from(rays_.point_count());
    std::vector<uint32_t> counts(rays_.point_count());
    for (const uint32_t sample : samples) {
      const gpu::OcclusionRecord record = occlusion_record(order, sample, 1);
      rays_.count_occluded(record);
      rays_.counts(counts);
      rays_.occlusion_rays(record, from);
      const std::vector<uint8_t> expected = traced<uint8_t>(as_rays(from), [&](auto in, auto out) {
        tracer_.packed().any_hits(in, kOcclusionRays, RayOrder::kIncoherent, out);
      });
      for (size_t i = 0; i < from.size(); ++i) {
        rays += from[i].tfar > 0.0f ? 1 : 0;
        other += (counts[i] != 0) == (expected[i] != 0) ? 0 : 1;
      }
    }
    different_ += other;
    return {{"order", key}, {"rays", rays}, {"different", other}};
  }

  const Options& options_;
  const BakedFile file_;
  const PackedSource source_;
  const std::shared_ptr<StructureCache> cache_; ///< null unless the driver traces
  const GpuTracer tracer_;
  gpu::DeviceRays rays_;
  gpu::CameraRecord view_{};
  uint64_t points_hit_ = 0, different_ = 0;
  bool same_frames_ = true;
};

int run(Options& options) {
  options.gpu.statistics = true;
  if (options.structures) options.gpu.structures = GpuStructures::kDriver;
  if (options.only_walk) options.gpu.occlusion = GpuOcclusion::kWalk;
  if (options.exact) options.gpu.arithmetic = GpuArithmetic::kExact;
  uint64_t different = 0;
  bool same_frames = true;
  for (const std::string& name : options.files) {
    SceneRun scene(name, options);
    Json out = scene.run();
    out["file"] = name;
    out["size"] = options.size;
    out["device"] = scene.device();
    std::cout << out.dump(2) << std::endl;
    if (!options.structures) different += scene.different();
    same_frames = same_frames && scene.same_frames();
  }
  return different == 0 && same_frames ? 0 : static_cast<int>(ErrorKind::kLimitExceeded);
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) {
  packtrace::Options options;
  packtrace::BenchmarkOptions command_line("Measures backend gpu and compares its hits with those of backend packed");
  command_line.add("FILE", options.files, ".ptk files").required();
  command_line.add("--size", options.size, "of the picture").show_default();
  command_line.add("--spp", options.spp, "occlusion rays per pixel").show_default();
  command_line.add("--repeats", options.repeats, "of each measurement; the median counts").show_default();
  command_line.add("--camera", options.camera, "number in the file").show_default();
  command_line.add("--radius", options.radius, "of occlusion rays, in diagonals of the world").show_default();
  command_line.add("--device", options.gpu.device, "part of the device's name (default: a GPU)");
  command_line.add("--dispatch-ms", options.gpu.dispatch_ms, "time that a dispatch should take").show_default();
  command_line.flag("--only-frames", options.only_frames, "measure frames and the denoiser only");
  command_line.flag("--structures", options.structures, "trace with the driver's acceleration structures");
  command_line.flag("--only-walk", options.only_walk, "occlusion rays by kernels whose threads walk alone");
  command_line.flag("--exact", options.exact, "make floats from doubles, whatever the device can");
  if (const auto code = command_line.parse(argc, argv)) return *code;
  try {
    return packtrace::run(options);
  } catch (const packtrace::Error& error) {
    std::cerr << "gpu_benchmark: " << error.what() << '\n';
    return error.exit_code();
  } catch (const std::exception& error) {
    std::cerr << "gpu_benchmark: " << error.what() << '\n';
    return 1;
  }
}
