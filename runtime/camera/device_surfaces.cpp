#include "runtime/camera/device_surfaces.h"

#include <cstring>
#include <optional>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

/// Copies a plane into an array of its length, on all cores.
template <typename Value>
void copy_plane(std::span<const Value> plane, auto& array) {
  constexpr size_t kValues = 1u << 15; // of a task
  tbb::parallel_for(tbb::blocked_range<size_t>(0, plane.size(), kValues), [&](const tbb::blocked_range<size_t>& part) {
    std::memcpy(&array[part.begin()], &plane[part.begin()], part.size() * sizeof(Value));
  });
}

void copy_guides(const SurfacePlanes& planes, GBuffer& out) {
  copy_plane(planes.view_z, out.view_z), copy_plane(planes.normal, out.normal);
  if (planes.motion_px.empty())
    out.motion_px.assign(out.size.pixels(), Vec2(0));
  else
    copy_plane(planes.motion_px, out.motion_px), copy_plane(planes.previous_z, out.previous_z);
}

void copy_points(const PointPlanes& planes, GBuffer& out) {
  const size_t pixels = planes.offset.size();
  out.position.resize(pixels), out.geometric_normal.resize(pixels), out.offset.resize(pixels);
  copy_plane(planes.position, out.position), copy_plane(planes.geometric_normal, out.geometric_normal);
  copy_plane(planes.offset, out.offset);
}

} // namespace

bool make_device_surfaces(const ViewTracer& tracer, const PrimaryCamera& now, const PreviousFrame& previous,
                          GBuffer& gbuffer) {
  if (gbuffer.channels != 0 || !previous.world_from_object.empty() || previous.surfaces != nullptr ||
      previous.camera.projection() == Projection::kEnvironment)
    return false;
  const std::optional<SurfacePlanes> planes =
      tracer.make_surfaces(*gbuffer.on_gpu, now, previous.camera, double{kNoMotionPx}, gbuffer.guides_may_stay_on_gpu);
  if (!planes) return false;
  copy_plane(planes->instance, gbuffer.instance);
  gbuffer.guides_on_gpu = gbuffer.guides_may_stay_on_gpu;
  if (!gbuffer.guides_on_gpu) copy_guides(*planes, gbuffer);
  gbuffer.points_on_gpu = gbuffer.points_may_stay_on_gpu;
  if (gbuffer.points_on_gpu)
    gbuffer.forget_points();
  else
    copy_points(tracer.read_points(*gbuffer.on_gpu, false), gbuffer);
  return true;
}

void read_device_guides(const ViewTracer& tracer, GBuffer& gbuffer) {
  copy_guides(tracer.read_surfaces(*gbuffer.on_gpu), gbuffer);
  gbuffer.guides_on_gpu = false;
}

void read_device_points(const ViewTracer& tracer, const GBuffer& gbuffer, GBuffer& out) {
  out.size = gbuffer.size;
  const PointPlanes planes = tracer.read_points(*gbuffer.on_gpu, gbuffer.guides_on_gpu);
  out.normal = gbuffer.normal;
  if (gbuffer.guides_on_gpu) copy_plane(planes.normal, out.normal);
  copy_points(planes, out);
}

} // namespace packtrace
