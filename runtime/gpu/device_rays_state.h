#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device/kernel.h"
#include "runtime/gpu/device/staged_buffer.h"
#include "runtime/gpu/device_rays.h"
#include "runtime/gpu/gpu_scene_state.h"
#include "runtime/gpu/timed_dispatches.h"

namespace packtrace::gpu {

inline constexpr uint32_t kFirstRayBinding = kSceneBindings; ///< of kernels that read a scene and more
inline constexpr uint32_t kSampleOrders = 3;
inline constexpr uint64_t kMaxPoints = uint64_t{1} << 31;

/// Groups of so many threads.
inline uint32_t groups_of(uint64_t threads) {
  return static_cast<uint32_t>((threads + Kernel::kGroupThreads - 1) / Kernel::kGroupThreads);
}

/// Threads that take the pixels of a picture in blocks of 8 x 4.
inline uint64_t block_threads(uint32_t width, uint32_t height) {
  return uint64_t{(width + 7) / 8} * ((height + 3) / 4) * 32;
}

/// Throws Error(kLimitExceeded) for pictures of more pixels than kernels count.
void require_few_pixels(uint32_t width, uint32_t height);

template <typename Record>
std::span<const std::byte> push_bytes(const Record& record) {
  return std::as_bytes(std::span(&record, 1));
}

/// Allocates an eighth more than is needed now, because the number of points changes from frame to frame; exactly as
/// much if there is no room for more.
template <typename Allocate>
void with_slack(uint64_t bytes, const Allocate& allocate) {
  try {
    allocate(bytes + bytes / 8);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kLimitExceeded && error.kind() != ErrorKind::kUnsupported) throw;
    allocate(bytes);
  }
}

/// Two interchangeable kernels that trace the occlusion rays of all points, and the buffers that they write.
struct Occlusion {
  std::unique_ptr<Kernel> walk, queue; ///< queue: null where it cannot run
  Buffer results;                      ///< one per point; the last word is a flag: not 0 if a ray was not traced
  Buffer spare;                        ///< receives the results of the slower kernel when both are timed
  FasterKernel faster[kSampleOrders];  ///< one per order of samples
  Pace pace[kSampleOrders];
};

/// Buffers and kernels of a DeviceRays on its device.
struct DeviceRays::State {
  explicit State(GpuScene::State& on_device) : scene(on_device), device(on_device.device) {}

  GpuScene::State& scene;
  std::shared_ptr<Device> device;
  CameraRecord camera{};
  Buffer cameras, hits, rays;
  StagedBuffer points, view, film;
  Buffer instances, lookup;  ///< of surfaces: InstanceSurface; words of instances and NormalRecord
  StagedBuffer surface_view; ///< SurfaceViewRecord
  uint32_t point_count = 0;
  std::unique_ptr<Kernel> camera_kernel, view_kernel, surfaces_kernel, points_kernel, rays_kernel;
  std::unique_ptr<Kernel> picture_kernel, picture_points_kernel;
  Occlusion any, nearest;          ///< of count_occluded() and sum_nearest()
  Buffer lost;                     ///< on the host: receives the flag of Occlusion::results
  uint64_t placed = 0;             ///< GpuScene::State::placed of the kernels
  std::vector<uint32_t> constants; ///< GpuScene::State::constants of the kernels
  Pace camera_pace;

  void make_room(Buffer& buffer, uint64_t bytes, const char* what) {
    if (buffer.bytes() >= bytes) return;
    buffer = Buffer();
    with_slack(bytes, [&](uint64_t all) { buffer = Buffer(device, all, BufferPlace::kDevice, what); });
  }
  void make_room_for_points() {
    const uint64_t bytes = uint64_t{point_count} * sizeof(PointRecord);
    if (points.bytes() >= bytes && points.bytes() > 0) return;
    points = StagedBuffer();
    with_slack(bytes, [&](uint64_t all) { points = StagedBuffer(device, all, "points"); });
  }
  /// Allocates Occlusion::spare. Returns false if device memory does not suffice.
  bool make_spare(Occlusion& occlusion) {
    try {
      make_room(occlusion.spare, occlusion.results.bytes(), "results");
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kLimitExceeded && error.kind() != ErrorKind::kUnsupported) throw;
      return false;
    }
    return true;
  }
  void write_view(Commands& commands, const View& from);
  uint64_t most_threads() const {
    return uint64_t{device->limits().maxComputeWorkGroupCount[0]} * Kernel::kGroupThreads;
  }
  bool has_queue() const;
  /// Creates the kernels that do not exist yet, and binds the points and the results.
  /// @param walk, queue shader code
  void make_kernels(Occlusion& occlusion, const RayKernelCode& walk, std::span<const uint32_t> queue);
  DeviceTime trace(Occlusion& occlusion, OcclusionRecord samples, uint32_t max_samples, bool split_samples,
                   const Watch& watch);
  /// Runs a kernel that traces a ray through each pixel, in blocks of 8 x 4 pixels.
  DeviceTime run_pixels(Kernel& kernel, std::span<const Buffer* const> buffers, uint32_t width, uint32_t height,
                        uint32_t ray_class, bool keep_rays, const Watch& watch) {
    for (uint32_t i = 0; i < buffers.size(); ++i) kernel.bind(kFirstRayBinding + i, *buffers[i]);
    TimedDispatches dispatches(*device, camera_pace, 1, most_threads(), watch);
    return dispatches.all(block_threads(width, height), Kernel::kGroupThreads, [&](uint64_t first, uint64_t count) {
      const SpanRecord span{static_cast<uint32_t>(first), static_cast<uint32_t>(count), ray_class, keep_rays ? 1u : 0u};
      return device->run(kernel, push_bytes(span), groups_of(count));
    });
  }
  /// Binds the scene's current buffers to the kernels, and discards kernels that were made for another kind of scene.
  void follow_scene() {
    if (std::exchange(placed, scene.placed) == scene.placed) return;
    const bool same = std::exchange(constants, scene.constants) == scene.constants;
    for (auto* kernel : {&camera_kernel, &view_kernel, &surfaces_kernel, &points_kernel, &rays_kernel, &any.walk,
                         &any.queue, &nearest.walk, &nearest.queue})
      if (same && *kernel)
        scene.bind_scene(**kernel);
      else
        kernel->reset();
  }
};

} // namespace packtrace::gpu
