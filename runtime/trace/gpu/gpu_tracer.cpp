#include "runtime/trace/gpu/gpu_tracer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device_view.h"
#include "runtime/trace/gpu/surface_tables.h"

namespace packtrace {

static_assert(sizeof(OcclusionPoint) == sizeof(gpu::PointRecord) &&
              offsetof(OcclusionPoint, up) == offsetof(gpu::PointRecord, up) &&
              offsetof(OcclusionPoint, normal) == offsetof(gpu::PointRecord, normal) &&
              offsetof(OcclusionPoint, pixel) == offsetof(gpu::PointRecord, pixel) &&
              offsetof(OcclusionPoint, x_px) == offsetof(gpu::PointRecord, x_px) &&
              offsetof(OcclusionPoint, y_px) == offsetof(gpu::PointRecord, y_px));
static_assert(sizeof(OcclusionSums) == 2 * sizeof(double));

namespace {

gpu::OcclusionRecord occlusion_record(const OcclusionSamples& samples, uint32_t lanes) {
  constexpr uint32_t kPerThread = 16;
  gpu::OcclusionRecord record{};
  record.first_sample = samples.first, record.sample_count = samples.count;
  record.per_thread = std::min(samples.count, kPerThread);
  record.idle_lanes = std::max(lanes / 4, 1u);
  record.order = gpu::kNetOrder, record.seed = samples.seed;
  record.tfar = samples.tfar, record.inverse_radius = samples.inverse_radius;
  record.lambda = samples.lambda, record.darkening = samples.darkening, record.end = samples.end;
  record.floor = samples.floor, record.scale = samples.scale, record.parabola = samples.parabola;
  return record;
}

gpu::DeviceRays::View view_of(const PrimaryCamera& camera, const UnitSpace& space) {
  const DAffine& place = camera.world_from_camera();
  const ImageSize size = camera.size();
  gpu::DeviceRays::View view{};
  gpu::ViewRecord& record = view.record;
  for (int axis = 0; axis < 3; ++axis) {
    for (int column = 0; column < 3; ++column) record.linear[3 * column + axis] = place[column][axis];
    record.eye[axis] = place[3][axis], record.centre[axis] = space.centre()[axis];
  }
  record.scale = space.scale(), record.near_ = UnitSpace::kNear;
  record.width = size.width, record.height = size.height;
  record.orthographic = camera.projection() == Projection::kOrthographic ? 1 : 0;
  view.film.reserve(size_t{size.width} + size.height);
  for (uint32_t x = 0; x < size.width; ++x) view.film.push_back(camera.film_x(x));
  for (uint32_t y = 0; y < size.height; ++y) view.film.push_back(camera.film_y(y));
  return view;
}

/// The planes of DeviceRays::read_surfaces().
SurfacePlanes surface_planes(const gpu::DeviceView& picture) {
  SurfacePlanes planes{picture.plane<float>(gpu::kViewZPlane),
                       picture.plane<Vec3>(gpu::kNormalPlane),
                       picture.plane<uint32_t>(gpu::kInstancePlane),
                       {},
                       {}};
  if (picture.has_motion())
    planes.motion_px = picture.plane<Vec2>(gpu::kMotionPlane),
    planes.previous_z = picture.plane<float>(gpu::kPreviousZPlane);
  return planes;
}

} // namespace

GpuTracer::GpuTracer(const BakedFile& file, const SceneSource& source, const GpuConfig& config, const Movers& movers,
                     std::shared_ptr<StructureCache> cache)
    : file_(file), source_(source), packed_(file, source, chosen_isa(), movers),
      tables_(file, source, packed_, config.structures) {
  upload(config, std::move(cache));
}

GpuTracer::GpuTracer(const BakedFile& file, const LodSource& source, const GpuConfig& config, const Movers& movers,
                     std::shared_ptr<StructureCache> cache)
    : file_(file), source_(source), packed_(file, source, chosen_isa(), movers),
      tables_(file, source, packed_, config.structures) {
  upload(config, std::move(cache));
}

void GpuTracer::upload(const GpuConfig& config, std::shared_ptr<StructureCache> cache) {
  scene_ = std::make_unique<gpu::GpuScene>(config, tables_.view());
  if (config.structures == GpuStructures::kDriver) {
    cache_ = cache ? std::move(cache) : std::make_shared<StructureCache>(config);
    scene_->use_structures(cache_->memory(), tables_.ranges());
    structures_ = cache_->take(*scene_->structures(), tables_.bottom_levels(), tables_.structure_keys());
    place_structures();
  }
  device_rays_ = std::make_unique<gpu::DeviceRays>(*scene_);
  device_ = scene_->device_name() + (scene_->emulates_floats() ? ", exact floats" : "");
}

void GpuTracer::place_structures() const {
  const uint64_t generation = cache_->generation();
  const packed::KernelScene& scene = packed_.kernel_scene();
  scene_->place_structures({scene.placements, scene.placement_count}, tables_.bottom_levels(),
                           cache_->structures(structures_.numbers()));
  structures_generation_ = generation;
}

/// Begins a frame of the cache. The caller holds device_rays_mutex_, as for all functions of structures: dispatches of
/// other threads use them.
void GpuTracer::begin_picture() const {
  if (!cache_) return;
  cache_->next_frame(*scene_->structures());
  follow_structures();
}

/// Places the structures again if the cache has moved some.
void GpuTracer::follow_structures() const {
  if (cache_ && structures_generation_ != cache_->generation()) place_structures();
}

/// Holds the structures where they are while spans of rays are traced. Does nothing for packed nodes.
std::unique_lock<std::mutex> GpuTracer::lock_structures() const {
  if (!cache_) return {};
  std::unique_lock lock(device_rays_mutex_);
  follow_structures();
  return lock;
}

void GpuTracer::closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder, std::span<RayHit> hits) const {
  assert(hits.size() == rays.size());
  const std::unique_lock lock = lock_structures();
  scene_->closest({kernel_rays(rays), rays.size()}, ray_class, {kernel_hits(hits), hits.size()});
}

