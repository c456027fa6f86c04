#include "runtime/gpu/device_rays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device/staged_buffer.h"
#include "runtime/gpu/device_ao.h"
#include "runtime/gpu/device_view.h"
#include "runtime/gpu/gpu_scene_state.h"
#include "runtime/gpu/shaders/spirv.h"
#include "runtime/gpu/timed_dispatches.h"

namespace packtrace::gpu {
namespace {

constexpr uint32_t kThreads = Kernel::kGroupThreads;
constexpr uint32_t kMinLanes = 4, kMaxLanes = 32, kMaxQueueNodes = 1u << 24;
constexpr uint64_t kMaxPoints = uint64_t{1} << 31;
constexpr uint32_t kFirstBinding = kSceneBindings;
constexpr uint32_t kOrders = 3;       ///< of samples
constexpr uint32_t kMaxSamples = 256; ///< of a point in a dispatch
/// Of a thread: Mesa's CPU device ends loops after 65,535 iterations of an invocation.
constexpr uint32_t kMaxNearestSamples = 16;

uint32_t groups_of(uint64_t threads) { return static_cast<uint32_t>((threads + kThreads - 1) / kThreads); }

uint32_t blocks_of(uint32_t width, uint32_t height) { return (width + 7) / 8 * ((height + 3) / 4); }

void require_few_pixels(uint32_t width, uint32_t height) {
  if ((uint64_t{width} + 8) * (uint64_t{height} + 8) > kMaxPoints)
    throw Error(ErrorKind::kLimitExceeded, "backend gpu: more than 2^31 pixels; use a smaller picture");
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

template <typename Record>
std::span<const std::byte> push_bytes(const Record& record) {
  return std::as_bytes(std::span(&record, 1));
}

} // namespace

struct DeviceRays::State {
  explicit State(GpuScene::State& on_device) : scene(on_device), device(on_device.device) {}

  GpuScene::State& scene;
  std::shared_ptr<Device> device;
  CameraRecord camera{};
  Buffer cameras, hits, rays, counts, sums;
  Buffer spare_counts; ///< of dispatches that only compare kernels
  StagedBuffer points, view, film;
  uint32_t point_count = 0;
  std::unique_ptr<Kernel> camera_kernel, view_kernel, points_kernel, rays_kernel, nearest_kernel;
  std::unique_ptr<Kernel> walk_kernel, queue_kernel; ///< of count_occluded()
  std::unique_ptr<Kernel> picture_kernel;
  uint64_t placed = 0;                                          ///< GpuScene::State::placed of the kernels
  std::vector<uint32_t> constants;                              ///< GpuScene::State::constants of the kernels
  FasterKernel faster[kOrders];                                 ///< of count_occluded(), by the order of samples
  Pace camera_pace, count_pace[kOrders], nearest_pace[kOrders]; ///< of occlusion rays by the order of samples

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
  /// Allocates spare_counts. Returns false if device memory does not suffice.
  bool make_spare_counts() {
    try {
      make_room(spare_counts, counts.bytes(), "counts");
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kLimitExceeded && error.kind() != ErrorKind::kUnsupported) throw;
      return false;
    }
    return true;
  }
  uint64_t most_threads() const { return uint64_t{device->limits().maxComputeWorkGroupCount[0]} * kThreads; }
  bool has_queue() const;
  void make_count_kernels();
  template <typename Run, typename Threads>
  DeviceTime run_all(const Run& run, const OcclusionRecord& samples, uint32_t most_samples, Pace& pace,
                     const Threads& threads, const Watch& watch);
  /// Runs a kernel that traces a ray through each pixel, in blocks of 8 x 4 pixels.
  DeviceTime run_pixels(Kernel& kernel, std::span<const Buffer* const> buffers, uint32_t width, uint32_t height,
                        uint32_t ray_class, bool keep_rays, const Watch& watch) {
    for (uint32_t i = 0; i < buffers.size(); ++i) kernel.bind(kFirstBinding + i, *buffers[i]);
    TimedDispatches dispatches(*device, camera_pace, 1, most_threads(), watch);
    return dispatches.all(uint64_t{blocks_of(width, height)} * 32, kThreads, [&](uint64_t first, uint64_t count) {
      const SpanRecord span{static_cast<uint32_t>(first), static_cast<uint32_t>(count), ray_class, keep_rays ? 1u : 0u};
      return device->run(kernel, push_bytes(span), groups_of(count));
    });
  }
  /// Binds the scene's current buffers to the kernels, and drops those that were made for another kind of scene.
  void follow_scene() {
    if (std::exchange(placed, scene.placed) == scene.placed) return;
    const bool same = std::exchange(constants, scene.constants) == scene.constants;
    for (auto* kernel :
         {&camera_kernel, &view_kernel, &points_kernel, &rays_kernel, &walk_kernel, &queue_kernel, &nearest_kernel})
      if (same && *kernel)
        scene.bind_scene(**kernel);
      else
        kernel->reset();
  }
};

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
        s.scene.make_ray_kernel({spirv::camera(), spirv::camera_rays()}, kFirstBinding + 3, sizeof(SpanRecord));
  const Buffer* const buffers[] = {&s.cameras, &s.hits, &s.rays};
  return s.run_pixels(*s.camera_kernel, buffers, camera.width, camera.height, baked::kVisibleToCamera, keep_rays, {});
}

