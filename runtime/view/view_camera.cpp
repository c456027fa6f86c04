#include "runtime/view/view_camera.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <glm/gtc/matrix_transform.hpp>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr double kSteepAhead = 0.999; ///< cosine between forward and the vertical
constexpr double kSteepest = 89.0;    ///< degrees between the horizon and the view

/// Rounds to what camera_key_text() writes.
double rounded(double value) {
  const std::string text = fmt::format("{:.9g}", value);
  double result = value;
  std::from_chars(text.data(), text.data() + text.size(), result);
  return result;
}

DVec3 rounded(DVec3 v) { return {rounded(v.x), rounded(v.y), rounded(v.z)}; }

glm::dmat3 turned_about(DVec3 axis, double degrees) {
  return glm::dmat3(glm::rotate(glm::dmat4(1.0), glm::radians(degrees), axis));
}

} // namespace

ViewCamera::ViewCamera(const Camera& base, DVec3 origin, DVec3 up, double distance)
    : base_(base), camera_(base), origin_(origin), vertical_(up), distance_(distance) {
  pivot_ = DVec3(base.world_from_camera[3]) + glm::normalize(DVec3(base.world_from_camera[2])) * distance;
}

CameraKey ViewCamera::current_key() const {
  if (key_) return *key_;
  CameraKey key;
  key.position = rounded(DVec3(camera_.world_from_camera[3]) + origin_);
  key.look = rounded(key.position + glm::normalize(DVec3(camera_.world_from_camera[2])) * distance_);
  key.up = rounded(glm::normalize(DVec3(camera_.world_from_camera[1])));
  key.fov_degrees = rounded(camera_.fov_degrees);
  return key;
}

void ViewCamera::set(const CameraKey& key) {
  if (const std::string problem = camera_key_problem({&key, 1}, 0); !problem.empty())
    throw Error(ErrorKind::kUsage, "camera: " + problem);
  CameraKey stated = key;
  stated.time_s = 0.0;
  stated.position = rounded(key.position), stated.look = rounded(key.look), stated.up = rounded(key.up);
  stated.fov_degrees = rounded(key.fov_degrees);
  if (const std::string problem = camera_key_problem({&stated, 1}, 0); !problem.empty())
    throw Error(ErrorKind::kUsage, "camera: with 9 digits, " + problem);
  key_ = stated;
  stated.position -= origin_, stated.look -= origin_;
  camera_ = camera_of_key(stated, base_);
}

void ViewCamera::reset() {
  key_.reset();
  camera_ = base_;
}

void ViewCamera::change_scene(const ViewCamera& other) {
  const CameraKey key = current_key();
  const DVec3 pivot = pivot_ + origin_;
  const bool same =
      !key_ && !other.key_ && origin_ == other.origin_ && camera_key_text(key) == camera_key_text(other.current_key());
  *this = other;
  pivot_ = pivot - origin_;
  if (!same) set(key);
}

Camera ViewCamera::in_scene(DVec3 origin, const Camera& base) const {
  CameraKey key = current_key();
  key.position -= origin, key.look -= origin;
  return camera_of_key(key, base);
}

void ViewCamera::place(DVec3 position, DVec3 forward, DVec3 up) {
  CameraKey key = current_key();
  key.position = position + origin_;
  key.look = key.position + forward * distance_;
  key.up = up;
  set(key);
}

void ViewCamera::move(DVec3 steps) {
  const DAffine& m = camera_.world_from_camera;
  const DVec3 right = glm::normalize(DVec3(m[0])), up = glm::normalize(DVec3(m[1])),
              forward = glm::normalize(DVec3(m[2]));
  place(DVec3(m[3]) + right * steps.x + up * steps.y + forward * steps.z, forward, up);
}

