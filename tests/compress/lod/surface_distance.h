#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <embree3/rtcore.h>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A triangle mesh that answers how far points are from it.
class SurfaceDistance {
public:
  /// Both spans must outlive it. Positions within the float range, at least one triangle.
  SurfaceDistance(std::span<const DVec3> positions, std::span<const Triangle> triangles);
  ~SurfaceDistance();
  SurfaceDistance(const SurfaceDistance&) = delete;
  SurfaceDistance& operator=(const SurfaceDistance&) = delete;

  /// Distance of the nearest point of the mesh, in double from the triangle found.
  double operator()(DVec3 point) const;

private:
  std::span<const DVec3> positions_;
  std::span<const Triangle> triangles_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

/// How far one surface is from another, over many points of it.
struct DistanceStats {
  double rms = 0.0, max = 0.0;
};

/// From `from`, sampled at its corners and at about `samples` more points spread evenly over its area (the same ones
/// each time), to the other.
DistanceStats surface_distance(std::span<const DVec3> from_positions, std::span<const Triangle> from_triangles,
                               const SurfaceDistance& to, size_t samples);

} // namespace packtrace