void DeviceRays::make_points(float lift) {
  State& s = *state_;
  s.follow_scene();
  s.point_count = blocks_of(s.camera.width, s.camera.height) * 32;
  s.make_room_for_points();
  if (!s.points_kernel)
    s.points_kernel = s.scene.make_kernel(spirv::surface_points(), kFirstBinding + 4, sizeof(SpanRecord));
  const Buffer* const buffers[] = {&s.cameras, &s.hits, &s.rays, &s.points.device()};
  for (uint32_t i = 0; i < std::size(buffers); ++i) s.points_kernel->bind(kFirstBinding + i, *buffers[i]);
  for (uint64_t first = 0; first < s.point_count; first += s.most_threads()) {
    const uint64_t count = std::min(s.point_count - first, s.most_threads());
    const SpanRecord span{static_cast<uint32_t>(first), static_cast<uint32_t>(count), 0, std::bit_cast<uint32_t>(lift)};
    s.device->run(*s.points_kernel, push_bytes(span), groups_of(count));
  }
}

std::shared_ptr<DeviceView> DeviceRays::trace_view(const ViewRecord& view, std::span<const double> film,
                                                   uint32_t ray_class, std::shared_ptr<DeviceView> reused,
                                                   const Watch& watch) {
  State& s = *state_;
  s.follow_scene();
  require_few_pixels(view.width, view.height);
  const size_t pixels = size_t{view.width} * view.height;
  if (!reused || reused.use_count() > 1 || reused->pixels() != pixels || reused->device() != s.device) {
    reused.reset();
    reused = std::make_shared<DeviceView>(s.device, pixels);
  }
  if (s.view.bytes() == 0) s.view = StagedBuffer(s.device, sizeof view, "the camera");
  if (s.film.bytes() < film.size_bytes()) s.film = StagedBuffer(s.device, film.size_bytes(), "the camera's film");
  Commands commands;
  s.view.write(commands, push_bytes(view));
  s.film.write(commands, std::as_bytes(film));
  s.device->run(commands);
  if (!s.view_kernel)
    s.view_kernel = s.scene.make_ray_kernel({spirv::view(), spirv::view_rays()}, kFirstBinding + 3, sizeof(SpanRecord));
  const StagedBuffer& hits = reused->hits_buffer();
  const Buffer* const buffers[] = {&s.view.device(), &s.film.device(), &hits.device()};
  s.run_pixels(*s.view_kernel, buffers, view.width, view.height, ray_class, false, watch);
  s.device->copy(hits.device(), hits.host(), 0, 0, pixels * sizeof(packed::KernelHit));
  return reused;
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
    return scene.make_ray_kernel({compute, spirv::occlusion_count_rays()}, kFirstBinding + 2, sizeof(OcclusionRecord));
  };
  if (!walk_kernel) walk_kernel = make(spirv::occlusion_count());
  if (!queue_kernel && has_queue())
    queue_kernel = make(device->traits().partitioned ? spirv::occlusion_queue_partitioned() : spirv::occlusion_queue());
  for (Kernel* kernel : {walk_kernel.get(), queue_kernel.get()}) {
    if (kernel == nullptr) continue;
    kernel->bind(kFirstBinding, points.device());
    kernel->bind(kFirstBinding + 1, counts);
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
    other.bind(kFirstBinding + 1, s.spare_counts);
    ms[1 - number] = s.device->run(other, push_bytes(part), groups);
    other.bind(kFirstBinding + 1, s.counts);
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
                                               kFirstBinding + 2, sizeof(OcclusionRecord));
  s.nearest_kernel->bind(kFirstBinding, s.points.device());
  s.nearest_kernel->bind(kFirstBinding + 1, s.sums);
  const auto run = [&](const OcclusionRecord& part, uint32_t groups) {
    return s.device->run(*s.nearest_kernel, push_bytes(part), groups);
  };
  return s.run_all(run, samples, kMaxNearestSamples, s.nearest_pace[samples.order], [](uint32_t) { return 1u; }, watch);
}

