#include "compress/bake/grid/view_measure.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace packtrace {
namespace {

constexpr double kPiecePixels = 32.0;     // longest side of a piece along an image axis
constexpr int kMaxCuts = 48;              // successive cuts of one triangle
constexpr uint32_t kMaxPieces = 1u << 16; // per geometry, over all instances; beyond it, triangles are not cut
constexpr size_t kMaxInstances = 256;     // instances that are looked at
constexpr size_t kMaxPlacedTriangles = 8192;
constexpr double kSmallPixels = 0.02; // fraction of the covered pixels whose size may be below ViewStats::pixel

/// Whether all points are outside the same image edge. Points are in homogeneous pixel coordinates.
template <size_t kCount>
bool outside(const std::array<DVec3, kCount>& points, ImageSize size) {
  const auto all = [&](const auto& test) { return std::all_of(points.begin(), points.end(), test); };
  return all([](DVec3 p) { return p.x < 0.0; }) || all([](DVec3 p) { return p.y < 0.0; }) ||
         all([&](DVec3 p) { return p.x > size.width * p.z; }) || all([&](DVec3 p) { return p.y > size.height * p.z; });
}

/// Whether a point in homogeneous pixel coordinates is in front of the camera.
bool is_in_front(const PrimaryCamera& camera, DVec3 point) {
  return camera.projection() != Projection::kPerspective || point.z * camera.depth_scale() > 0.0;
}

class TriangleProjector {
public:
  TriangleProjector(const PrimaryCamera& camera, ViewSums& sums)
      : camera_(camera), sums_(sums), spread_(camera.pixel_spread()) {}

  /// @return the pixels that the triangle covers, without the weight
  double add(const DTriangle& world, double weight) {
    whole_ = &world;
    height_.reset();
    weight_ = weight;
    return cut(world, 0);
  }

private:
  /// World-space size of a pixel at a point in front of the camera.
  double pixel_at(DVec3 world) const {
    return camera_.projection() == Projection::kOrthographic ? spread_ : spread_ * camera_.view_z(world);
  }

  double take(const DTriangle& piece, double pixels) {
    const double pixel = pixel_at((piece[0] + piece[1] + piece[2]) / 3.0);
    if (!(pixel > 0.0) || !(pixels > 0.0) || !std::isfinite(pixels)) return 0.0;
    if (!height_) height_ = height_of(*whole_); // most triangles of most scenes are out of sight
    sums_.add(pixels * weight_, pixel, *height_);
    ++pieces_;
    return pixels;
  }

  double cut(const DTriangle& t, int cuts) {
    const bool last = cuts == kMaxCuts || pieces_ >= kMaxPieces;
    if (camera_.projection() == Projection::kEnvironment) return cut_around(t, cuts, last);
    const std::array<DVec3, 3> seen{camera_.homogeneous_pixel(t[0]), camera_.homogeneous_pixel(t[1]),
                                    camera_.homogeneous_pixel(t[2])};
    if (outside(seen, camera_.size())) return 0.0;
    if (!std::ranges::all_of(seen, [&](DVec3 point) { return is_in_front(camera_, point); }))
      return last ? 0.0 : halve(t, cuts);
    const glm::dvec2 a = glm::dvec2(seen[0]) / seen[0].z, b = glm::dvec2(seen[1]) / seen[1].z,
                     c = glm::dvec2(seen[2]) / seen[2].z;
    const glm::dvec2 sides = glm::max(glm::max(a, b), c) - glm::min(glm::min(a, b), c);
    if (!last && std::max(sides.x, sides.y) > kPiecePixels) return halve(t, cuts);
    const glm::dvec2 centre = (a + b + c) / 3.0;
    if (!(centre.x >= 0.0 && centre.y >= 0.0 && centre.x <= camera_.size().width && centre.y <= camera_.size().height))
      return 0.0;
    return take(t, std::min(0.5 * std::abs((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)),
                            static_cast<double>(camera_.size().pixels())));
  }

  /// Cuts a triangle for environment cameras, which look in all directions.
  double cut_around(const DTriangle& t, int cuts, bool last) {
    const DVec3 centre = (t[0] + t[1] + t[2]) / 3.0, to_eye = camera_.eye() - centre;
    const double pixel = pixel_at(centre), distance = glm::length(to_eye);
    if (!last && !(longest_edge_of(t) <= kPiecePixels * pixel)) return halve(t, cuts);
    const DVec3 twice_area = glm::cross(t[1] - t[0], t[2] - t[0]);
    return take(t, std::min(0.5 * std::abs(glm::dot(twice_area, to_eye)) / (distance * pixel * pixel),
                            static_cast<double>(camera_.size().pixels())));
  }

  double halve(const DTriangle& t, int cuts) {
    const std::array<double, 3> edges{glm::distance(t[0], t[1]), glm::distance(t[1], t[2]), glm::distance(t[2], t[0])};
    const auto i = static_cast<size_t>(std::max_element(edges.begin(), edges.end()) - edges.begin());
    const DVec3 a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3], middle = 0.5 * (a + b);
    return cut({a, middle, c}, cuts + 1) + cut({middle, b, c}, cuts + 1);
  }

