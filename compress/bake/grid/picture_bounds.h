#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/grid/view_measure.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// What limits the step of a geometry, so that pictures of it stay what they are (docs/accuracy.md).
enum class PictureBound : uint32_t {
  kNone,
  kHeight,  ///< facets tilt, or lose their area
  kPixel,   ///< outlines and contacts move on the image
  kContact, ///< things sink into what they stand on, or hover
  kOutline, ///< edges of many thin pieces move past pixels
};
std::string_view name_of(PictureBound bound);

/// The largest factor by which an instance turns lengths of the geometry's space into lengths of the world.
inline double world_scale(const GeometryPlan& plan) {
  return plan.world_space || !(plan.max_stretch > 0.0) ? 1.0 : plan.max_stretch;
}

/// A geometry as the cameras of the scene, and the camera that frames all of it, see it.
struct GeometryView {
  std::vector<SampleTriangle> sample;
  /// By sample: pixels that the triangles which it stands for cover in `best`.
  std::vector<double> sample_pixels;
  ViewStats best;             ///< of the camera that sees most of it
  double pixel = 0.0;         ///< least ViewStats::pixel of the cameras that see kSeen of it, else that of `best`
  double outline_share = 0.0; ///< outline_share() where some camera sees kSeen of it
};

/// Geometry that covers less of the image counts only together with others.
inline constexpr double kSeen = 0.001;

/// By geometry. Cameras that have no rays are left out: nothing can be rendered with them.
std::vector<GeometryView> look_at_scene(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                                        Progress& progress);

/// What a geometry whose step exceeds a bound should have, in units of its space.
struct WantedStep {
  double step = std::numeric_limits<double>::infinity();  ///< below all limits that are exceeded, as a margin
  double limit = std::numeric_limits<double>::infinity(); ///< the least of those about moved positions
  PictureBound bound = PictureBound::kNone;               ///< whose that is: kPixel or kContact
};

/// By geometry. @param steps that the geometries have, in units of their spaces
std::vector<WantedStep> bound_steps(const ScenePlan& plan, const SceneMeasure& measure,
                                    std::span<const GeometryView> views, std::span<const double> steps);

} // namespace packtrace
