#pragma once

#include <string_view>
#include <vector>

#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/camera_rays.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Rays as the renderer hands them to a tracer, span by span.
struct RecordedRays {
  std::string_view name;
  uint32_t ray_class = 0;
  RayOrder order = RayOrder::kIncoherent;
  bool any = false; ///< any_hits(), else closest_hits()
  std::vector<Ray> rays;
  std::vector<size_t> ends; ///< of the spans, ascending; the last is rays.size()

  /// Those that are no gaps.
  uint64_t count() const;
};

/// The rays of one frame: "primary"; "ao any", without falloff; "ao closest", with it.
/// @param tracer of the source; its space is that of the rays
std::vector<RecordedRays> record_frame(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera,
                                       float ao_radius);

/// Seconds that the renderer's passes over the same frame take, by phase: rays, what makes them and what is made of
/// their hits. The least of `repeats`.
std::vector<double> time_passes(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera,
                                float ao_radius, uint32_t repeats, bool cpu_clock);

/// The same in another tracer's space. t counts lengths there.
std::vector<RecordedRays> moved(std::vector<RecordedRays> recorded, const UnitSpace& from, const UnitSpace& to);

/// What a tracer said of each ray.
struct RayResults {
  std::vector<uint8_t> occluded; ///< of any_hits()
  std::vector<RayHit> hits;      ///< of closest_hits()
};

/// Traces all of it on the threads there are, spans side by side.
/// @return seconds of wall time, or of CPU time of all threads
double replay(const RecordedRays& recorded, const RayTracer& tracer, RayResults& results, bool cpu_clock);

/// Rays of which two tracers disagree: whether there is a hit, or in t by more than 1e-4 of it.
/// @param t_scale what a length of b is in a's space
uint64_t mismatches(const RecordedRays& recorded, const RayResults& a, const RayResults& b, double t_scale);

} // namespace packtrace
