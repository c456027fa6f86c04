#include "compress/bake/grid/visible_changes.h"

#include <algorithm>
#include <cmath>

#include "compress/bake/grid/narrow_gaps.h"
#include "compress/bake/grid/picture_bounds.h"
#include "compress/bake/grid/view_measure.h"
#include "pbrt_import/scene/angle.h"

namespace packtrace {
namespace {

constexpr uint64_t kMinDrawnTriangles = uint64_t{1} << 22;
constexpr uint64_t kMaxDrawsPerTriangle = 4;
constexpr uint64_t kMaxDrawnTriangles = uint64_t{1} << 31;
constexpr double kMaxMoved = 0.0055;    // fraction of pixels that may show another surface, weighted by contrast
constexpr double kMaxMissed = 0.001;    // fraction of the image in which hit and miss may differ
constexpr double kMaxGapChange = 0.012; // mean of measure_gap_changes() over all covered pixels
constexpr double kMinMissedShare = 0.1; // of all such pixels; geometries with a smaller share are not refined
constexpr double kMinPixels = 576.0;    // 1 % of the image; sums are divided by at least this many pixels

/// Returns the instances that a camera sees; only the largest if all have more than max_triangles triangles together.
std::vector<uint32_t> choose_drawn(const PrimaryCamera& camera, const Scene& scene, const ScenePlan& plan,
                                   const SceneMeasure& measure, uint64_t max_triangles, uint64_t& drawn) {
  struct Seen {
    double pixels;
    uint32_t instance;
    uint64_t triangles;
  };
  std::vector<uint64_t> triangles(plan.geometries.size());
  for (size_t g = 0; g < triangles.size(); ++g)
    for (const GeometryPart& part : plan.geometries[g].parts) triangles[g] += scene.meshes[part.mesh].triangles.size();
  std::vector<Seen> seen;
  for (uint32_t i = 0; i < plan.instances.size(); ++i) {
    const uint32_t g = plan.instances[i].geometry;
    if (g == baked::kNone) continue;
    const Bounds box = placed_box(plan.instances[i], measure.geometries[g].bounds);
    if (box.empty() || !within_float_range(box)) continue;
    if (const double pixels = box_pixels(camera, box); pixels > 0.0) seen.push_back({pixels, i, triangles[g]});
  }
  std::stable_sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) { return a.pixels > b.pixels; });
  std::vector<uint32_t> instances;
  uint64_t sum = 0;
  for (const Seen& one : seen) {
    if (sum + one.triangles > (sum > 0 ? max_triangles : kMaxDrawnTriangles)) break;
    sum += one.triangles;
    instances.push_back(one.instance);
  }
  std::sort(instances.begin(), instances.end());
  drawn += sum;
  return instances;
}

/// Expected contrast of ambient occlusion between two surfaces that are seen through one pixel centre, 0..1: 1 if one
/// lies behind the other, otherwise proportional to the angle between them.
/// @param step the most that one surface moves away from its plane, world units
double contrast(const VisiblePoint& a, const VisiblePoint& b, double step) {
  if (a.triangle == b.triangle) return 0.0;
  const DVec3 between = b.position - a.position;
  const double gap = std::max(std::abs(glm::dot(between, a.normal)), std::abs(glm::dot(between, b.normal)));
  if (!(gap <= step)) return 1.0;
  const double degrees = angle_degrees(a.normal, b.normal);
  return std::min(degrees, 180.0 - degrees) / 180.0;
}

/// Moved pixels relative to the limit. The standard deviation of their number is added, because a small number may be
/// low by chance.
double moved_excess(double moved, double seen) {
  return (moved + std::sqrt(moved)) / (kMaxMoved * std::max(seen, kMinPixels));
}

/// Changes of gaps relative to the limit.
double gap_excess(double changes, double probed) { return changes / (kMaxGapChange * std::max(probed, kMinPixels)); }

/// Perspective images that show what a camera sees: the camera itself, or the faces of a cube around an environment
/// camera with as many pixels in total.
std::vector<PrimaryCamera> images_of(const PrimaryCamera& camera) {
  if (camera.projection() != Projection::kEnvironment) return {camera};
  std::vector<PrimaryCamera> faces;
  const auto side = static_cast<uint32_t>(std::sqrt(static_cast<double>(camera.size().pixels()) / 6.0));
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Camera face; // field of view: 90 degrees
      face.world_from_camera = DAffine(0.0);
      for (int i = 0; i < 3; ++i) face.world_from_camera[i][(axis + 1 + i) % 3] = i == 2 ? sign : 1.0;
      face.world_from_camera[3] = camera.eye();
      faces.emplace_back(face, ImageSize{side, side});
    }
  return faces;
}

} // namespace

