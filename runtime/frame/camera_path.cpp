#include "runtime/frame/camera_path.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <glm/gtc/matrix_transform.hpp>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

bool finite_vector(DVec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Below this sine of the angle between the view and up, the image's roll is undefined.
constexpr double kMinSine = 1e-6;

bool has_view(const CameraKey& key) {
  const DVec3 view = key.look - key.position;
  const double size = glm::length(view) * glm::length(key.up);
  return size > 0.0 && std::isfinite(size) && glm::length(glm::cross(view, key.up)) > kMinSine * size;
}

/// A cubic Hermite spline over one span of keys.
struct HermiteSpan {
  double before_s, begin_s, end_s, after_s, t; ///< t in [0, 1]

  /// @param p the values at the four times; an end of the path repeats its key
  template <typename Value>
  Value operator()(const Value& p0, const Value& p1, const Value& p2, const Value& p3) const {
    const double length = end_s - begin_s;
    const Value m1 = (p2 - p0) * (length / (end_s - before_s)), m2 = (p3 - p1) * (length / (after_s - begin_s));
    const double t2 = t * t, t3 = t2 * t;
    return p1 * (2 * t3 - 3 * t2 + 1) + m1 * (t3 - 2 * t2 + t) + p2 * (3 * t2 - 2 * t3) + m2 * (t3 - t2);
  }
};

} // namespace

std::string camera_key_problem(std::span<const CameraKey> keys, size_t index) {
  const CameraKey& key = keys[index];
  if (!std::isfinite(key.time_s) || !finite_vector(key.position) || !finite_vector(key.look) || !finite_vector(key.up))
    return "all numbers must be finite";
  if (index > 0 && !(key.time_s > keys[index - 1].time_s)) return "its time is not after that of the key before";
  if (!(key.fov_degrees > 0.0 && key.fov_degrees < 180.0)) return "fov must be between 0 and 180 degrees";
  if (glm::length(key.look - key.position) == 0.0) return "it looks at its own position";
  if (!has_view(key)) return "up is parallel to the view, or zero";
  return {};
}

CameraPath::CameraPath(std::vector<CameraKey> keys, const Camera& base) : keys_(std::move(keys)), base_(base) {
  if (keys_.size() < 2) throw Error(ErrorKind::kUsage, "a camera path needs at least two keys");
  for (size_t i = 0; i < keys_.size(); ++i)
    if (const std::string problem = camera_key_problem(keys_, i); !problem.empty())
      throw Error(ErrorKind::kUsage, std::string("key ").append(std::to_string(i)).append(": ").append(problem));
}

CameraKey CameraPath::interpolated(double time_s) const {
  if (!(time_s > begin_s())) return keys_.front();
  if (time_s >= end_s()) return keys_.back();
  const auto next = std::ranges::upper_bound(keys_, time_s, {}, &CameraKey::time_s);
  const CameraKey &p1 = next[-1], &p2 = *next;
  const CameraKey& p0 = next - 1 == keys_.begin() ? p1 : next[-2];
  const CameraKey& p3 = next + 1 == keys_.end() ? p2 : next[1];
  const HermiteSpan span{p0.time_s, p1.time_s, p2.time_s, p3.time_s, (time_s - p1.time_s) / (p2.time_s - p1.time_s)};
  CameraKey key;
  key.time_s = time_s;
  key.position = span(p0.position, p1.position, p2.position, p3.position);
  key.look = span(p0.look, p1.look, p2.look, p3.look);
  key.up = span(p0.up, p1.up, p2.up, p3.up);
  const double widest = std::max(p1.fov_degrees, p2.fov_degrees), narrowest = std::min(p1.fov_degrees, p2.fov_degrees);
  key.fov_degrees = std::clamp(span(p0.fov_degrees, p1.fov_degrees, p2.fov_degrees, p3.fov_degrees), narrowest, widest);
  if (has_view(key)) return key;
  const CameraKey& nearest = span.t < 0.5 ? p1 : p2;
  key.look = key.position + (nearest.look - nearest.position);
  key.up = nearest.up;
  return key;
}

Camera camera_of_key(const CameraKey& key, const Camera& base) {
  Camera camera = base;
  camera.animation = kNotAnimated;
  const DVec3 forward = glm::normalize(key.look - key.position);
  DVec3 right = glm::normalize(glm::cross(key.up, forward));
  const DVec3 up = glm::cross(forward, right);
  if (glm::determinant(glm::dmat3(base.world_from_camera)) < 0.0) right = -right;
  camera.world_from_camera = DAffine(right, up, forward, key.position);
  camera.fov_degrees = key.fov_degrees;
  return camera;
}

Camera CameraPath::at(double time_s) const { return camera_of_key(interpolated(time_s), base_); }

Camera orbited(const Camera& camera, DVec3 pivot, DVec3 up, double degrees) {
  Camera turned = camera;
  if (degrees == 0.0) return turned;
  // In pbrt's left-handed space, a camera that looks at the pivot moves to its right for negative angles about up.
  const double to_right = glm::determinant(glm::dmat3(camera.world_from_camera)) < 0.0 ? degrees : -degrees;
  const glm::dmat3 rotation(glm::rotate(glm::dmat4(1.0), glm::radians(to_right), up));
  for (int column = 0; column < 3; ++column)
    turned.world_from_camera[column] = rotation * DVec3(camera.world_from_camera[column]);
  turned.world_from_camera[3] = pivot + rotation * (DVec3(camera.world_from_camera[3]) - pivot);
  return turned;
}

} // namespace packtrace
