#include "runtime/gpu/device_rays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>

#include "runtime/gpu/device_rays_state.h"
#include "runtime/gpu/shaders/spirv.h"

namespace packtrace::gpu {
namespace {

constexpr uint32_t kThreads = Kernel::kGroupThreads;
constexpr uint32_t kMinLanes = 4, kMaxLanes = 32, kMaxQueueNodes = 1u << 24;
constexpr uint32_t kMaxSamples = 256; ///< of a point in a dispatch
/// Of a thread: Mesa's CPU device ends loops after 65,535 iterations of an invocation.
constexpr uint32_t kMaxNearestSamples = 16;

} // namespace

void require_few_pixels(uint32_t width, uint32_t height) {
  if ((uint64_t{width} + 8) * (uint64_t{height} + 8) > kMaxPoints)
    throw Error(ErrorKind::kLimitExceeded, "backend gpu: more than 2^31 pixels; use a smaller picture");
}

DeviceRays::DeviceRays(const GpuScene& scene) : state_(std::make_unique<State>(scene.state())) {}
DeviceRays::~DeviceRays() = default;

DeviceTime DeviceRays::trace_camera(const CameraRecord& camera, bool keep_rays) {
  State& s = *state_;
  s.follow_scene();
  s.camera = camera;
  const uint64_t pixels = uint64_t{camera.width} * camera.height;
  require_few_pixels(camera.width, camera.height);
  s.make_room(s.hits, pixels * sizeof(packed::KernelHit), "hits");
  s.make_room(s.rays, keep_rays ? pixels * sizeof(packed::KernelRay) : 1, "rays");
  s.cameras = upload(s.device, push_bytes(camera), "the camera");
  if (!s.camera_kernel)
    s.camera_kernel =
        s.scene.make_ray_kernel({spirv::camera(), spirv::camera_rays()}, kFirstRayBinding + 3, sizeof(SpanRecord));
  const Buffer* const buffers[] = {&s.cameras, &s.hits, &s.rays};
  return s.run_pixels(*s.camera_kernel, buffers, camera.width, camera.height, baked::kVisibleToCamera, keep_rays, {});
}

void DeviceRays::make_points(float lift) {
  State& s = *state_;
  s.follow_scene();
  s.point_count = static_cast<uint32_t>(block_threads(s.camera.width, s.camera.height));
  s.make_room_for_points();
  if (!s.points_kernel)
    s.points_kernel = s.scene.make_kernel(spirv::surface_points(), kFirstRayBinding + 4, sizeof(SpanRecord));
  const Buffer* const buffers[] = {&s.cameras, &s.hits, &s.rays, &s.points.device()};
  for (uint32_t i = 0; i < std::size(buffers); ++i) s.points_kernel->bind(kFirstRayBinding + i, *buffers[i]);
  for (uint64_t first = 0; first < s.point_count; first += s.most_threads()) {
    const uint64_t count = std::min(s.point_count - first, s.most_threads());
    const SpanRecord span{static_cast<uint32_t>(first), static_cast<uint32_t>(count), 0, std::bit_cast<uint32_t>(lift)};
    s.device->run(*s.points_kernel, push_bytes(span), groups_of(count));
  }
}

void DeviceRays::set_points(size_t count, const std::function<void(std::span<PointRecord>)>& write) {
  State& s = *state_;
  if (count > kMaxPoints)
    throw Error(ErrorKind::kLimitExceeded, "backend gpu: more than 2^31 points at once; use a smaller picture");
  s.point_count = static_cast<uint32_t>(count);
  s.make_room_for_points();
  write({s.points.host().as<PointRecord>(), count});
  Commands commands;
  commands.copy(s.points.host(), s.points.device(), count * sizeof(PointRecord));
  s.device->run(commands);
}

void DeviceRays::set_points(std::span<const PointRecord> points) {
  set_points(points.size(), [&](std::span<PointRecord> out) {
    copy_in_parts(reinterpret_cast<std::byte*>(out.data()), std::as_bytes(points).data(), points.size_bytes());
  });
}

void DeviceRays::release() {
  state_->points = StagedBuffer();
  for (Buffer* buffer : {&state_->counts, &state_->spare_counts, &state_->sums}) *buffer = Buffer();
}

/// Whether the queue kernel can count occluded rays: subgroups of 4 to 32 lanes, at most 2^24 nodes, no masks.
bool DeviceRays::State::has_queue() const {
  const uint32_t lanes = device->traits().subgroup_size;
  return !scene.structures && !scene.masked && lanes >= kMinLanes && lanes <= kMaxLanes &&
         scene.node_count <= kMaxQueueNodes;
}

void DeviceRays::State::make_count_kernels() {
  const auto make = [&](std::span<const uint32_t> compute) {
    return scene.make_ray_kernel({compute, spirv::occlusion_count_rays()}, kFirstRayBinding + 2,
                                 sizeof(OcclusionRecord));
  };
  if (!walk_kernel) walk_kernel = make(spirv::occlusion_count());
  if (!queue_kernel && has_queue())
    queue_kernel = make(device->traits().partitioned ? spirv::occlusion_queue_partitioned() : spirv::occlusion_queue());
  for (Kernel* kernel : {walk_kernel.get(), queue_kernel.get()}) {
    if (kernel == nullptr) continue;
    kernel->bind(kFirstRayBinding, points.device());
    kernel->bind(kFirstRayBinding + 1, counts);
  }
}

/// Runs kernels for all points, and for at most `most_samples` of their samples at a time.
/// @param run function of push constants and a number of groups that returns ms
/// @param threads function of a number of samples: threads of a point
template <typename Run, typename Threads>
DeviceTime DeviceRays::State::run_all(const Run& run, const OcclusionRecord& samples, uint32_t most_samples, Pace& pace,
                                      const Threads& threads, const Watch& watch) {
  DeviceTime time;
  for (uint32_t done = 0; done < samples.sample_count;) {
    OcclusionRecord part = samples;
    part.first_sample = samples.first_sample + done;
    part.sample_count = std::min(samples.sample_count - done, most_samples);
    const uint32_t per_point = threads(part.sample_count);
    const Watch watch_part = [&](double share) {
      if (watch) watch((done + share * part.sample_count) / samples.sample_count);
    };
    TimedDispatches dispatches(*device, pace, part.sample_count, most_threads() / per_point / 2, watch_part);
    const DeviceTime of_part = dispatches.all(point_count, 2 * kThreads, [&](uint64_t first, uint64_t count) {
      part.first_point = static_cast<uint32_t>(first), part.point_count = static_cast<uint32_t>(count);
      return run(part, groups_of((count + 31) / 32 * 32 * per_point));
    });
    time.ms += of_part.ms, time.dispatches += of_part.dispatches;
    time.longest_ms = std::max(time.longest_ms, of_part.longest_ms);
    done += part.sample_count;
  }
  return time;
}

DeviceTime DeviceRays::count_occluded(const OcclusionRecord& samples, const Watch& watch) {
  State& s = *state_;
  s.follow_scene();
  s.make_room(s.counts, (uint64_t{s.point_count} + 1) * sizeof(uint32_t), "counts");
  s.device->fill(s.counts, 0);
  s.make_count_kernels();
  FasterKernel& faster = s.faster[samples.order];
  Kernel* const kernels[] = {s.walk_kernel.get(), s.queue_kernel.get()};
  double spare_ms = 0.0; // of dispatches that only compare kernels
  const auto run = [&](const OcclusionRecord& part, uint32_t groups) {
    const uint64_t rays = uint64_t{part.point_count} * part.sample_count;
    const GpuCounting counting = s.device->config().counting;
    if (kernels[1] == nullptr || counting != GpuCounting::kFaster) {
      Kernel* const asked = kernels[1] == nullptr || counting == GpuCounting::kWalk ? kernels[0] : kernels[1];
      return s.device->run(*asked, push_bytes(part), groups);
    }
    const bool compares = faster.compares(rays) && s.make_spare_counts();
    const size_t number = faster.choice(rays);
    std::array<double, 2> ms{};
    ms[number] = s.device->run(*kernels[number], push_bytes(part), groups);
    if (!compares) return ms[number];
    Kernel& other = *kernels[1 - number];
    other.bind(kFirstRayBinding + 1, s.spare_counts);
    ms[1 - number] = s.device->run(other, push_bytes(part), groups);
    other.bind(kFirstRayBinding + 1, s.counts);
    faster.add(rays, ms);
    spare_ms += ms[1 - number];
    return ms[number];
  };
  const auto threads = [&](uint32_t count) { return (count + samples.per_thread - 1) / samples.per_thread; };
  DeviceTime time = s.run_all(run, samples, kMaxSamples, s.count_pace[samples.order], threads, watch);
  time.ms += spare_ms;
  uint32_t lost = 0;
  download(s.device, s.counts, s.counts.bytes() - sizeof lost, std::as_writable_bytes(std::span(&lost, 1)));
  if (lost != 0)
    throw Error(ErrorKind::kUnsupported, "backend gpu: " + s.device->name() +
                                             " ended a kernel before all rays were traced; use --backend packed");
  return time;
}

DeviceTime DeviceRays::sum_nearest(const OcclusionRecord& samples, const Watch& watch) {
  State& s = *state_;
  s.follow_scene();
  s.make_room(s.sums, uint64_t{s.point_count} * 2 * sizeof(double), "sums");
  s.device->fill(s.sums, 0);
  if (!s.nearest_kernel)
    s.nearest_kernel = s.scene.make_ray_kernel({spirv::occlusion_nearest(), spirv::occlusion_nearest_rays()},
                                               kFirstRayBinding + 2, sizeof(OcclusionRecord));
  s.nearest_kernel->bind(kFirstRayBinding, s.points.device());
  s.nearest_kernel->bind(kFirstRayBinding + 1, s.sums);
  const auto run = [&](const OcclusionRecord& part, uint32_t groups) {
    return s.device->run(*s.nearest_kernel, push_bytes(part), groups);
  };
  return s.run_all(run, samples, kMaxNearestSamples, s.nearest_pace[samples.order], [](uint32_t) { return 1u; }, watch);
}

std::map<std::string, std::vector<std::pair<std::string, double>>> DeviceRays::kernel_statistics() const {
  std::map<std::string, std::vector<std::pair<std::string, double>>> all;
  const std::pair<const char*, const Kernel*> kernels[] = {{"camera", state_->camera_kernel.get()},
                                                           {"view", state_->view_kernel.get()},
                                                           {"count occluded, walk", state_->walk_kernel.get()},
                                                           {"count occluded, queue", state_->queue_kernel.get()},
                                                           {"sum nearest", state_->nearest_kernel.get()}};
  for (const auto& [name, kernel] : kernels)
    if (kernel != nullptr) all[name] = kernel->statistics();
  return all;
}

uint32_t DeviceRays::point_count() const { return state_->point_count; }

void DeviceRays::hits(std::span<packed::KernelHit> out) const {
  download(state_->device, state_->hits, 0, std::as_writable_bytes(out));
}
void DeviceRays::rays(std::span<packed::KernelRay> out) const {
  download(state_->device, state_->rays, 0, std::as_writable_bytes(out));
}
void DeviceRays::points(std::span<PointRecord> out) const {
  download(state_->device, state_->points.device(), 0, std::as_writable_bytes(out));
}
void DeviceRays::counts(std::span<uint32_t> out) const {
  download(state_->device, state_->counts, 0, std::as_writable_bytes(out));
}

void DeviceRays::sums(std::span<double> out) const {
  download(state_->device, state_->sums, 0, std::as_writable_bytes(out));
}

void DeviceRays::occlusion_rays(const OcclusionRecord& samples, std::span<packed::KernelRay> out) {
  State& s = *state_;
  s.follow_scene();
  Buffer rays(s.device, uint64_t{s.point_count} * sizeof(packed::KernelRay), BufferPlace::kDevice, "occlusion rays");
  if (!s.rays_kernel)
    s.rays_kernel = s.scene.make_kernel(spirv::occlusion_rays(), kFirstRayBinding + 3, sizeof(OcclusionRecord));
  s.rays_kernel->bind(kFirstRayBinding, s.points.device());
  s.rays_kernel->bind(kFirstRayBinding + 1, s.points.device()); // not used
  s.rays_kernel->bind(kFirstRayBinding + 2, rays);
  OcclusionRecord all = samples;
  for (uint64_t first = 0; first < s.point_count; first += s.most_threads()) {
    all.first_point = static_cast<uint32_t>(first);
    all.point_count = static_cast<uint32_t>(std::min(s.point_count - first, s.most_threads()));
    s.device->run(*s.rays_kernel, push_bytes(all), groups_of(all.point_count));
  }
  download(s.device, rays, 0, std::as_writable_bytes(out));
}

} // namespace packtrace::gpu
