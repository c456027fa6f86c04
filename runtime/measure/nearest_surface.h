#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"
#include "runtime/trace/embree/embree_device.h"

namespace packtrace {

/// The point of a triangle that is nearest to p, with its weights of the second and third vertex.
struct NearestPoint {
  double distance = 0.0;
  uint32_t triangle = 0;
  Vec2 barycentrics{0.0f};
};

/// Source: C. Ericson, "Real-Time Collision Detection", 2005, section 5.1.5. Degenerate triangles are segments or
/// points.
NearestPoint nearest_on_triangle(DVec3 p, DVec3 a, DVec3 b, DVec3 c);

/// Finds the nearest point on a set of triangles. Embree finds candidates in floats; distances are computed in double.
class NearestSurface {
public:
  /// Keeps references: the device and the spans must outlive it.
  /// @param positions within about [-1, 1], so that float rounding of the search is known
  /// @param triangles at least one
  /// Throws as EmbreeDevice::check().
  NearestSurface(EmbreeDevice& device, std::span<const DVec3> positions, std::span<const Triangle> triangles);

  /// Thread-safe.
  NearestPoint nearest(DVec3 p) const;

private:
  std::span<const DVec3> positions_;
  std::span<const Triangle> triangles_;
  RtcPtr<RTCSceneTy> scene_;
};

} // namespace packtrace
