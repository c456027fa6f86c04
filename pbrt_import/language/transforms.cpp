#include "pbrt_import/language/transforms.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

namespace packtrace {

DAffine translation(DVec3 offset) {
  DAffine map(1.0);
  map[3] = offset;
  return map;
}

DAffine scaling(DVec3 factors) {
  DAffine map(1.0);
  for (int axis = 0; axis < 3; ++axis) map[axis][axis] = factors[axis];
  return map;
}

std::optional<DAffine> rotation(double degrees, DVec3 axis) {
  const double length = glm::length(axis);
  if (!(length > 0.0)) return std::nullopt;
  const DVec3 a = axis / length;
  const double angle = degrees * std::numbers::pi / 180.0;
  // Quarter turns are exact: exporters use them to swap axes, and rounding errors in the matrix would tilt every plane.
  const double quarters = degrees / 90.0;
  const bool exact = quarters == std::floor(quarters) && std::abs(quarters) < 1e9;
  const auto quarter = exact ? static_cast<int64_t>(quarters) & 3 : 0;
  const double s = exact ? (quarter == 1 ? 1.0 : quarter == 3 ? -1.0 : 0.0) : std::sin(angle);
  const double c = exact ? (quarter == 0 ? 1.0 : quarter == 2 ? -1.0 : 0.0) : std::cos(angle);
  // Rodrigues' formula, column by column.
  DAffine map(1.0);
  for (int column = 0; column < 3; ++column) {
    DVec3 unit(0.0);
    unit[column] = 1.0;
    map[column] = unit * c + glm::cross(a, unit) * s + a * (a[column] * (1.0 - c));
  }
  return map;
}

std::optional<DAffine> affine_from_columns(std::span<const double, 16> m) {
  if (m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] == 0.0) return std::nullopt;
  DAffine map;
  for (size_t column = 0; column < 4; ++column)
    map[static_cast<int>(column)] = DVec3(m[column * 4], m[column * 4 + 1], m[column * 4 + 2]);
  if (m[15] != 1.0)
    for (int column = 0; column < 4; ++column) map[column] /= m[15];
  return map;
}

bool is_finite(const DAffine& map) {
  return is_finite(map[0]) && is_finite(map[1]) && is_finite(map[2]) && is_finite(map[3]);
}

bool is_invertible(const DAffine& map) {
  if (!is_finite(map)) return false;
  const double determinant = glm::determinant(glm::dmat3(map));
  // Far from overflow: the inverse divides products of two entries, and the offset, by the determinant.
  constexpr double kModerate = 1e90;
  const auto moderate = [](DVec3 v) {
    return std::abs(v.x) < kModerate && std::abs(v.y) < kModerate && std::abs(v.z) < kModerate;
  };
  if (std::abs(determinant) > 1.0 / kModerate && moderate(map[0]) && moderate(map[1]) && moderate(map[2]) &&
      moderate(map[3]))
    return true;
  return determinant != 0.0 && std::isfinite(determinant) && is_finite(inverse(map));
}

std::optional<TransformKey> decompose(const DAffine& map) {
  if (!is_invertible(map)) return std::nullopt;
  const glm::dmat3 linear(map);
  const auto norm = [](const glm::dmat3& m) {
    return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
  };
  // Newton's iteration for the nearest orthogonal matrix. The factor speeds up the first steps for badly scaled maps;
  // it tends to 1 near the solution, where convergence is quadratic.
  constexpr int kMaxSteps = 64;
  constexpr double kConverged = 1e-14;
  glm::dmat3 rotation = linear;
  double change = 1.0;
  for (int step = 0; step < kMaxSteps && change > kConverged; ++step) {
    const glm::dmat3 inverted = glm::transpose(glm::inverse(rotation));
    const double factor = std::sqrt(norm(inverted) / norm(rotation));
    const glm::dmat3 next = (rotation * factor + inverted / factor) * 0.5;
    change = norm(next - rotation) / norm(next);
    rotation = next;
  }
  if (!(change <= std::sqrt(kConverged))) return std::nullopt; // numerically singular
  if (glm::determinant(rotation) < 0.0) rotation = -rotation;
  return TransformKey{map, glm::normalize(glm::quat_cast(rotation)), glm::transpose(rotation) * linear};
}

std::string to_text(double time) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), time);
  return std::string(digits.data(), end);
}

std::optional<AnimatedTransform> animate(const DAffine& start, const DAffine& end, TransformTimes times) {
  const std::optional<TransformKey> start_key = decompose(start);
  std::optional<TransformKey> end_key = decompose(end);
  if (!start_key || !end_key) return std::nullopt;
  if (glm::dot(start_key->rotation, end_key->rotation) < 0.0) end_key->rotation = -end_key->rotation;
  return AnimatedTransform{times.start, times.end, *start_key, *end_key};
}

} // namespace packtrace