/// The rotation that turns the view to the right about the vertical and upwards about the camera's horizontal axis.
glm::dmat3 ViewCamera::rotation(double right_degrees, double up_degrees) const {
  const DAffine& m = camera_.world_from_camera;
  const DVec3 right = glm::normalize(DVec3(m[0])), up = glm::normalize(DVec3(m[1])),
              forward = glm::normalize(DVec3(m[2]));
  // A rotation by a positive angle about the vertical moves the view to the right in pbrt's left-handed space, unless
  // the camera mirrors or is upside down.
  const double side = glm::dot(glm::cross(up, forward), right) < 0.0 ? -1.0 : 1.0;
  const double upright = glm::dot(up, vertical_) < 0.0 ? -1.0 : 1.0;
  const double elevation = glm::degrees(std::asin(std::clamp(glm::dot(forward, vertical_) * upright, -1.0, 1.0)));
  const double limit = std::max(kSteepest, std::abs(elevation)); // of a camera that looks more steeply already
  const double rise = std::clamp(elevation + up_degrees, -limit, limit) - elevation;
  return turned_about(vertical_, side * upright * right_degrees) * turned_about(right, -side * rise);
}

void ViewCamera::look(double right_degrees, double up_degrees) {
  const glm::dmat3 turned = rotation(right_degrees, up_degrees);
  const DAffine& m = camera_.world_from_camera;
  place(DVec3(m[3]), turned * glm::normalize(DVec3(m[2])), turned * glm::normalize(DVec3(m[1])));
}

void ViewCamera::turn(double right_degrees, double up_degrees) {
  const glm::dmat3 turned = rotation(right_degrees, up_degrees);
  const DAffine& m = camera_.world_from_camera;
  place(pivot_ + turned * (DVec3(m[3]) - pivot_), turned * glm::normalize(DVec3(m[2])),
        turned * glm::normalize(DVec3(m[1])));
}

glm::dmat3 ViewCamera::level_axes() const {
  const DAffine& m = camera_.world_from_camera;
  const DVec3 right = glm::normalize(DVec3(m[0])), up = glm::normalize(DVec3(m[1])),
              forward = glm::normalize(DVec3(m[2]));
  // A camera that looks along the vertical has its forwards at the upper edge of its picture.
  const double steep = std::abs(glm::dot(forward, vertical_));
  const DVec3 ahead = steep < kSteepAhead ? forward : up;
  const DVec3 level = glm::normalize(ahead - vertical_ * glm::dot(ahead, vertical_));
  const DVec3 side = glm::cross(vertical_, level);
  return {glm::dot(side, right) < 0.0 ? -side : side, vertical_, level};
}

void ViewCamera::frame(const Bounds& bounds) {
  const DAffine& m = camera_.world_from_camera;
  const DVec3 forward = glm::normalize(DVec3(m[2]));
  const double radius = std::max(bounds.diagonal() / 2.0, distance_ * 1e-9);
  pivot_ = bounds.centre();
  distance_ = radius / std::sin(glm::radians(std::clamp(camera_.fov_degrees, 1.0, 179.0)) / 2.0);
  place(pivot_ - forward * distance_, forward, glm::normalize(DVec3(m[1])));
}

std::string camera_key_text(const CameraKey& key) {
  const auto vector = [](DVec3 v) { return fmt::format("{:.9g},{:.9g},{:.9g}", v.x, v.y, v.z); };
  return fmt::format("{},{},{},{:.9g}", vector(key.position), vector(key.look), vector(key.up), key.fov_degrees);
}

CameraKey parse_camera_key(const std::string& text, const CameraKey& defaults) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (numbers.size() < 10) {
    double number = 0.0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc()) break;
    numbers.push_back(number);
    at = next;
    if (at == end || *at != ',') break;
    ++at;
  }
  if (at != end || text.ends_with(',') || (numbers.size() != 6 && numbers.size() != 9 && numbers.size() != 10))
    throw Error(ErrorKind::kUsage, "'" + text +
                                       "': write the camera's position, the point that it looks at, and if needed up "
                                       "and the field of view in degrees: PX,PY,PZ,LX,LY,LZ[,UX,UY,UZ[,FOV]]");
  CameraKey key = defaults;
  key.position = {numbers[0], numbers[1], numbers[2]}, key.look = {numbers[3], numbers[4], numbers[5]};
  if (numbers.size() >= 9) key.up = {numbers[6], numbers[7], numbers[8]};
  if (numbers.size() == 10) key.fov_degrees = numbers[9];
  if (const std::string problem = camera_key_problem({&key, 1}, 0); !problem.empty())
    throw Error(ErrorKind::kUsage, "'" + text + "': " + problem);
  return key;
}

} // namespace packtrace
