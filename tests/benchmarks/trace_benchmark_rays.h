#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/scene/camera_rays.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Whether the ray traces nothing, because its interval is empty.
inline bool is_gap(const Ray& ray) { return !(ray.tnear <= ray.tfar); }

/// Rays as the renderer passes them to a tracer that takes at most 1,024 rays per call, span by span.
struct RecordedRays {
  std::string_view name;
  uint32_t ray_class = 0;
  RayOrder order = RayOrder::kIncoherent;
  bool any = false; ///< for any_hits(), otherwise for closest_hits()
  std::vector<Ray> rays;
  std::vector<size_t> ends; ///< ends of the spans, ascending; the last is rays.size()

  /// Number of rays, without gaps.
  uint64_t count() const;
};

/// The rays of one frame of a scene.
struct RecordedFrame {
  PrimaryCamera camera;
  float ao_radius = 0.0f;
  std::vector<RecordedRays> phases; ///< "primary", "ao any" (without falloff) and "ao closest" (with falloff)
};

/// Records the rays of one frame.
/// @param tracer for the source; the recorded rays are in its space
/// @param camera number, or "auto"; if camera 0 sees nothing, "auto" is used instead
/// Throws Error(kUsage) if the camera does not exist, Error(kInput) if it sees nothing.
RecordedFrame record_frame(const SceneSource& source, const RayTracer& tracer, const std::string& camera,
                           ImageSize size);

/// Times the renderer's passes over the same frame, per phase: generating rays, tracing them and processing the hits.
/// Returns the minimum over `repeats`, in seconds.
std::vector<double> time_passes(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera,
                                float ao_radius, uint32_t repeats, bool cpu_clock);

/// Transforms rays to another tracer's space. t counts lengths of that space.
std::vector<RecordedRays> moved(std::vector<RecordedRays> recorded, const UnitSpace& from, const UnitSpace& to);

/// A tracer's answers per ray.
struct RayResults {
  std::vector<uint8_t> occluded; ///< of any_hits()
  std::vector<RayHit> hits;      ///< of closest_hits()
};

/// Traces all rays on all available threads, with spans in parallel.
/// @return seconds of wall time, or of CPU time of all threads
double replay(const RecordedRays& recorded, const RayTracer& tracer, RayResults& results, bool cpu_clock);

/// Counts the rays for which two tracers disagree: in whether there is a hit, or in t by more than t_tolerance().
/// @param t_scale factor from b's lengths to a's
uint64_t mismatches(const RecordedRays& recorded, const RayResults& a, const RayResults& b, double t_scale);

} // namespace packtrace
