#include "runtime/shade/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/shade/bsdf.h"

namespace packtrace {
namespace {

struct LatLong {
  float s, t; ///< in the image
  float sin_theta;
};

LatLong lat_long(Vec3 d) {
  float phi = std::atan2(d.y, d.x);
  if (phi < 0.0f) phi += 2.0f * kShadePi;
  return {phi / (2.0f * kShadePi), std::acos(std::clamp(d.z, -1.0f, 1.0f)) / kShadePi,
          std::sqrt(std::max(0.0f, d.x * d.x + d.y * d.y))};
}

/// Finds where a number in [0, 1) lies in a cumulative distribution, and how far in its step.
std::pair<size_t, float> find_step(const float* first, size_t count, float u) {
  const auto i = static_cast<size_t>(std::upper_bound(first, first + count - 1, u) - first);
  const float begin = i == 0 ? 0.0f : first[i - 1], width = first[i] - begin;
  return {i, width > 0.0f ? std::clamp((u - begin) / width, 0.0f, 0x1.fffffep-1f) : 0.5f};
}

} // namespace

Environment::Environment(const EnvironmentMap& map) : map_(map) {
  const size_t width = map.width, height = map.height;
  cumulative_.resize(width * height), rows_.resize(height), row_share_.resize(height);
  double total = 0.0, solid_angle = 0.0;
  DVec3 mean(0.0);
  std::vector<double> row_sum(height);
  for (size_t y = 0; y < height; ++y) {
    const double sine = std::sin(std::numbers::pi * (static_cast<double>(y) + 0.5) / static_cast<double>(height));
    double sum = 0.0;
    for (size_t x = 0; x < width; ++x) {
      // The mean of the neighbours: not 0 wherever the interpolated radiance is not.
      double weight = 0.0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          weight += (dx == 0 ? 2.0 : 1.0) * (dy == 0 ? 2.0 : 1.0) *
                    static_cast<double>(luminance(pixel(static_cast<int64_t>(x) + dx, static_cast<int64_t>(y) + dy)));
      sum += weight;
      cumulative_[y * width + x] = static_cast<float>(sum);
      mean += sine * DVec3(map.radiance[y * width + x]);
      solid_angle += sine;
    }
    for (size_t x = 0; x < width; ++x)
      cumulative_[y * width + x] = sum > 0.0 ? static_cast<float>(static_cast<double>(cumulative_[y * width + x]) / sum)
                                             : static_cast<float>(x + 1) / static_cast<float>(width);
    row_sum[y] = sum * sine;
    total += row_sum[y];
  }
  double before = 0.0;
  for (size_t y = 0; y < height; ++y) {
    row_share_[y] = total > 0.0 ? static_cast<float>(row_sum[y] / total) : 1.0f / static_cast<float>(height);
    before += static_cast<double>(row_share_[y]);
    rows_[y] = static_cast<float>(before);
  }
  mean_ = Vec3(mean / solid_angle);
}

Vec3 Environment::pixel(int64_t x, int64_t y) const {
  const auto width = static_cast<int64_t>(map_.width), height = static_cast<int64_t>(map_.height);
  x = (x + width) % width, y = std::clamp<int64_t>(y, 0, height - 1);
  return map_.radiance[static_cast<size_t>(y * width + x)];
}

Vec3 Environment::radiance(Vec3 direction) const {
  const LatLong place = lat_long(direction);
  const float x = place.s * static_cast<float>(map_.width) - 0.5f, y = place.t * static_cast<float>(map_.height) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y);
  const auto i = static_cast<int64_t>(x0), j = static_cast<int64_t>(y0);
  const Vec3 upper = glm::mix(pixel(i, j), pixel(i + 1, j), x - x0);
  const Vec3 lower = glm::mix(pixel(i, j + 1), pixel(i + 1, j + 1), x - x0);
  return glm::mix(upper, lower, y - y0);
}

SampledDirection Environment::sample(Vec2 point) const {
  const auto [row, in_row] = find_step(rows_.data(), rows_.size(), point.y);
  const auto [column, in_column] = find_step(&cumulative_[row * map_.width], map_.width, point.x);
  const float phi = 2.0f * kShadePi * (static_cast<float>(column) + in_column) / static_cast<float>(map_.width);
  const float theta = kShadePi * (static_cast<float>(row) + in_row) / static_cast<float>(map_.height);
  const float sine = std::sin(theta);
  const Vec3 direction(sine * std::cos(phi), sine * std::sin(phi), std::cos(theta));
  return {direction, density(direction)};
}

float Environment::density(Vec3 direction) const {
  const LatLong place = lat_long(direction);
  if (!(place.sin_theta > 0.0f)) return 0.0f;
  const auto x = std::min(static_cast<size_t>(place.s * static_cast<float>(map_.width)), size_t{map_.width} - 1);
  const auto y = std::min(static_cast<size_t>(place.t * static_cast<float>(map_.height)), size_t{map_.height} - 1);
  const size_t i = y * map_.width + x;
  const float in_row = cumulative_[i] - (x == 0 ? 0.0f : cumulative_[i - 1]);
  const float pixels = static_cast<float>(map_.width) * static_cast<float>(map_.height);
  constexpr float kTwoPiSquared = 2.0f * kShadePi * kShadePi;
  return in_row * row_share_[y] * pixels / (kTwoPiSquared * place.sin_theta);
}

} // namespace packtrace
