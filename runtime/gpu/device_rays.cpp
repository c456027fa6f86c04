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
  for (Occlusion* occlusion : {&state_->any, &state_->nearest})
    occlusion->results = Buffer(), occlusion->spare = Buffer();
}

/// Whether the queue kernels can run: subgroups of 4 to 32 lanes, at most 2^24 nodes, no masks.
bool DeviceRays::State::has_queue() const {
  const uint32_t lanes = device->traits().subgroup_size;
  return !scene.structures && !scene.masked && lanes >= kMinLanes && lanes <= kMaxLanes &&
         scene.node_count <= kMaxQueueNodes;
}

void DeviceRays::State::make_kernels(Occlusion& occlusion, const RayKernelCode& walk, std::span<const uint32_t> queue) {
  constexpr uint32_t kBindings = kFirstRayBinding + 2, kPushBytes = sizeof(OcclusionRecord);
  if (!occlusion.walk) occlusion.walk = scene.make_ray_kernel(walk, kBindings, kPushBytes);
  if (!occlusion.queue && has_queue()) occlusion.queue = scene.make_kernel(queue, kBindings, kPushBytes);
  for (Kernel* kernel : {occlusion.walk.get(), occlusion.queue.get()}) {
    if (kernel == nullptr) continue;
    kernel->bind(kFirstRayBinding, points.device());
    kernel->bind(kFirstRayBinding + 1, occlusion.results);
  }
}

/// Traces the occlusion rays of all points with the faster one of the two kernels.
/// @param max_samples number of samples per point that one dispatch may trace
/// @param split_samples whether several threads may trace a point, samples.per_thread samples each
DeviceTime DeviceRays::State::trace(Occlusion& occlusion, OcclusionRecord samples, uint32_t max_samples,
                                    bool split_samples, const Watch& watch) {
  device->fill(occlusion.results, 0);
  FasterKernel& faster = occlusion.faster[samples.order];
  Kernel* const kernels[] = {occlusion.walk.get(), occlusion.queue.get()};
  double spare_ms = 0.0; // of dispatches that only compare kernels
  const auto run = [&](const OcclusionRecord& part, uint32_t groups) {
    const uint64_t ray_count = uint64_t{part.point_count} * part.sample_count;
    const GpuOcclusion wanted = device->config().occlusion;
    if (kernels[1] == nullptr || wanted != GpuOcclusion::kFaster) {
      Kernel* const asked = kernels[1] == nullptr || wanted == GpuOcclusion::kWalk ? kernels[0] : kernels[1];
      return device->run(*asked, push_bytes(part), groups);
    }
    const bool compares = faster.compares(ray_count) && make_spare(occlusion);
    const size_t number = faster.choice(ray_count);
    std::array<double, 2> ms{};
    ms[number] = device->run(*kernels[number], push_bytes(part), groups);
    if (!compares) return ms[number];
    Kernel& other = *kernels[1 - number];
    other.bind(kFirstRayBinding + 1, occlusion.spare);
    ms[1 - number] = device->run(other, push_bytes(part), groups);
    other.bind(kFirstRayBinding + 1, occlusion.results);
    faster.add(ray_count, ms);
    spare_ms += ms[1 - number];
    return ms[number];
  };
  DeviceTime time;
  const uint32_t sample_count = samples.sample_count, first_sample = samples.first_sample;
  for (uint32_t done = 0; done < sample_count; done += samples.sample_count) {
    samples.first_sample = first_sample + done;
    samples.sample_count = std::min(sample_count - done, max_samples);
    if (!split_samples) samples.per_thread = samples.sample_count;
    const uint32_t threads = (samples.sample_count + samples.per_thread - 1) / samples.per_thread; // per point
    const Watch watch_part = [&](double share) {
      if (watch) watch((done + share * samples.sample_count) / sample_count);
    };
    TimedDispatches dispatches(*device, occlusion.pace[samples.order], samples.sample_count,
                               most_threads() / threads / 2, watch_part);
    const DeviceTime of_part = dispatches.all(point_count, 2 * kThreads, [&](uint64_t first, uint64_t count) {
      samples.first_point = static_cast<uint32_t>(first), samples.point_count = static_cast<uint32_t>(count);
      return run(samples, groups_of((count + 31) / 32 * 32 * threads));
    });
    time.ms += of_part.ms, time.dispatches += of_part.dispatches;
    time.longest_ms = std::max(time.longest_ms, of_part.longest_ms);
  }
  time.ms += spare_ms;
  // The flag is the last word of the results. The host buffer is kept, because allocating it takes longer than copying.
  if (lost.bytes() == 0) lost = Buffer(device, sizeof(uint32_t), BufferPlace::kHost, "a flag");
  device->copy(occlusion.results, lost, occlusion.results.bytes() - sizeof(uint32_t), 0, sizeof(uint32_t));
  if (*lost.as<uint32_t>() != 0)
    throw Error(ErrorKind::kUnsupported,
                "backend gpu: " + device->name() + " ended a kernel before all rays were traced; use --backend packed");
  return time;
}

DeviceTime DeviceRays::count_occluded(const OcclusionRecord& samples, const Watch& watch) {
  State& s = *state_;
  s.follow_scene();
  s.make_room(s.any.results, (uint64_t{s.point_count} + 1) * sizeof(uint32_t), "counts");
  s.make_kernels(s.any, {spirv::occlusion_count(), spirv::occlusion_count_rays()},
                 s.device->traits().partitioned ? spirv::occlusion_queue_partitioned() : spirv::occlusion_queue());
  return s.trace(s.any, samples, kMaxSamples, true, watch);
}

DeviceTime DeviceRays::sum_nearest(const OcclusionRecord& samples, const Watch& watch) {
  State& s = *state_;
  s.follow_scene();
  s.make_room(s.nearest.results, (uint64_t{s.point_count} * 2 + 1) * sizeof(double), "sums");
  s.make_kernels(s.nearest, {spirv::occlusion_nearest(), spirv::occlusion_nearest_rays()},
                 s.device->traits().partitioned ? spirv::nearest_queue_partitioned() : spirv::nearest_queue());
  return s.trace(s.nearest, samples, kMaxNearestSamples, false, watch);
}

std::map<std::string, std::vector<std::pair<std::string, double>>> DeviceRays::kernel_statistics() const {
  std::map<std::string, std::vector<std::pair<std::string, double>>> all;
  const std::pair<const char*, const Kernel*> kernels[] = {
      {"camera", state_->camera_kernel.get()},           {"view", state_->view_kernel.get()},
      {"count occluded, walk", state_->any.walk.get()},  {"count occluded, queue", state_->any.queue.get()},
      {"sum nearest, walk", state_->nearest.walk.get()}, {"sum nearest, queue", state_->nearest.queue.get()}};
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
  download(state_->device, state_->any.results, 0, std::as_writable_bytes(out));
}

void DeviceRays::sums(std::span<double> out) const {
  download(state_->device, state_->nearest.results, 0, std::as_writable_bytes(out));
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
