#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <embree3/rtcore.h>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Computes distances of points from a triangle mesh.
class SurfaceDistance {
public:
  /// @param positions, triangles must outlive this object; positions in float range, at least one triangle
  SurfaceDistance(std::span<const DVec3> positions, std::span<const Triangle> triangles);
  ~SurfaceDistance();
  SurfaceDistance(const SurfaceDistance&) = delete;
  SurfaceDistance& operator=(const SurfaceDistance&) = delete;

  /// Distance of the nearest point of the mesh, computed in double for the nearest triangle.
  double operator()(DVec3 point) const;

private:
  std::span<const DVec3> positions_;
  std::span<const Triangle> triangles_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

/// The distance of one surface from another, over many sample points.
struct DistanceStats {
  double rms = 0.0, max = 0.0;
};

/// Samples `from` at its corners and at about `samples` more points, evenly over its area and the same in each call,
/// and measures their distances from the other surface.
DistanceStats surface_distance(std::span<const DVec3> from_positions, std::span<const Triangle> from_triangles,
                               const SurfaceDistance& to, size_t samples);

} // namespace packtrace
