#include "compress/bake/grid/picture_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <tbb/parallel_for.h>

#include "compress/bake/grid/outline_share.h"
#include "compress/bake/grid/touching_boxes.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr size_t kMaxSample = 8192;                 // triangles sampled per geometry
constexpr size_t kMinSample = 64;                   // lower limit in scenes with many geometries
constexpr size_t kMaxSampleLooks = size_t{1} << 20; // limit of (sample triangles of all geometries) x cameras

constexpr double kLarge = 0.01;                // fraction of the image from which a geometry's facets must not tilt
constexpr double kMinTotalTiltCoverage = 0.05; // the same for all smaller geometries together
constexpr double kMinTotalCoverage = 0.005;    // like kSeen, for all smaller geometries together
// Limits of the step. If a limit is exceeded, the step becomes kMargin times that limit.
constexpr double kMargin = 0.4;
constexpr double kHeightSteps = 24.0;        // steps per triangle height
constexpr double kLowHeightSteps = 8.0;      // the same for geometry that covers little of the image
constexpr double kPixelSteps = 8.0;          // steps per pixel
constexpr double kContactSteps = 20.0;       // steps per size of a touching object
constexpr size_t kMaxContactInstances = 256; // instances per geometry whose contacts are searched

Bounds scene_box(const ScenePlan& plan, const SceneMeasure& measure) {
  Bounds box;
  for (const baked::InstanceRecord& instance : plan.instances) {
    if (instance.geometry == baked::kNone) continue;
    const Bounds placed = placed_box(instance, measure.geometries[instance.geometry].bounds);
    if (!placed.empty() && within_float_range(placed)) box.extend(placed);
  }
  return box;
}

class ViewMeasurer {
public:
  ViewMeasurer(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
               std::span<const PrimaryCamera> cameras, Progress& progress)
      : scene_(scene), plan_(plan), measure_(measure), progress_(progress), cameras_(cameras),
        views_(plan.geometries.size()), instances_(plan.geometries.size()) {
    for (uint32_t i = 0; i < plan.instances.size(); ++i)
      if (const baked::InstanceRecord& instance = plan.instances[i];
          instance.geometry != baked::kNone && is_in_range(instance))
        instances_[instance.geometry].push_back(i);
    const size_t looks = std::max<size_t>(1, views_.size() * cameras_.size());
    max_sample_ = std::clamp(kMaxSampleLooks / looks, kMinSample, kMaxSample);
  }

  std::vector<GeometryView> run() {
    tbb::parallel_for(size_t{0}, views_.size(), [&](size_t g) {
      progress_.check_cancelled();
      look(g);
      progress_.advance();
    });
    return std::move(views_);
  }

private:
  bool is_in_range(const baked::InstanceRecord& instance) const {
    const Bounds box = placed_box(instance, measure_.geometries[instance.geometry].bounds);
    return !box.empty() && within_float_range(box);
  }

  void look(size_t g) {
    GeometryView& view = views_[g];
    if (instances_[g].empty()) return;
    view.sample = sample_surface(scene_, plan_.geometries[g], max_sample_);
    std::optional<double> pixel;
    for (const PrimaryCamera& camera : cameras_) {
      std::vector<double> pixels(view.sample.size());
      ViewSums sums;
      add_geometry_view(camera, view.sample, {plan_.instances, instances_[g]}, measure_.geometries[g].bounds, sums,
                        pixels);
      const ViewStats stats = sums.stats();
      if (stats.coverage() >= kSeen) pixel = std::min(pixel.value_or(stats.pixel), stats.pixel);
      if (stats.pixels > view.best.pixels) view.best = stats, view.sample_pixels = std::move(pixels);
    }
    view.pixel = pixel.value_or(view.best.pixel);
    if (pixel) view.outline_share = outline_share(scene_, plan_.geometries[g]);
    if (view.sample_pixels.empty()) view.sample_pixels.resize(view.sample.size());
  }

  const Scene& scene_;
  const ScenePlan& plan_;
  const SceneMeasure& measure_;
  Progress& progress_;
  const std::span<const PrimaryCamera> cameras_;
  std::vector<GeometryView> views_;
  std::vector<std::vector<uint32_t>> instances_; // per geometry: its instances
  size_t max_sample_ = kMaxSample;
};

/// 2 * area / longest edge, with both summed over all triangles, in the geometry's own units.
double mean_height(const GeometryView& view) {
  double area = 0.0, edges = 0.0;
  for (const SampleTriangle& t : view.sample)
    area += t.weight * area_of(t.corners), edges += t.weight * longest_edge_of(t.corners);
  return edges > 0.0 ? 2.0 * area / edges : 0.0;
}

double middle_extent(const Bounds& box) {
  std::array<double, 3> sides{box.extent().x, box.extent().y, box.extent().z};
  std::sort(sides.begin(), sides.end());
  return sides[1];
}

class StepBounder {
public:
  StepBounder(const ScenePlan& plan, const SceneMeasure& measure, std::span<const GeometryView> views,
              std::span<const double> steps)
      : plan_(plan), measure_(measure), views_(views), steps_(steps), wanted_(views.size()) {}

