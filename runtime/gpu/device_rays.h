#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/gpu/gpu_scene.h"

namespace packtrace::gpu {

class DeviceAo;
class DeviceView;

/// Device time of some dispatches, in ms.
struct DeviceTime {
  double ms = 0.0;
  double longest_ms = 0.0;
  uint32_t dispatches = 0;
};

/// Camera and occlusion rays that are made on the device and never leave it. Not for several threads at once.
class DeviceRays {
public:
  /// Called before each dispatch with the completed fraction of the call's work; may throw.
  using Watch = std::function<void(double share)>;

  /// @param scene must outlive this object
  explicit DeviceRays(const GpuScene& scene);
  ~DeviceRays();

  /// Traces a ray through each pixel, in blocks of 8 x 4 pixels; the picture may have any size.
  /// @param keep_rays whether rays() and make_points() will be called
  DeviceTime trace_camera(const CameraRecord& camera, bool keep_rays);
  /// Makes a point of each pixel that was hit, lifted off its surface by a length of unit space.
  void make_points(float lift);

  /// The camera of a picture.
  struct View {
    ViewRecord record;
    std::vector<double> film; ///< PrimaryCamera::film_x() of all columns, then film_y() of all rows
  };
  /// Traces the rays of all pixels of a camera.
  /// @param reused a picture whose memory may be used, or null
  std::shared_ptr<DeviceView> trace_view(const View& view, uint32_t ray_class, std::shared_ptr<DeviceView> reused,
                                         const Watch& watch);
  /// Reads the hits of a picture back.
  void read_hits(const DeviceView& picture) const;

  /// Uploads the tables of instances and clusters that make_surfaces() reads.
  /// @param lookup instance of each placement, then the words of a NormalRecord for each cluster
  void set_surfaces(std::span<const InstanceSurface> instances, std::span<const uint32_t> lookup);
  /// Makes the planes of a picture that trace_view() traced. Needs set_surfaces(). Throws as Buffer does.
  /// @param view the picture's
  /// @param only_instances whether only the plane of instances is read back, rather than all that read_surfaces() reads
  void make_surfaces(DeviceView& picture, const View& view, const SurfaceViewRecord& surfaces, bool only_instances);
  /// Reads depths, normals and instances back, and motion and previous depths if DeviceView::has_motion().
  void read_surfaces(const DeviceView& picture) const;
  /// Reads the planes of the points back.
  void read_points(const DeviceView& picture) const;
  /// Device memory of set_surfaces().
  uint64_t surface_bytes() const;

  /// Replaces the points, which lie on surfaces of the scene. Throws Error(kLimitExceeded) for more than 2^31.
  /// @param write writes all points; it must not read them
  void set_points(size_t count, const std::function<void(std::span<PointRecord>)>& write);
  /// Does the same with points that are there.
  void set_points(std::span<const PointRecord> points);
  /// Makes a point of each pixel that shows a surface.
  /// @param points.first, points.count are ignored
  void set_points(const DeviceView& picture, PicturePointsRecord points);

  /// Counts for each point how many of its rays hit something. Ignores the points of the record.
  /// Throws Error(kUnsupported) if a kernel's loop ended early.
  DeviceTime count_occluded(const OcclusionRecord& samples, const Watch& watch = {});
  /// Sums visibility and distance of the nearest hits of each point's rays up, in the order of the samples.
  DeviceTime sum_nearest(const OcclusionRecord& samples, const Watch& watch = {});

  /// A picture without any value: AO of -1.
  std::shared_ptr<DeviceAo> empty_picture(size_t pixels, std::shared_ptr<DeviceAo> reused) const;
  /// Writes the results of count_occluded() or sum_nearest() to the points' pixels.
  /// @param nearest results of sum_nearest()
  /// @param radius of occlusion, in the units of hit distances
  void write_picture(DeviceAo& picture, uint32_t sample_count, bool nearest, double radius);

  /// Reads a picture, one entry per pixel.
  void read_picture(const DeviceAo& picture, std::span<float> ao, std::span<float> hit_distance) const;

  /// Frees the memory of points and of their results.
  void release();

  /// Kernel::statistics() of the kernels in use, by name.
  std::map<std::string, std::vector<std::pair<std::string, double>>> kernel_statistics() const;

  uint32_t point_count() const;
  /// Downloads the results of trace_camera(), one per pixel.
  void hits(std::span<packed::KernelHit> out) const;
  void rays(std::span<packed::KernelRay> out) const;
  /// Downloads one value per surface point.
  void points(std::span<PointRecord> out) const;
  void counts(std::span<uint32_t> out) const;
  /// By point, of sum_nearest(): visibility and distance, two each.
  void sums(std::span<double> out) const;
  /// Returns the rays of sample `samples.first_sample`. Rays of points without a surface hit nothing.
  void occlusion_rays(const OcclusionRecord& samples, std::span<packed::KernelRay> out);

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace packtrace::gpu