  const PrimaryCamera& camera_;
  ViewSums& sums_;
  const double spread_; // PrimaryCamera::pixel_spread()
  const DTriangle* whole_ = nullptr;
  std::optional<double> height_; // of the whole triangle
  double weight_ = 1.0;
  uint32_t pieces_ = 0;
};

struct ChosenInstance {
  size_t instance = 0;
  double weight = 1.0;
};

/// Returns the instances in view, or a weighted subset in which larger ones are more likely.
std::vector<ChosenInstance> choose_instances(const PrimaryCamera& camera, const Placements& placements,
                                             const Bounds& box) {
  std::vector<double> pixels(placements.size());
  double total = 0.0;
  size_t seen = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = box_pixels(camera, transform_bounds(placements[i], box));
    total += pixels[i];
    seen += pixels[i] > 0.0;
  }
  std::vector<ChosenInstance> chosen;
  const auto marks = static_cast<double>(kMaxInstances);
  double end = 0.5 / marks; // as in sample_surface()
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i] == 0.0) continue;
    if (seen <= kMaxInstances) {
      chosen.push_back({i, 1.0});
      continue;
    }
    const double measure = 0.5 * (pixels[i] / total + 1.0 / static_cast<double>(seen));
    end += measure;
    const double hits = std::floor(end * marks);
    if (hits < 1.0) continue;
    end -= hits / marks;
    chosen.push_back({i, hits / (measure * marks)});
  }
  return chosen;
}

} // namespace

double box_pixels(const PrimaryCamera& camera, const Bounds& world) {
  const double all = static_cast<double>(camera.size().pixels());
  if (camera.projection() == Projection::kEnvironment) {
    const double distance = glm::distance(world.centre(), camera.eye()), radius = 0.5 * world.diagonal();
    const double pixel = std::max(distance - radius, 0.0) * camera.pixel_spread();
    return pixel > 0.0 ? std::clamp(4.0 * radius * radius / (pixel * pixel), 0x1p-60, all) : all;
  }
  std::array<DVec3, 8> corners;
  bool in_front = true;
  for (int i = 0; i < 8; ++i) {
    const DVec3 corner(i & 1 ? world.hi.x : world.lo.x, i & 2 ? world.hi.y : world.lo.y,
                       i & 4 ? world.hi.z : world.lo.z);
    corners[static_cast<size_t>(i)] = camera.homogeneous_pixel(corner);
    in_front &= is_in_front(camera, corners[static_cast<size_t>(i)]);
  }
  if (outside(corners, camera.size())) return 0.0;
  if (!in_front) return all;
  glm::dvec2 lo(std::numeric_limits<double>::infinity()), hi(-lo);
  for (const DVec3 c : corners) lo = glm::min(lo, glm::dvec2(c) / c.z), hi = glm::max(hi, glm::dvec2(c) / c.z);
  const glm::dvec2 sides = hi - lo;
  return std::clamp(sides.x * sides.y, 0x1p-60, all);
}

double ViewStats::coverage() const { return std::min(pixels / static_cast<double>(kPromisedSize.pixels()), 1.0); }

void ViewSums::add(double pixels, double pixel, double height) {
  constexpr double kBins = kOctaves * kBinsPerOctave;
  const double bin = std::clamp((std::log2(pixel) - kFirstOctave) * kBinsPerOctave, 0.0, kBins - 1.0);
  pixels_by_size_[static_cast<size_t>(bin)] += pixels;
  pixels_ += pixels;
  if (height > 0.0) pixels_by_height_ += pixels / height;
}

ViewStats ViewSums::stats() const {
  if (!(pixels_ > 0.0)) return {};
  double below = 0.0;
  size_t bin = 0;
  while (bin + 1 < pixels_by_size_.size() && (below += pixels_by_size_[bin]) < kSmallPixels * pixels_) ++bin;
  return {pixels_, pixels_by_height_ > 0.0 ? pixels_ / pixels_by_height_ : 0.0,
          std::exp2(static_cast<double>(bin) / kBinsPerOctave + kFirstOctave)};
}

void add_geometry_view(const PrimaryCamera& camera, std::span<const SampleTriangle> sample,
                       const Placements& placements, const Bounds& box, ViewSums& sums,
                       std::span<double> sample_pixels) {
  TriangleProjector look(camera, sums);
  const std::vector<ChosenInstance> chosen = choose_instances(camera, placements, box);
  if (chosen.empty() || sample.empty()) return;
  // Each instance gets every stride-th sample triangle, starting at a different one.
  const size_t stride = std::max<size_t>(1, chosen.size() * sample.size() / kMaxPlacedTriangles);
  for (size_t k = 0; k < chosen.size(); ++k) {
    const DAffine placement = placements[chosen[k].instance];
    const bool placed = placement != DAffine(1.0);
    for (size_t i = k % stride; i < sample.size(); i += stride) {
      const double weight = sample[i].weight * chosen[k].weight * static_cast<double>(stride);
      const DTriangle& t = sample[i].corners;
      const double pixels =
          look.add(placed ? DTriangle{transform_point(placement, t[0]), transform_point(placement, t[1]),
                                      transform_point(placement, t[2])}
                          : t,
                   weight);
      sample_pixels[i] += pixels * weight;
    }
  }
}

} // namespace packtrace
