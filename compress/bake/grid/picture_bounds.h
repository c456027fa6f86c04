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

/// The reason that limits a geometry's step, so that images of it do not change visibly (docs/accuracy.md).
enum class PictureBound : uint32_t {
  kNone,
  kHeight,  ///< facets tilt or collapse
  kPixel,   ///< outlines and contacts move in the image
  kContact, ///< objects sink into their support or hover above it
  kOutline, ///< outlines of many thin pieces move past pixel centres
  kGap,     ///< narrow gaps change their width
};
/// Name of a bound for messages and JSON, for example "height".
std::string_view name_of(PictureBound bound);

/// Largest factor by which an instance scales lengths from geometry space to world space.
inline double world_scale(const GeometryPlan& plan) {
  return plan.world_space || !(plan.max_stretch > 0.0) ? 1.0 : plan.max_stretch;
}

/// A geometry as seen by the scene's cameras and by the camera that frames the whole scene.
struct GeometryView {
  std::vector<SampleTriangle> sample;
  /// Per sample triangle: pixels in `best` covered by the triangles that it represents.
  std::vector<double> sample_pixels;
  ViewStats best; ///< of the camera in which it covers most pixels
  /// Smallest ViewStats::pixel of the cameras in which it covers at least kSeen; otherwise that of `best`.
  double pixel = 0.0;
  double outline_share = 0.0; ///< outline_share() if it covers at least kSeen in some camera
};

/// Geometry that covers a smaller fraction of the image counts only together with others.
inline constexpr double kSeen = 0.001;

/// Returns the scene's cameras and the camera that frames the whole scene, for images of kPromisedSize. Cameras that
/// cannot make rays are skipped: nothing can be rendered with them.
std::vector<PrimaryCamera> promised_cameras(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure);

/// Returns the views per geometry.
std::vector<GeometryView> measure_views(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                                        std::span<const PrimaryCamera> cameras, Progress& progress);

/// The step that a geometry needs if its current step exceeds a bound, in the geometry's own units.
struct WantedStep {
  /// A fixed fraction of the smallest exceeded limit, as a margin; infinity if none is exceeded.
  double step = std::numeric_limits<double>::infinity();
  double limit = std::numeric_limits<double>::infinity(); ///< smallest exceeded limit of bounds kPixel and kContact
  PictureBound bound = PictureBound::kNone;               ///< the bound of `limit`: kPixel or kContact
};

/// Returns the wanted step per geometry.
/// @param steps current steps per geometry, in the geometries' own units
std::vector<WantedStep> bound_steps(const ScenePlan& plan, const SceneMeasure& measure,
                                    std::span<const GeometryView> views, std::span<const double> steps);

} // namespace packtrace