void GpuTracer::trace_view(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits,
                           const Progress& progress) const {
  assert(hits.size() == rays.size());
  const std::unique_lock lock = lock_structures();
  begin_picture();
  scene_->closest({kernel_rays(rays), rays.size()}, ray_class, {kernel_hits(hits), hits.size()},
                  [&] { progress.check_cancelled(); });
}

std::shared_ptr<gpu::DeviceView> GpuTracer::trace_camera(const PrimaryCamera& camera, uint32_t ray_class,
                                                         std::shared_ptr<gpu::DeviceView> reused,
                                                         const Progress& progress) const {
  if (camera.projection() == Projection::kEnvironment) return nullptr;
  const std::lock_guard lock(device_rays_mutex_);
  begin_picture();
  try {
    return device_rays_->trace_view(view_of(camera, space()), ray_class, std::move(reused),
                                    [&](double) { progress.check_cancelled(); });
  } catch (const Error& error) { // spans of rays need less memory, and smaller buffers
    if (error.kind() != ErrorKind::kLimitExceeded && error.kind() != ErrorKind::kUnsupported) throw;
    return nullptr;
  }
}

std::span<const RayHit> GpuTracer::hits(const gpu::DeviceView& picture) const {
  const std::lock_guard lock(device_rays_mutex_);
  device_rays_->read_hits(picture);
  const std::span<const packed::KernelHit> hits = picture.hits();
  return {reinterpret_cast<const RayHit*>(hits.data()), hits.size()};
}

std::optional<SurfacePlanes> GpuTracer::make_surfaces(gpu::DeviceView& picture, const PrimaryCamera& now,
                                                      const PrimaryCamera& previous, double no_motion_px,
                                                      bool only_instances) const {
  constexpr double kMaxScale = 0x1p80; // devices may flush denormal floats, which surfaces in smaller units have
  if (!(space().scale() <= kMaxScale && space().scale() >= 1.0 / kMaxScale)) return std::nullopt;
  const gpu::SurfaceViewRecord record = surface_view_record(now, previous, space(), no_motion_px);
  const std::lock_guard lock(device_rays_mutex_);
  try {
    if (!std::exchange(surfaces_uploaded_, true)) {
      const SurfaceTables tables = surface_tables(file_, source_, packed_);
      device_rays_->set_surfaces(tables.instances, tables.lookup);
    }
    device_rays_->make_surfaces(picture, view_of(now, space()), record, only_instances);
  } catch (const Error& error) {
    surfaces_uploaded_ = false;
    if (error.kind() != ErrorKind::kLimitExceeded && error.kind() != ErrorKind::kUnsupported) throw;
    return std::nullopt;
  }
  if (only_instances) return SurfacePlanes{{}, {}, picture.plane<uint32_t>(gpu::kInstancePlane), {}, {}};
  return surface_planes(picture);
}

