#include <algorithm>
#include <bit>
#include <utility>

#include "runtime/gpu/device_ao.h"
#include "runtime/gpu/device_rays_state.h"
#include "runtime/gpu/device_view.h"
#include "runtime/gpu/shaders/spirv.h"

// The functions of DeviceRays for whole pictures.
namespace packtrace::gpu {

namespace {

/// Planes [first, end) of a picture.
struct PlaneRange {
  uint32_t first, end;
};

/// The planes that read_surfaces() reads: depths, normals and instances, and motion and previous depths if surfaces
/// moved.
PlaneRange surface_planes(bool moved) { return {kViewZPlane, moved ? kPositionPlane : kMotionPlane}; }

uint64_t plane_bytes(const DeviceView& picture, uint32_t planes) {
  return uint64_t{planes} * sizeof(uint32_t) * picture.pixels();
}

} // namespace

/// Writes the camera that kernels read.
void DeviceRays::State::write_view(Commands& commands, const View& from) {
  if (view.bytes() == 0) view = StagedBuffer(device, sizeof from.record, "the camera");
  const std::span<const std::byte> film_bytes = std::as_bytes(std::span(from.film));
  if (film.bytes() < film_bytes.size()) film = StagedBuffer(device, film_bytes.size(), "the camera's film");
  view.write(commands, push_bytes(from.record));
  film.write(commands, film_bytes);
}

std::shared_ptr<DeviceView> DeviceRays::trace_view(const View& view, uint32_t ray_class,
                                                   std::shared_ptr<DeviceView> reused, const Watch& watch) {
  State& s = *state_;
  s.follow_scene();
  const uint32_t width = view.record.width, height = view.record.height;
  require_few_pixels(width, height);
  const size_t pixels = size_t{width} * height;
  if (!reused || reused.use_count() > 1 || reused->pixels() != pixels || reused->device() != s.device) {
    reused.reset();
    reused = std::make_shared<DeviceView>(s.device, pixels);
  }
  reused->set_surfaces(false, false);
  Commands commands;
  s.write_view(commands, view);
  s.device->run(commands);
  if (!s.view_kernel)
    s.view_kernel =
        s.scene.make_ray_kernel({spirv::view(), spirv::view_rays()}, kFirstRayBinding + 3, sizeof(SpanRecord));
  const Buffer* const buffers[] = {&s.view.device(), &s.film.device(), &reused->hits_buffer().device()};
  s.run_pixels(*s.view_kernel, buffers, width, height, ray_class, false, watch);
  return reused;
}

void DeviceRays::read_hits(const DeviceView& picture) const {
  const StagedBuffer& hits = picture.hits_buffer();
  state_->device->copy(hits.device(), hits.host(), 0, 0, picture.pixels() * sizeof(packed::KernelHit));
}

void DeviceRays::set_surfaces(std::span<const InstanceSurface> instances, std::span<const uint32_t> lookup) {
  State& s = *state_;
  s.instances = Buffer(), s.lookup = Buffer();
  s.instances = upload(s.device, std::as_bytes(instances), "instances", 0);
  s.lookup = upload(s.device, std::as_bytes(lookup), "places of normals", 0);
}

uint64_t DeviceRays::surface_bytes() const { return state_->instances.bytes() + state_->lookup.bytes(); }

void DeviceRays::make_surfaces(DeviceView& picture, const View& view, const SurfaceViewRecord& surfaces,
                               bool only_instances) {
  State& s = *state_;
  s.follow_scene();
  const StagedBuffer& planes = picture.planes();
  if (s.surface_view.bytes() == 0) s.surface_view = StagedBuffer(s.device, sizeof surfaces, "cameras of surfaces");
  if (!s.surfaces_kernel)
    s.surfaces_kernel = s.scene.make_kernel(spirv::surfaces(), kFirstRayBinding + 7, sizeof(SpanRecord));
  Commands commands;
  s.write_view(commands, view);
  s.surface_view.write(commands, push_bytes(surfaces));
  const Buffer* const buffers[] = {&s.view.device(), &s.film.device(), &picture.hits_buffer().device(), &s.instances,
                                   &s.lookup,        &planes.device(), &s.surface_view.device()};
  for (uint32_t i = 0; i < std::size(buffers); ++i) s.surfaces_kernel->bind(kFirstRayBinding + i, *buffers[i]);
  const uint64_t threads = block_threads(view.record.width, view.record.height);
  for (uint64_t first = 0; first < threads; first += s.most_threads()) {
    const uint64_t count = std::min(threads - first, s.most_threads());
    const SpanRecord span{static_cast<uint32_t>(first), static_cast<uint32_t>(count), 0, 0};
    commands.dispatch(*s.surfaces_kernel, push_bytes(span), groups_of(count), 1);
  }
  const PlaneRange read =
      only_instances ? PlaneRange{kInstancePlane, kInstancePlane + 1} : surface_planes(surfaces.moved != 0);
  const uint64_t begin = plane_bytes(picture, read.first), bytes = plane_bytes(picture, read.end - read.first);
  commands.copy(planes.device(), planes.host(), begin, begin, bytes);
  s.device->run(commands);
  picture.set_surfaces(true, surfaces.moved != 0);
}

void DeviceRays::read_surfaces(const DeviceView& picture) const {
  const PlaneRange read = surface_planes(picture.has_motion());
  const uint64_t begin = plane_bytes(picture, read.first), bytes = plane_bytes(picture, read.end - read.first);
  state_->device->copy(picture.planes().device(), picture.planes().host(), begin, begin, bytes);
}

void DeviceRays::read_points(const DeviceView& picture) const {
  const uint64_t begin = plane_bytes(picture, kPositionPlane);
  const StagedBuffer& planes = picture.planes();
  state_->device->copy(planes.device(), planes.host(), begin, begin, planes.bytes() - begin);
}

void DeviceRays::set_points(const DeviceView& picture, PicturePointsRecord points) {
  State& s = *state_;
  const uint64_t threads = block_threads(points.width, points.height);
  s.point_count = static_cast<uint32_t>(threads);
  s.make_room_for_points();
  if (!s.picture_points_kernel)
    s.picture_points_kernel = std::make_unique<Kernel>(s.device, spirv::picture_points(), std::span<const uint32_t>(),
                                                       2, static_cast<uint32_t>(sizeof(PicturePointsRecord)));
  s.picture_points_kernel->bind(0, picture.planes().device());
  s.picture_points_kernel->bind(1, s.points.device());
  Commands commands;
  for (uint64_t first = 0; first < threads; first += s.most_threads()) {
    points.first = static_cast<uint32_t>(first);
    points.count = static_cast<uint32_t>(std::min(threads - first, s.most_threads()));
    commands.dispatch(*s.picture_points_kernel, push_bytes(points), groups_of(points.count), 1);
  }
  s.device->run(commands);
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
  const Buffer& results = nearest ? s.nearest.results : s.any.results; // bound twice; the kernel reads one binding
  const Buffer* const buffers[] = {&s.points.device(), &results, &results, &picture.values()};
  for (uint32_t i = 0; i < std::size(buffers); ++i) s.picture_kernel->bind(i, *buffers[i]);
  const OcclusionImageRecord record{
      1.0 / sample_count, radius, s.point_count, sample_count, static_cast<uint32_t>(picture.pixels()),
      nearest ? 1u : 0u};
  s.device->run(*s.picture_kernel, push_bytes(record), groups_of(s.point_count));
}

void DeviceRays::read_picture(const DeviceAo& picture, std::span<float> ao, std::span<float> hit_distance) const {
  picture.read(ao, hit_distance);
}

} // namespace packtrace::gpu
