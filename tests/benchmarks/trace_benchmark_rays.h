#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/scene/camera_rays.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Rays as the renderer hands them to a tracer that wants no more than 1,024 together, span by span.
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

/// One frame of a scene.
struct RecordedFrame {
  PrimaryCamera camera;
  float ao_radius = 0.0f;
  std::vector<RecordedRays> phases; ///< "primary"; "ao any", without falloff; "ao closest", with it
};

/// Records the rays of one frame.
/// @param tracer of the source; its space is that of the rays
/// @param camera number, or "auto"; that instead of camera 0 where it sees nothing
/// Throws Error(kUsage) for a camera that is not there, Error(kInput) where it sees nothing.
RecordedFrame record_frame(const SceneSource& source, const RayTracer& tracer, const std::string& camera,
                           ImageSize size);

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

/// Rays of which two tracers disagree: whether there is a hit, or in t by more than t_tolerance().
/// @param t_scale what a length of b is in a's space
uint64_t mismatches(const RecordedRays& recorded, const RayResults& a, const RayResults& b, double t_scale);

} // namespace packtrace
