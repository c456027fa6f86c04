#include "tests/benchmarks/gpu_structures.h"

#include <algorithm>
#include <vector>

#include "runtime/frame/camera_path.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/make_tracer.h"
#include "tests/benchmarks/gpu_frames.h"

namespace packtrace {

using Json = nlohmann::json;

Json structure_stats_json(const StructureStats& stats) {
  const auto all = static_cast<double>(std::max<uint64_t>(stats.worst_case_bytes, 1));
  return {{"built", stats.built},
          {"built_triangles", stats.built_triangles},
          {"compacted", stats.compacted},
          {"dropped", stats.dropped},
          {"live", stats.live},
          {"build_ms", stats.build_ms},
          {"copy_ms", stats.copy_ms},
          {"worst_case_bytes", stats.worst_case_bytes},
          {"resident_bytes", stats.resident_bytes},
          {"peak_bytes", stats.peak_bytes},
          {"allocated_bytes", stats.allocated_bytes},
          {"saved", 1.0 - static_cast<double>(stats.resident_bytes) / all}};
}

Json measure_structures(const BakedFile& file, const PackedSource& source, const Camera& camera, ImageSize size,
                        const GpuConfig& device) {
  if (file.sections().lod_levels.empty()) return nullptr;
  constexpr int kFrames = 100;
  constexpr double kDegrees = 0.5; ///< a frame
  FrameScene scene{&source, &file, {}};
  scene.backend.backend = Backend::kGpu, scene.backend.gpu = device;
  scene.backend.structures = make_structure_cache(scene.backend);
  FrameConfig config;
  config.size = size;
  config.detail.error_px = 1.0;
  FrameLoop loop(scene, config);
  const Bounds world = source.world_bounds();
  const DVec3 centre = 0.5 * (DVec3(world.lo) + DVec3(world.hi));
  std::vector<double> frame_ms, build_ms, device_ms;
  uint64_t plans = 0;
  Progress progress;
  StructureStats first;
  double before_ms = 0.0;
  for (int f = 0; f < kFrames; ++f) {
    const Camera view = orbited(camera, centre, DVec3(0.0, 1.0, 0.0), kDegrees * f);
    const Stopwatch watch;
    const FrameReport report = loop.next_frame(view, 0.0, progress);
    frame_ms.push_back(watch.seconds() * 1e3);
    build_ms.push_back(report.times.build_s * 1e3);
    const StructureStats stats = scene.backend.structures->stats();
    device_ms.push_back(stats.build_ms + stats.copy_ms - before_ms);
    before_ms = stats.build_ms + stats.copy_ms;
    plans += report.rebuilt ? 1 : 0;
    if (f == 0) first = stats;
  }
  const StructureStats last = scene.backend.structures->stats();
  return {{"frames", kFrames},
          {"plans", plans},
          {"after_first_frame", structure_stats_json(first)},
          {"after_all", structure_stats_json(last)},
          {"frame_ms", median(frame_ms)},
          {"build_ms", median(build_ms)},
          {"device_build_and_copy_ms", median(device_ms)},
          {"longest_device_build_and_copy_ms", *std::ranges::max_element(device_ms)}};
}

} // namespace packtrace
