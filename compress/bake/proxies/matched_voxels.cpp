#include "compress/bake/proxies/matched_voxels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "compress/bake/proxies/cancellation.h"

namespace packtrace {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr int kDirections = 48;
constexpr double kSpacing = 0.5, kMaxLines = 64.0; // voxels; along a side of each direction's lines

/// Parallel lines through a grid, spaced on a square lattice perpendicular to their direction.
class ParallelLines {
public:
  /// @param number of the direction, 0..kDirections - 1, of a spiral over half the sphere
  ParallelLines(VoxelIndex size, int number) : top_(size[0], size[1], size[2]) {
    const double z = (number + 0.5) / kDirections, r = std::sqrt(1.0 - z * z),
                 turn = 2.399963229728653 * (number + 0.5);
    along_ = DVec3(r * std::cos(turn), r * std::sin(turn), z);
    right_ = glm::normalize(glm::cross(along_, DVec3(1.0, 0.0, 0.0)));
    up_ = glm::cross(along_, right_);
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
    for (int c = 0; c < 8; ++c) {
      const glm::dvec2 p = across(top_ * DVec3(c & 1, c >> 1 & 1, c >> 2));
      low = glm::min(low, p), high = glm::max(high, p);
    }
    low_ = low;
    spacing_ = std::max(kSpacing, std::max(high.x - low.x, high.y - low.y) / kMaxLines);
    width_ = static_cast<int>(std::ceil((high.x - low.x) / spacing_));
    height_ = static_cast<int>(std::ceil((high.y - low.y) / spacing_));
  }

  int width() const { return width_; }
  int height() const { return height_; }

  /// Marks the lines that meet a triangle where opaque(point) holds.
  template <class Opaque>
  void mark(const std::array<DVec3, 3>& corners, std::vector<uint8_t>& met, const Opaque& opaque) const {
    std::array<glm::dvec2, 3> p;
    for (size_t i = 0; i < 3; ++i) p[i] = (across(corners[i]) - low_) / spacing_ - 0.5;
    const double area = cross(p[1] - p[0], p[2] - p[0]);
    if (area == 0.0) return;
    const auto range = [&](int axis, int count) {
      const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
      return std::array<int, 2>{std::max(static_cast<int>(std::ceil(low)), 0),
                                std::min(static_cast<int>(std::floor(high)), count - 1)};
    };
    const auto [x_first, x_last] = range(0, width_);
    const auto [y_first, y_last] = range(1, height_);
    for (int y = y_first; y <= y_last; ++y)
      for (int x = x_first; x <= x_last; ++x) {
        uint8_t& line = met[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)];
        if (line != 0) continue;
        const glm::dvec2 at(x, y);
        const double u = cross(at - p[0], p[2] - p[0]) / area, v = cross(p[1] - p[0], at - p[0]) / area;
        if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0)) continue;
        line = opaque(corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])) ? 1 : 0;
      }
  }

  /// Smallest depth among the voxels that a line crosses.
  float least_depth(int x, int y, const std::function<float(VoxelIndex)>& depth) const {
    const glm::dvec2 at = low_ + spacing_ * (glm::dvec2(x, y) + 0.5);
    const DVec3 origin = at.x * right_ + at.y * up_;
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    for (int a = 0; a < 3; ++a) { // no direction lies in a plane of the grid
      const double s = -origin[a] / along_[a], e = (top_[a] - origin[a]) / along_[a];
      enter = std::max(enter, std::min(s, e)), leave = std::min(leave, std::max(s, e));
    }
    if (!(enter < leave)) return kNever;
    DVec3 next; // where the line leaves the voxel along each axis
    VoxelIndex voxel;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<size_t>(a);
      voxel[i] = static_cast<uint32_t>(std::clamp(std::floor(origin[a] + enter * along_[a]), 0.0, top_[a] - 1.0));
      next[a] = (voxel[i] + (along_[a] > 0.0 ? 1.0 : 0.0) - origin[a]) / along_[a];
    }
    float least = depth(voxel);
    while (least > -kNever) {
      const int a = next.x < next.y ? (next.x < next.z ? 0 : 2) : (next.y < next.z ? 1 : 2);
      uint32_t& index = voxel[static_cast<size_t>(a)];
      if (along_[a] > 0.0 ? index + 1 >= static_cast<uint32_t>(top_[a]) : index == 0) break;
      index = along_[a] > 0.0 ? index + 1 : index - 1;
      next[a] += 1.0 / std::abs(along_[a]);
      least = std::min(least, depth(voxel));
    }
    return least;
  }

private:
  static double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }
  glm::dvec2 across(DVec3 p) const { return {glm::dot(p, right_), glm::dot(p, up_)}; }

  DVec3 top_, along_, right_, up_;
  glm::dvec2 low_;
  double spacing_;
  int width_, height_;
};

} // namespace

float matching_depth(const LineScene& scene) {
  size_t wanted = 0;
  std::vector<float> depths; // one for each line that crosses a selectable voxel
  for (int number = 0; number < kDirections; ++number) {
    const ParallelLines lines(scene.size, number);
    std::vector<uint8_t> met(static_cast<size_t>(lines.width()) * static_cast<size_t>(lines.height()));
    for (size_t t = 0; t < scene.triangles.size(); ++t) {
      stop_if_cancelled();
      lines.mark(scene.triangles[t], met, [&](DVec3 point) { return scene.opaque(t, point); });
    }
    wanted += static_cast<size_t>(std::ranges::count(met, 1));
    for (int y = 0; y < lines.height(); ++y) {
      stop_if_cancelled();
      for (int x = 0; x < lines.width(); ++x)
        if (const float depth = lines.least_depth(x, y, scene.depth); depth < kNever) depths.push_back(depth);
    }
  }
  if (wanted == 0) return -kNever;
  if (wanted > depths.size()) return kNever;
  const auto last = depths.begin() + static_cast<std::ptrdiff_t>(wanted) - 1;
  std::ranges::nth_element(depths, last);
  return *last;
}

} // namespace packtrace