  std::vector<WantedStep> run() {
    bound_heights();
    bound_pixels();
    bound_contacts();
    return std::move(wanted_);
  }

private:
  /// Converts a world-space length to the geometry's own units.
  double to_geometry(size_t g, double world) const { return world / world_scale(plan_.geometries[g]); }

  void bound(size_t g, double limit, PictureBound by) {
    if (!(limit > 0.0 && limit < steps_[g])) return;
    WantedStep& wanted = wanted_[g];
    wanted.step = std::min(wanted.step, limit * kMargin);
    if (by != PictureBound::kHeight && limit < wanted.limit) wanted.limit = limit, wanted.bound = by;
  }

  /// Bounds each geometry that covers at least `alone` of the image. Also bounds the smaller ones if those whose steps
  /// exceed the limit cover at least `together` in total.
  template <typename StepOf>
  void bound_seen(double alone, double together, PictureBound by, const StepOf& step_of) {
    double covered = 0.0;
    for (size_t g = 0; g < views_.size(); ++g)
      if (const double coverage = views_[g].best.coverage(); coverage < alone && step_of(g) < steps_[g])
        covered += coverage;
    for (size_t g = 0; g < views_.size(); ++g)
      if (const double coverage = views_[g].best.coverage();
          coverage >= alone || (coverage > 0.0 && covered >= together))
        bound(g, step_of(g), by);
  }

  void bound_heights() {
    const auto height = [&](size_t g) {
      return views_[g].best.coverage() >= kSeen ? to_geometry(g, views_[g].best.height) : mean_height(views_[g]);
    };
    bound_seen(kLarge, kMinTotalTiltCoverage, PictureBound::kHeight,
               [&](size_t g) { return height(g) / kHeightSteps; });
    for (size_t g = 0; g < views_.size(); ++g) bound(g, height(g) / kLowHeightSteps, PictureBound::kHeight);
  }

  void bound_pixels() {
    bound_seen(kSeen, kMinTotalCoverage, PictureBound::kPixel,
               [&](size_t g) { return to_geometry(g, views_[g].pixel) / kPixelSteps; });
  }

  void bound_contacts() {
    std::vector<Bounds> boxes(plan_.instances.size());
    std::vector<double> sizes(boxes.size(), std::numeric_limits<double>::infinity());
    std::vector<uint32_t> asked;
    std::vector<size_t> count(views_.size()), next(views_.size());
    for (const baked::InstanceRecord& instance : plan_.instances)
      if (instance.geometry != baked::kNone) ++count[instance.geometry];
    for (size_t i = 0; i < boxes.size(); ++i) {
      const baked::InstanceRecord& instance = plan_.instances[i];
      if (instance.geometry == baked::kNone) continue;
      const size_t g = instance.geometry;
      const Bounds box = placed_box(instance, measure_.geometries[g].bounds);
      if (box.empty() || !within_float_range(box)) continue;
      boxes[i] = box;
      if (views_[g].best.coverage() >= kSeen && middle_extent(box) > 0.0) sizes[i] = middle_extent(box);
      const size_t stride = (count[g] + kMaxContactInstances - 1) / kMaxContactInstances;
      if (next[g]++ % stride == 0) asked.push_back(static_cast<uint32_t>(i));
    }
    const std::vector<double> touching = smallest_touching(boxes, sizes, asked);
    for (size_t k = 0; k < asked.size(); ++k) {
      const size_t g = plan_.instances[asked[k]].geometry;
      bound(g, to_geometry(g, touching[k]) / kContactSteps, PictureBound::kContact);
    }
  }

  const ScenePlan& plan_;
  const SceneMeasure& measure_;
  const std::span<const GeometryView> views_;
  const std::span<const double> steps_;
  std::vector<WantedStep> wanted_;
};

} // namespace

std::string_view name_of(PictureBound bound) {
  constexpr std::array<std::string_view, 6> kNames{"none", "height", "pixel", "contact", "outline", "gap"};
  return kNames[static_cast<size_t>(bound)];
}

std::vector<PrimaryCamera> promised_cameras(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure) {
  std::vector<PrimaryCamera> cameras;
  const auto add = [&](const Camera& camera) {
    try {
      cameras.emplace_back(camera, kPromisedSize);
    } catch (const Error&) { // a camera that cannot make rays
    }
  };
  for (const Camera& camera : scene.cameras) add(camera);
  if (const Bounds box = scene_box(plan, measure); !box.empty()) add(framing_camera(box, kPromisedSize, scene.cameras));
  return cameras;
}

std::vector<GeometryView> measure_views(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                                        std::span<const PrimaryCamera> cameras, Progress& progress) {
  return ViewMeasurer(scene, plan, measure, cameras, progress).run();
}

std::vector<WantedStep> bound_steps(const ScenePlan& plan, const SceneMeasure& measure,
                                    std::span<const GeometryView> views, std::span<const double> steps) {
  return StepBounder(plan, measure, views, steps).run();
}

} // namespace packtrace