SurfacePlanes GpuTracer::read_surfaces(const gpu::DeviceView& picture) const {
  const std::lock_guard lock(device_rays_mutex_);
  device_rays_->read_surfaces(picture);
  return surface_planes(picture);
}

/// Takes no lock: leave_occlusion() may call it through OcclusionPoints::write().
PointPlanes GpuTracer::read_points(const gpu::DeviceView& picture, bool with_normals) const {
  device_rays_->read_points(picture);
  PointPlanes planes{picture.plane<Vec3>(gpu::kPositionPlane),
                     picture.plane<Vec3>(gpu::kGeometricPlane),
                     {},
                     picture.plane<float>(gpu::kOffsetPlane)};
  if (with_normals) {
    device_rays_->read_surfaces(picture);
    planes.normal = picture.plane<Vec3>(gpu::kNormalPlane);
  }
  return planes;
}

/// Traces the rays of all points, of as many at once as there is memory for.
void GpuTracer::trace_parts(const OcclusionPoints& points, const OcclusionSamples& samples, const TakeSums& take,
                            Progress& progress) const {
  constexpr size_t kMinPoints = 256;
  size_t at_once = points.count;
  uint64_t reported = 0;
  for (size_t first = 0; first < points.count;) {
    const size_t count = std::min(points.count - first, at_once);
    const auto report = [&](double share) {
      const auto done = std::max(reported, first + static_cast<uint64_t>(share * static_cast<double>(count)));
      progress.advance(done - std::exchange(reported, done));
    };
    try {
      trace_part(points, first, count, samples, report);
      take(first, count);
      report(1.0);
      first += count;
    } catch (const Error& error) { // fewer points at once, if there is no room for so many
      if (error.kind() != ErrorKind::kLimitExceeded || count <= kMinPoints) throw;
      at_once = count / 2;
      device_rays_->release();
      scene_->release_rays();
    }
  }
}

/// Traces the rays of points [first, first + count) if there is memory for them, else throws Error(kLimitExceeded).
/// @param report of the share that is done
void GpuTracer::trace_part(const OcclusionPoints& points, size_t first, size_t count, const OcclusionSamples& samples,
                           const std::function<void(double)>& report) const {
  device_rays_->set_points(count, [&](std::span<gpu::PointRecord> out) {
    points.write(first, {reinterpret_cast<OcclusionPoint*>(out.data()), out.size()});
  });
  trace_points(samples, report);
}

/// Traces the rays of the points that device_rays_ has.
void GpuTracer::trace_points(const OcclusionSamples& samples, const std::function<void(double)>& report) const {
  follow_structures();
  const gpu::OcclusionRecord record = occlusion_record(samples, scene_->subgroup_size());
  if (samples.nearest)
    device_rays_->sum_nearest(record, report);
  else
    device_rays_->count_occluded(record, report);
}

/// Traces the rays of points that the device makes of a picture's surfaces. Returns false if it cannot, or if there is
/// no memory for all of them at once.
bool GpuTracer::trace_picture(const OcclusionPoints& points, const OcclusionSamples& samples,
                              Progress& progress) const {
  if (!points.surfaces || !points.surfaces->picture->has_surfaces()) return false;
  const DeviceSurfaces& surfaces = *points.surfaces;
  gpu::PicturePointsRecord record{};
  for (int axis = 0; axis < 3; ++axis) record.centre[axis] = space().centre()[axis];
  record.scale = space().scale();
  record.width = surfaces.size.width, record.height = surfaces.size.height;
  record.colour = surfaces.colour.value_or(2u), record.offset_scale = surfaces.offset_scale;
  uint64_t reported = 0;
  const auto report = [&](double share) {
    const auto done = std::max(reported, static_cast<uint64_t>(share * static_cast<double>(points.count)));
    progress.advance(done - std::exchange(reported, done));
  };
  try {
    device_rays_->set_points(*surfaces.picture, record);
    trace_points(samples, report);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kLimitExceeded || reported > 0) throw;
    device_rays_->release();
    return false;
  }
  report(1.0);
  return true;
}

