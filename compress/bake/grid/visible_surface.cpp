#include "compress/bake/grid/visible_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "compress/bake/grid/nearest_triangles.h"

namespace packtrace {
namespace {

constexpr size_t kTrianglesPerBlock = 4096;
constexpr double kMaxPixelTests = 0x1p28; // pixels tested per image; a block's share is proportional to its triangles
constexpr double kMinBlockTests = 0x1p20; // smallest share of a block

/// A projected vertex.
struct ImagePoint {
  double x, y;  ///< pixel coordinates; homogeneous ones (x w, y w) if w <= 0
  double w;     ///< homogeneous coordinate, as in PrimaryCamera::homogeneous_pixel()
  double depth; ///< PrimaryCamera::view_z()

  DVec3 homogeneous() const { return w > 0.0 ? DVec3(x * w, y * w, w) : DVec3(x, y, w); }
};

using ImageTriangle = std::array<ImagePoint, 3>;

struct Range {
  double low, high;
};

/// Returns the smallest and the largest of three finite values, without branches.
Range range_of(double a, double b, double c) { return {std::min(std::min(a, b), c), std::max(std::max(a, b), c)}; }

class VisiblePointFinder {
public:
  VisiblePointFinder(const PrimaryCamera& camera, const PlacedParts& parts)
      : camera_(camera), parts_(parts), width_(camera.size().width), height_(camera.size().height),
        spread_(camera.pixel_spread()), source_(camera.size().pixels()), rounded_(camera.size().pixels()) {
    const CameraRay ray = camera.ray(0, 0);
    depth_scale_ = camera.view_z(ray.origin + ray.direction) / camera.homogeneous_pixel(ray.origin + ray.direction).z;
  }

  VisiblePoints run() {
    tbb::parallel_for(size_t{0}, parts_.parts().size(), [&](size_t i) { draw(parts_.parts()[i]); });
    return {points(source_, &PlacedParts::source_position), points(rounded_, &PlacedParts::rounded_position)};
  }

private:
  ImagePoint project(DVec3 world) const {
    const DVec3 h = camera_.homogeneous_pixel(world);
    if (camera_.projection() == Projection::kOrthographic) return {h.x, h.y, h.z, camera_.view_z(world)};
    const double scale = h.z > 0.0 ? 1.0 / h.z : 1.0;
    return {h.x * scale, h.y * scale, h.z, h.z * depth_scale_};
  }

  void draw(const PlacedPart& placed) {
    const Mesh& mesh = parts_.mesh_of(placed);
    const auto points = std::make_unique_for_overwrite<ImagePoint[]>(mesh.positions.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, mesh.positions.size(), kTrianglesPerBlock), [&](const auto& range) {
      for (size_t v = range.begin(); v < range.end(); ++v)
        points[v] = project(parts_.source_position(placed, static_cast<uint32_t>(v)));
    });
    const size_t count = mesh.triangles.size();
    tbb::parallel_for(size_t{0}, (count + kTrianglesPerBlock - 1) / kTrianglesPerBlock, [&](size_t block) {
      const size_t begin = block * kTrianglesPerBlock, end = std::min(begin + kTrianglesPerBlock, count);
      // Upper bound of the distance between source and rounded positions.
      const double movement = std::sqrt(0.75) * placed.step;
      double tests =
          std::max(kMinBlockTests, kMaxPixelTests * static_cast<double>(end - begin) / parts_.triangle_count());
      for (size_t i = begin; i < end && tests > 0.0; ++i) {
        const Triangle& t = mesh.triangles[i];
        const ImageTriangle source{points[t.x], points[t.y], points[t.z]};
        if (!may_cover_centre(source, movement)) continue;
        const auto rounded = [&](uint32_t vertex) { return project(parts_.rounded_position(placed, vertex)); };
        const uint32_t number = placed.first_triangle + static_cast<uint32_t>(i);
        tests -= draw(source, number, source_) + draw({rounded(t.x), rounded(t.y), rounded(t.z)}, number, rounded_);
      }
    });
  }

  /// Whether the triangle covers a pixel's centre, or may do so when its vertices move.
  /// @param movement world units
  bool may_cover_centre(const ImageTriangle& t, double movement) const {
    const auto [depth, farthest] = range_of(t[0].depth, t[1].depth, t[2].depth);
    const bool perspective = camera_.projection() == Projection::kPerspective;
    if (perspective && !(depth > 2.0 * movement)) return farthest > -movement;
    // Beside the centre of the image, movement along the view direction adds to movement across it.
    const double margin = 4.0 * movement / (spread_ * (perspective ? depth : 1.0));
    const auto [left, right] = range_of(t[0].x, t[1].x, t[2].x);
    const auto [top, bottom] = range_of(t[0].y, t[1].y, t[2].y);
    return has_centre(std::max(left - margin, 0.0) - 0.5, std::min(right + margin, width_) - 0.5) &&
           has_centre(std::max(top - margin, 0.0) - 0.5, std::min(bottom + margin, height_) - 0.5);
  }

