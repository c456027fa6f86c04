#pragma once

#include <optional>
#include <span>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"
#include "runtime/trace/surface_albedo.h"

namespace packtrace {

/// Motion per axis of points that the previous camera cannot project: beyond any image.
inline constexpr float kNoMotionPx = 1e9f;

/// The previous shape of surfaces that deform.
class SurfaceHistory {
public:
  virtual ~SurfaceHistory() = default;

  /// Returns where a point of a surface was in the previous frame, in object space; none if the surface does not
  /// deform. It is called once per pixel that shows a surface, from several threads.
  /// @param triangle number in the instance's geometry
  /// @param barycentrics weights of the triangle's second and third vertex
  virtual std::optional<DVec3> previous_position(uint32_t instance, uint32_t triangle,
                                                 glm::dvec2 barycentrics) const = 0;
};

/// Moves the origin of a ray that starts far away to just before the scene: floats resolve the scene there, and Embree
/// accepts origins up to 1.8e18 only. Returns false, with a harmless ray, if the ray misses the scene.
/// @param ray of unit space
bool approach_scene(CameraRay& ray);

/// The previous frame, against which motion is measured. All references must stay valid until trace_primary() returns.
struct PreviousFrame {
  const PrimaryCamera& camera; ///< the previous frame's
  /// The previous frame's transforms, by instance; empty: no instance moved.
  std::span<const Affine> world_from_object = {};
  const SurfaceHistory* surfaces = nullptr; ///< null: no surface deforms
};

/// Traces one ray per pixel of now's image and fills the channels of the G-buffer, which is resized if needed.
/// Positions are computed in double from the decoded vertices of the triangle that is hit, so they lie on its plane to
/// within half an ulp per axis. A surface without vertex normals gets the geometric normal as its shading normal.
/// Motion is the pixel's centre minus the projection by the previous camera of the place where the same point of the
/// surface was. It is exactly zero for surfaces that did not move under equal cameras. ray_offset.h describes offset.
/// The result is the same for any number of threads. Throws Error(kCancelled), and Error(kUsage) for previous
/// transforms that are not one per instance.
void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PreviousFrame& previous, GBuffer& gbuffer, Progress& progress,
                   const TextureFilter& textures = {});

/// The hit of a camera ray, with values as in GBuffer.
struct CameraHit {
  Vec3 position{0};
  uint32_t instance = kNoInstance, triangle = 0, material = 0;
  bool back_face = false;
};

/// Traces the camera ray of a pixel again, together with those of its tile, so that its hit equals that of
/// trace_primary(). Returns none for a miss.
std::optional<CameraHit> trace_pixel(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera,
                                     uint32_t x, uint32_t y);

/// Width that a pixel covers at a depth, across the ray; world units.
/// @param view_z as in GBuffer::view_z
float pixel_width(const PrimaryCamera& camera, float view_z);

/// Does the same if only the camera moved, with textures looked up at points.
void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PrimaryCamera& previous, GBuffer& gbuffer, Progress& progress);

} // namespace packtrace
