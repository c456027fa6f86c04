#include "runtime/camera/device_surfaces.h"

#include <cstring>
#include <optional>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {

bool make_device_surfaces(const ViewTracer& tracer, const PrimaryCamera& now, const PreviousFrame& previous,
                          GBuffer& gbuffer) {
  if (gbuffer.channels != 0 || !previous.world_from_object.empty() || previous.surfaces != nullptr ||
      previous.camera.projection() == Projection::kEnvironment)
    return false;
  const std::optional<SurfacePlanes> planes =
      tracer.make_surfaces(*gbuffer.on_gpu, now, previous.camera, double{kNoMotionPx});
  if (!planes) return false;
  constexpr size_t kPixels = 1u << 14; // of a task
  tbb::parallel_for(tbb::blocked_range<size_t>(0, gbuffer.size.pixels(), kPixels),
                    [&](const tbb::blocked_range<size_t>& pixels) {
                      const auto copy = [&]<class Value>(std::span<const Value> from, auto& to) {
                        std::memcpy(&to[pixels.begin()], &from[pixels.begin()], pixels.size() * sizeof(Value));
                      };
                      copy(planes->view_z, gbuffer.view_z), copy(planes->normal, gbuffer.normal);
                      copy(planes->instance, gbuffer.instance), copy(planes->motion_px, gbuffer.motion_px);
                      if (!gbuffer.previous_z.empty()) copy(planes->previous_z, gbuffer.previous_z);
                      copy(planes->position, gbuffer.position), copy(planes->offset, gbuffer.offset);
                      copy(planes->geometric_normal, gbuffer.geometric_normal);
                    });
  return true;
}

} // namespace packtrace
