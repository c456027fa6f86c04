#pragma once

#include <span>
#include <string>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// A key of a camera path. Positions are in the scene's coordinates (relative to Scene::origin).
struct CameraKey {
  double time_s = 0.0;
  DVec3 position{0.0};
  DVec3 look{0.0, 0.0, 1.0}; ///< the point in the middle of the image
  DVec3 up{0.0, 1.0, 0.0};   ///< direction of the image's upper edge, need not be perpendicular to the view
  double fov_degrees = 60.0; ///< perspective cameras: across the shorter image axis
};

/// The camera of a key alone.
/// @param key without a camera_key_problem()
/// @param base projection, screen window and film; its handedness is kept
Camera camera_of_key(const CameraKey& key, const Camera& base);

/// Returns the problem of a key and its predecessor: non-finite values, a time that does not ascend, a look at the
/// position, an up along the view, a field of view outside (0, 180). Empty if nothing is.
std::string camera_key_problem(std::span<const CameraKey> keys, size_t index);

/// A camera that moves through keys. Positions, looks, ups and fields of view are interpolated by cubic Hermite splines
/// with Catmull-Rom tangents for keys at any times, so that the camera passes every key and its velocity is continuous.
/// Before the first and after the last key the camera stands still.
/// Source: E. Catmull, R. Rom, "A class of local interpolating splines", 1974.
class CameraPath {
public:
  /// @param keys at least two, at ascending times
  /// @param base projection, screen window and film; its handedness is kept
  /// Throws Error(kUsage) for a camera_key_problem(), with the number of the key, from 0.
  CameraPath(std::vector<CameraKey> keys, const Camera& base);

  double begin_s() const { return keys_.front().time_s; }
  double end_s() const { return keys_.back().time_s; }

  /// The camera at a time. Where the interpolated view has no direction, or is parallel to the interpolated up, that of
  /// the nearest key is used.
  Camera at(double time_s) const;

private:
  CameraKey interpolated(double time_s) const;

  std::vector<CameraKey> keys_;
  Camera base_;
};

/// Turns a camera about a vertical line. Positive angles move the camera to its right.
/// @param up unit vector along the line
/// @param pivot a point on the line
Camera orbited(const Camera& camera, DVec3 pivot, DVec3 up, double degrees);

} // namespace packtrace