void GpuTracer::trace_occlusion(const OcclusionPoints& points, const OcclusionSamples& samples,
                                std::span<OcclusionSums> sums, Progress& progress) const {
  assert(sums.size() == points.count);
  const std::lock_guard lock(device_rays_mutex_);
  const auto take = [&](size_t first, size_t count) {
    const std::span<OcclusionSums> out = sums.subspan(first, count);
    if (samples.nearest) {
      device_rays_->sums({reinterpret_cast<double*>(out.data()), 2 * count});
      return;
    }
    std::vector<uint32_t> counts(count);
    device_rays_->counts(counts);
    for (size_t i = 0; i < count; ++i) {
      const double open = samples.count - counts[i];
      out[i] = {open, open + 0.5 * counts[i]};
    }
  };
  trace_parts(points, samples, take, progress);
}

std::shared_ptr<gpu::DeviceAo> GpuTracer::leave_occlusion(const OcclusionPoints& points,
                                                          const OcclusionSamples& samples,
                                                          const OcclusionPicture& picture,
                                                          std::shared_ptr<gpu::DeviceAo> reused,
                                                          Progress& progress) const {
  const std::lock_guard lock(device_rays_mutex_);
  std::shared_ptr<gpu::DeviceAo> out = device_rays_->empty_picture(picture.pixels, std::move(reused));
  const auto take = [&](size_t, size_t) {
    device_rays_->write_picture(*out, samples.count, samples.nearest, picture.radius);
  };
  if (trace_picture(points, samples, progress))
    take(0, points.count);
  else
    trace_parts(points, samples, take, progress);
  return out;
}

void GpuTracer::read_occlusion(const gpu::DeviceAo& picture, std::span<float> ao, std::span<float> hit_distance) const {
  device_rays_->read_picture(picture, ao, hit_distance);
}

void GpuTracer::any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder, std::span<uint8_t> occluded) const {
  assert(occluded.size() == rays.size());
  const std::unique_lock lock = lock_structures();
  scene_->any({kernel_rays(rays), rays.size()}, ray_class, occluded);
}

void GpuTracer::place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) {
  packed_.place_instances(instances, world_from_object);
  tables_.update_placements();
  scene_->replace_placements(tables_.view());
  surfaces_uploaded_ = false;
  if (cache_) place_structures();
}

std::vector<TreeBytes> GpuTracer::tree_bytes() const {
  if (!cache_) return packed_.tree_bytes();
  const TracedTrees& traced = packed_.traced_trees();
  std::vector<TreeBytes> trees(traced.records.size());
  for (uint32_t geometry = 0; geometry < traced.tree_of.size(); ++geometry)
    if (const uint32_t tree = traced.tree_of[geometry];
        tree != baked::kNone && traced.records[tree].geometry != baked::kWorldTree)
      trees[tree].geometry = geometry;
  for (size_t i = 0; i < structures_.numbers().size(); ++i) {
    TreeBytes& tree = trees[tables_.bottom_levels()[i].tree];
    const auto [worst_case, now] = cache_->bytes(structures_.numbers()[i]);
    tree.worst_case += worst_case, tree.built += now;
  }
  return trees;
}

std::vector<ResidentPart> GpuTracer::resident() const {
  std::vector<ResidentPart> parts = packed_.resident();
  parts.push_back({"on the GPU", scene_->bytes() + device_rays_->surface_bytes(), false});
  if (cache_) parts.push_back({"acceleration structures", cache_->stats().resident_bytes, true});
  return parts;
}

} // namespace packtrace