std::shared_ptr<DeviceAo> DeviceRays::empty_picture(size_t pixels, std::shared_ptr<DeviceAo> reused) const {
  const std::shared_ptr<Device>& device = state_->device;
  if (!reused || reused->pixels() != pixels || reused->device() != device)
    reused = std::make_shared<DeviceAo>(device, pixels);
  Commands commands;
  commands.fill(reused->values(), 0, pixels, std::bit_cast<uint32_t>(-1.0f)); // kInvalidAo
  commands.fill(reused->values(), pixels, pixels, 0);
  device->run(commands);
  return reused;
}

void DeviceRays::write_picture(DeviceAo& picture, uint32_t sample_count, bool nearest, double radius) {
  State& s = *state_;
  if (s.point_count == 0) return;
  if (!s.picture_kernel)
    s.picture_kernel = std::make_unique<Kernel>(s.device, spirv::occlusion_image(), std::span<const uint32_t>(), 4,
                                                static_cast<uint32_t>(sizeof(OcclusionImageRecord)));
  const Buffer &counts = nearest ? s.sums : s.counts, &sums = nearest ? s.sums : s.counts; // one of them is read
  const Buffer* const buffers[] = {&s.points.device(), &counts, &sums, &picture.values()};
  for (uint32_t i = 0; i < std::size(buffers); ++i) s.picture_kernel->bind(i, *buffers[i]);
  const OcclusionImageRecord record{
      1.0 / sample_count, radius, s.point_count, sample_count, static_cast<uint32_t>(picture.pixels()),
      nearest ? 1u : 0u};
  s.device->run(*s.picture_kernel, push_bytes(record), groups_of(s.point_count));
}

void DeviceRays::read_picture(const DeviceAo& picture, std::span<float> ao, std::span<float> hit_distance) const {
  picture.read(ao, hit_distance);
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
    s.rays_kernel = s.scene.make_kernel(spirv::occlusion_rays(), kFirstBinding + 3, sizeof(OcclusionRecord));
  s.rays_kernel->bind(kFirstBinding, s.points.device());
  s.rays_kernel->bind(kFirstBinding + 1, s.points.device()); // not used
  s.rays_kernel->bind(kFirstBinding + 2, rays);
  OcclusionRecord all = samples;
  for (uint64_t first = 0; first < s.point_count; first += s.most_threads()) {
    all.first_point = static_cast<uint32_t>(first);
    all.point_count = static_cast<uint32_t>(std::min(s.point_count - first, s.most_threads()));
    s.device->run(*s.rays_kernel, push_bytes(all), groups_of(all.point_count));
  }
  download(s.device, rays, 0, std::as_writable_bytes(out));
}

} // namespace packtrace::gpu