  /// Whether there is a whole number in [low, high], that is, ceil(low) <= floor(high).
  /// @param low at least -0.5 or NaN
  /// @param high at most the number of pixels or NaN
  static bool has_centre(double low, double high) {
    if (!(low <= high)) return false;
    const auto below = static_cast<int64_t>(high); // floor(high) unless high is negative
    return low <= (high < 0.0 ? -1.0 : static_cast<double>(below));
  }

  /// @return the number of tested pixels
  double draw(const ImageTriangle& t, uint32_t number, NearestTriangles& buffer) const {
    double x0 = 0.0, x1 = width_ - 1.0, y0 = 0.0, y1 = height_ - 1.0; // numbers of pixels
    const auto [least_depth, most_depth] = range_of(t[0].depth, t[1].depth, t[2].depth);
    if (!(most_depth > 0.0)) return 0.0;
    if (t[0].w > 0.0 && t[1].w > 0.0 && t[2].w > 0.0) {
      const auto [left, right] = range_of(t[0].x, t[1].x, t[2].x);
      const auto [top, bottom] = range_of(t[0].y, t[1].y, t[2].y);
      x0 = std::max(x0, std::ceil(left - 0.5)), x1 = std::min(x1, std::floor(right - 0.5));
      y0 = std::max(y0, std::ceil(top - 0.5)), y1 = std::min(y1, std::floor(bottom - 0.5));
    }
    if (!(x0 <= x1 && y0 <= y1)) return 0.0;
    const DVec3 a = t[0].homogeneous(), b = t[1].homogeneous(), c = t[2].homogeneous();
    std::array<DVec3, 3> edges{glm::cross(b, c), glm::cross(c, a), glm::cross(a, b)};
    const double volume = glm::dot(a, edges[0]);
    if (!(std::abs(volume) > 0.0)) return 0.0;
    for (DVec3& edge : edges) edge /= volume;
    double tests = 0.0;
    for (double row = y0; row <= y1; ++row) {
      // Edge functions are linear along the row: edge.x * x + constant >= 0 inside.
      double first = x0, last = x1;
      std::array<double, 3> constants;
      for (size_t i = 0; i < 3; ++i) {
        constants[i] = edges[i].x * 0.5 + edges[i].y * (row + 0.5) + edges[i].z;
        if (edges[i].x > 0.0)
          first = std::max(first, std::ceil(-constants[i] / edges[i].x));
        else if (edges[i].x < 0.0)
          last = std::min(last, std::floor(-constants[i] / edges[i].x));
        else if (constants[i] < 0.0)
          last = -1.0;
      }
      if (!(first <= last)) continue;
      tests += last - first + 1.0;
      const size_t line = static_cast<size_t>(row) * camera_.size().width;
      for (double x = first; x <= last; ++x) {
        double sum = 0.0, depth = 0.0;
        for (size_t i = 0; i < 3; ++i) {
          const double share = edges[i].x * x + constants[i];
          sum += share, depth += share * t[i].depth;
        }
        if (!(sum > 0.0)) continue;
        depth = std::clamp(depth / sum, least_depth, most_depth);
        if (depth > 0.0) buffer.put(line + static_cast<size_t>(x), static_cast<float>(depth), number);
      }
    }
    return tests + y1 - y0;
  }

  std::vector<VisiblePoint> points(const NearestTriangles& buffer, PlacedParts::Position position) const {
    std::vector<VisiblePoint> points(buffer.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, points.size(), kTrianglesPerBlock), [&](const auto& range) {
      for (size_t pixel = range.begin(); pixel < range.end(); ++pixel)
        if (!buffer.empty(pixel)) points[pixel] = point_at(pixel, buffer, position);
    });
    return points;
  }

  VisiblePoint point_at(size_t pixel, const NearestTriangles& buffer, PlacedParts::Position position) const {
    const uint32_t number = buffer.triangle(pixel);
    const auto [a, b, c] = parts_.corners(number, position);
    const CameraRay ray = camera_.ray(static_cast<uint32_t>(pixel % camera_.size().width),
                                      static_cast<uint32_t>(pixel / camera_.size().width));
    DVec3 normal = glm::normalize(glm::cross(b - a, c - a));
    if (glm::dot(normal, ray.direction) > 0.0) normal = -normal;
    const double distance = glm::dot(a - ray.origin, normal) / glm::dot(ray.direction, normal);
    return {parts_.part_of(number).geometry, number, buffer.distance(pixel), ray.origin + distance * ray.direction,
            normal};
  }

  const PrimaryCamera& camera_;
  const PlacedParts& parts_;
  const double width_, height_;
  const double spread_;      // PrimaryCamera::pixel_spread()
  double depth_scale_ = 1.0; // depth / w, perspective cameras
  NearestTriangles source_, rounded_;
};

} // namespace

VisiblePoints find_visible_points(const PrimaryCamera& camera, const PlacedParts& parts) {
  return VisiblePointFinder(camera, parts).run();
}

} // namespace packtrace