VisibleChanges::VisibleChanges(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                               std::span<const PrimaryCamera> cameras, Progress& progress)
    : scene_(scene), plan_(plan), progress_(progress) {
  uint64_t stored = 0, drawn = 0;
  for (const GeometryPlan& geometry : plan.geometries)
    for (const GeometryPart& part : geometry.parts) stored += scene.meshes[part.mesh].triangles.size();
  const uint64_t most = std::clamp(kMaxDrawsPerTriangle * stored, kMinDrawnTriangles, kMaxDrawnTriangles);
  for (const PrimaryCamera& camera : cameras) {
    if (drawn >= most) continue;
    progress_.check_cancelled();
    views_.push_back({images_of(camera), choose_drawn(camera, scene, plan, measure, most - drawn, drawn)});
  }
}

/// Sums over the pixels of a view that show a geometry.
struct VisibleChanges::Sums {
  double seen = 0.0;   // pixels
  double moved = 0.0;  // pixels that show another surface, weighted by contrast
  double missed = 0.0; // pixels that change between hit and miss
  double probed = 0.0; // pixels whose gap was measured
  double gaps = 0.0;   // sum of measure_gap_changes() over them
};

std::vector<VisibleChanges::Change> VisibleChanges::compare(std::span<const GeometryGrid> grids) const {
  std::vector<Change> changes(grids.size());
  for (const View& view : views_) {
    const PlacedParts parts(scene_, plan_, view.instances, grids);
    std::vector<Sums> sums(grids.size());
    for (const PrimaryCamera& image : view.images) {
      progress_.check_cancelled();
      const VisiblePoints points = find_visible_points(image, parts);
      add_edges(points, grids, sums);
      add_gaps(points.source, measure_gap_changes(parts, points), sums);
    }
    add_changes(sums, changes);
  }
  return changes;
}

void VisibleChanges::add_edges(const VisiblePoints& points, std::span<const GeometryGrid> grids,
                               std::vector<Sums>& sums) const {
  for (size_t i = 0; i < points.source.size(); ++i) {
    const VisiblePoint &a = points.source[i], &b = points.rounded[i];
    if (a.geometry == baked::kNone && b.geometry == baked::kNone) continue;
    // The nearer surface is the one whose edge moved.
    const bool of_source = b.geometry == baked::kNone || (a.geometry != baked::kNone && a.depth <= b.depth);
    const uint32_t g = of_source ? a.geometry : b.geometry;
    const bool missed = a.geometry == baked::kNone || b.geometry == baked::kNone;
    const double moved = missed ? 0.0 : contrast(a, b, grids[g].grid.step() * world_scale(plan_.geometries[g]));
    sums[g].seen += 1.0, sums[g].moved += moved, sums[g].missed += missed ? 1.0 : 0.0;
  }
}

void VisibleChanges::add_gaps(std::span<const VisiblePoint> points, std::span<const float> changes,
                              std::vector<Sums>& sums) {
  for (size_t i = 0; i < points.size(); ++i)
    if (points[i].geometry != baked::kNone && !std::isnan(changes[i]))
      sums[points[i].geometry].probed += 1.0, sums[points[i].geometry].gaps += double{changes[i]};
}

void VisibleChanges::add_changes(std::span<const Sums> sums, std::span<Change> changes) {
  Sums all;
  for (const Sums& one : sums)
    all.seen += one.seen, all.moved += one.moved, all.missed += one.missed, all.probed += one.probed,
        all.gaps += one.gaps;
  const double all_moved = moved_excess(all.moved, all.seen), all_gaps = gap_excess(all.gaps, all.probed);
  const double all_missed = all.missed / (kMaxMissed * static_cast<double>(kPromisedSize.pixels()));
  for (size_t g = 0; g < sums.size(); ++g) {
    const double moved = all_moved > 1.0 ? moved_excess(sums[g].moved, sums[g].seen) : 0.0;
    const double missed = all_missed > 1.0 && sums[g].missed >= kMinMissedShare * all.missed ? all_missed : 0.0;
    const double gaps = all_gaps > 1.0 ? gap_excess(sums[g].gaps, sums[g].probed) : 0.0;
    changes[g].edges = std::max({changes[g].edges, moved, missed});
    changes[g].gaps = std::max(changes[g].gaps, gaps);
  }
}

} // namespace packtrace
