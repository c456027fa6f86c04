#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

namespace gpu {
class DeviceAo;
class DeviceView;
} // namespace gpu

/// A surface point from which occlusion rays start, in a tracer's space().
struct OcclusionPoint {
  Vec3 origin; ///< lifted off the surface
  Vec3 up;     ///< geometric normal, unit length
  Vec3 normal; ///< shading normal, unit length
  uint32_t pixel = 0;
  uint32_t x_px = 0, y_px = 0;
};

/// Surfaces of a picture on a device, of which the device can make the points itself.
struct DeviceSurfaces {
  const gpu::DeviceView* picture;
  ImageSize size;
  std::optional<uint32_t> colour; ///< SamplePlan::colour
  float offset_scale;             ///< AoConfig::offset_scale
};

/// Writes points into memory of a tracer.
struct OcclusionPoints {
  size_t count = 0;
  /// Writes points [first, first + out.size()). It may use all cores.
  std::function<void(size_t first, std::span<OcclusionPoint> out)> write;
  std::optional<DeviceSurfaces> surfaces = std::nullopt; ///< with the same points
};

/// Arrays of a GBuffer that a tracer made, one entry per pixel, rows top to bottom. Valid until the picture's memory is
/// used again.
struct SurfacePlanes {
  std::span<const float> view_z;
  std::span<const Vec3> normal;
  std::span<const uint32_t> instance;
  std::span<const Vec2> motion_px;   ///< empty: zero everywhere
  std::span<const float> previous_z; ///< empty: as view_z
};
struct PointPlanes {
  std::span<const Vec3> position, geometric_normal;
  std::span<const Vec3> normal; ///< shading normals; empty unless they were asked for
  std::span<const float> offset;
};

/// The samples of all points: of SamplerKind::kSpaceTimeNet, directed as ShadingPoints::write_rays() does.
struct OcclusionSamples {
  uint32_t first = 0, count = 1; ///< numbers in the pixels' sequences
  uint32_t seed = 0;             ///< of the sampler
  float tfar = 0.0f;
  bool nearest = false; ///< nearest hits and a visibility curve; else any hits, which occlude fully
  // Of nearest hits: members of VisibilityCurve, and radii per length of space().
  float inverse_radius = 0.0f, lambda = 0.0f, darkening = 0.0f, end = 0.0f, floor = 0.0f, scale = 0.0f, parabola = 0.0f;
};

/// Sums over the samples of a point, added in order.
struct OcclusionSums {
  double visibility = 0.0;
  double distance = 0.0; ///< in radii; with any hits a hit counts as 0.5
};

/// A picture that sums become.
struct OcclusionPicture {
  size_t pixels = 0;
  double radius = 0.0; ///< of occlusion, in the units of hit distances
};

/// A tracer that is fast only for the rays of a whole picture at once. All functions may be called from several
/// threads and throw Error(kCancelled) within a part of a second.
class ViewTracer {
public:
  virtual ~ViewTracer() = default;

  /// As RayTracer::closest_hits().
  virtual void trace_view(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits,
                          const Progress& progress) const = 0;

  /// Makes the rays of all pixels of a camera and traces them: the bits of PrimaryCamera::linear_ray() and
  /// approach_scene(). Returns null for environment cameras, and if there is no memory for a whole picture.
  /// @param reused a picture whose memory may be used, or null
  virtual std::shared_ptr<gpu::DeviceView> trace_camera(const PrimaryCamera& camera, uint32_t ray_class,
                                                        std::shared_ptr<gpu::DeviceView> reused,
                                                        const Progress& progress) const = 0;
  /// The hits of such a picture, one per pixel. Valid until its memory is used again.
  virtual std::span<const RayHit> hits(const gpu::DeviceView& picture) const = 0;
  /// Makes the surfaces that the rays of such a picture hit: the bits of trace_primary(). Returns nothing if
  /// there is no memory for them, or the scene's scale is so extreme that the device may round differently.
  /// @param now the picture's camera
  /// @param previous not an environment camera; motion is that of surfaces at rest since this camera
  /// @param no_motion_px kNoMotionPx
  /// @param only_instances read only the instances; the other spans are empty, and their planes stay on the device
  virtual std::optional<SurfacePlanes> make_surfaces(gpu::DeviceView& picture, const PrimaryCamera& now,
                                                     const PrimaryCamera& previous, double no_motion_px,
                                                     bool only_instances) const = 0;
  /// Reads the planes that make_surfaces() left on the device.
  virtual SurfacePlanes read_surfaces(const gpu::DeviceView& picture) const = 0;
  /// Reads the points of such surfaces.
  virtual PointPlanes read_points(const gpu::DeviceView& picture, bool with_normals) const = 0;

  /// Makes the occlusion rays of all points and sums up their results: the bits that trace_ao() computes from spans of
  /// rays.
  /// @param sums as many as points
  /// @param progress advances by the number of points
  virtual void trace_occlusion(const OcclusionPoints& points, const OcclusionSamples& samples,
                               std::span<OcclusionSums> sums, Progress& progress) const = 0;

  /// Does the same, and leaves the points' means in a picture on the device: AO, or -1 where there is no point, and hit
  /// distances, or 0.
  /// @param reused a picture whose memory may be used, or null
  virtual std::shared_ptr<gpu::DeviceAo> leave_occlusion(const OcclusionPoints& points, const OcclusionSamples& samples,
                                                         const OcclusionPicture& picture,
                                                         std::shared_ptr<gpu::DeviceAo> reused,
                                                         Progress& progress) const = 0;
  /// Reads such a picture, one entry per pixel.
  virtual void read_occlusion(const gpu::DeviceAo& picture, std::span<float> ao,
                              std::span<float> hit_distance) const = 0;
};

} // namespace packtrace
