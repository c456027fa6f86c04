#include "compress/bake/grid/grid_choice.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "compress/bake/grid/grid_check.h"
#include "compress/bake/grid/nested_grids.h"
#include "compress/bake/grid/stated_grids.h"
#include "compress/bake/grid/visible_changes.h"

namespace packtrace {
namespace {

constexpr int kMaxRefinements = 3;
constexpr int kMaxChangeRefinements = 5;
constexpr double kChangeMargin = 0.6;     // fraction of the allowed change (VisibleChanges) to aim at
constexpr double kMaxPixelSteps = 1024.0; // steps per pixel from which visible changes refine no further

// Limits of the check.
constexpr double kMaxCollapsed = 0.001; // fraction of the image
constexpr double kMinTilting = 0.01;    // fraction of the image; geometry that covers less may tilt
constexpr double kMaxMeanTiltDegrees = 1.0;
constexpr double kMaxTiltDegrees = 5.0;     // 99 % quantile over the pixels
constexpr double kMaxPassedPixels = 0.0045; // fraction of the covered pixels whose centre an outline moves past
constexpr double kBoundSlack = 2.0;         // factor by which limits on moved positions may be exceeded

class GridChooser {
public:
  GridChooser(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure, const BakeConfig& config,
              Progress& progress)
      : scene_(scene), plan_(plan), measure_(measure), config_(config), progress_(progress),
        checks_(plan.geometries.size()) {
    out_.grids.resize(plan.geometries.size());
    out_.halvings.resize(plan.geometries.size());
  }

  GridChoice run() {
    begin();
    progress_.begin("choosing grids", out_.grids.size());
    const std::vector<PrimaryCamera> cameras = promised_cameras(scene_, plan_, measure_);
    views_ = measure_views(scene_, plan_, measure_, cameras, progress_);
    const std::vector<WantedStep> wanted = bound_steps(plan_, measure_, views_, steps());
    const std::vector<double> first = steps();
    if (may_refine())
      for (size_t g = 0; g < wanted.size(); ++g) refine_to(g, wanted[g].step);
    share_and_check();
    for (int i = 0; may_refine() && i < kMaxRefinements && refine_failing(); ++i) share_and_check();
    const VisibleChanges visible(scene_, plan_, measure_, cameras, progress_);
    changes_ = compare(visible);
    for (int i = 0; may_refine() && i < kMaxChangeRefinements && refine_changed(); ++i) {
      share_and_check();
      changes_ = compare(visible);
    }
    for (size_t g = 0; g < first.size(); ++g) out_.finer_geometries += out_.grids[g].grid.step() < first[g];
    report(wanted);
    return std::move(out_);
  }

private:
  bool may_refine() const { return config_.precision_kind == PrecisionKind::kPicture; }
  bool is_stated(size_t g) const { return !stated_.grids.empty() && stated_.grids[g].has_value(); }
  bool is_empty(size_t g) const { return measure_.geometries[g].bounds.empty(); }

  /// Chooses the grids according to config, including finer ones for small geometries.
  void begin() {
    if (may_refine()) stated_ = stated_grids(scene_, plan_);
    out_.false_lattices = stated_.false_lattices;
    if (stated_.world) {
      out_.world = *stated_.world;
      for (size_t g = 0; g < out_.grids.size(); ++g)
        if (stated_.grids[g] && plan_.geometries[g].world_space)
          out_.halvings[g] = static_cast<uint32_t>(out_.world.exponent - stated_.grids[g]->exponent);
    } else if (measure_.has_world_space) {
      out_.world = choose_grid(config_, measure_.world, 1.0);
    }
    if (measure_.has_world_space && !stated_.world &&
        (may_refine() || config_.precision_kind == PrecisionKind::kEdgeFraction))
      out_.halvings = halvings_of_small_geometries(plan_, measure_.geometries, config_.precision, out_.world.step());
    for (size_t g = 0; g < out_.grids.size(); ++g) {
      if (is_empty(g)) continue; // nothing to quantise: keep the default grid
      const GeometryPlan& plan = plan_.geometries[g];
      PositionGrid& grid = out_.grids[g].grid;
      grid = plan.world_space ? out_.world
             : is_stated(g)   ? *stated_.grids[g]
                              : choose_grid(config_, measure_.geometries[g], plan.max_stretch);
      grid.exponent -= static_cast<int32_t>(out_.halvings[g]);
      out_.nested_geometries += out_.halvings[g] > 0;
    }
  }

  std::vector<double> steps() const {
    std::vector<double> steps;
    for (const GeometryGrid& grid : out_.grids) steps.push_back(grid.grid.step());
    return steps;
  }

  /// Refines the geometry's step to about `step`, but not below the spacing of floats.
  /// @return whether the step became finer
  bool refine_to(size_t g, double step) {
    PositionGrid& grid = out_.grids[g].grid;
    if (is_empty(g) || is_stated(g) || !(step < grid.step())) return false;
    const GeometryMeasure& measure = measure_.geometries[g];
    const PositionGrid before = grid;
    if (plan_.geometries[g].world_space) {
      const double wanted = std::max(std::round(std::log2(out_.world.step() / step)), 1.0 + out_.halvings[g]);
      const uint32_t most = max_halvings(measure, out_.world.step(), measure.float_step());
      const auto halvings = static_cast<uint32_t>(std::min(wanted, static_cast<double>(most)));
      if (halvings <= out_.halvings[g]) return false;
      out_.halvings[g] = halvings;
      grid = out_.world;
      grid.exponent -= static_cast<int32_t>(halvings);
    } else if (const double finest = finest_step(measure); finest < grid.step()) {
      grid = choose_position_grid(std::max(step, finest));
    }
    return grid.step() < before.step();
  }

  /// The finest useful step of a grid that no other geometry shares.
  static double finest_step(const GeometryMeasure& measure) {
    return std::max(measure.float_step(), measure.max_abs() * 0x1p-50);
  }

  /// Updates the positions that geometries on several grids share, then checks the samples on these grids.
  void share_and_check() {
    std::vector<std::vector<SharedPosition>> shared =
        find_shared_positions(scene_, plan_, measure_.geometries, out_.halvings);
    for (size_t g = 0; g < shared.size(); ++g) out_.grids[g].shared = std::move(shared[g]);
    tbb::parallel_for(size_t{0}, checks_.size(), [&](size_t g) {
      // A geometry that exceeds the lattice is rejected when it is packed.
      const bool fits = fits_lattice(measure_.geometries[g].max_abs(), out_.grids[g].grid.step());
      checks_[g] = fits ? check_grid(views_[g], out_.grids[g]) : GridCheck{};
    });
  }

  bool tilts(size_t g) const {
    const GridCheck& check = checks_[g];
    if (check.collapsed > kMaxCollapsed) return true;
    return views_[g].best.coverage() >= kMinTilting &&
           (check.mean_tilt_degrees > kMaxMeanTiltDegrees || check.tilt_degrees > kMaxTiltDegrees);
  }

  /// Fraction of a geometry's pixels whose centre an outline moves past. A strip of height h that is displaced by a
  /// quarter of the step (the mean over all directions) changes step / (2 h) of its area. Projection scales lengths by
  /// pi / 4 and areas by 1 / 2 on average. So the fraction is about 3/4 step / h for strips whose edges are all
  /// outline.
  double passed_pixel_fraction(size_t g) const {
    const GeometryView& view = views_[g];
    if (!(view.best.height > 0.0)) return 0.0;
    const double step = effective_step(g) * world_scale(plan_.geometries[g]);
    return std::min(0.75 * view.outline_share * step / view.best.height, 1.0);
  }

  /// Flags geometries whose outlines move too far; none if the outlines of the whole scene together move little enough.
  std::vector<uint8_t> find_moved_outlines() const {
    std::vector<uint8_t> moved(views_.size());
    double covered = 0.0, passed = 0.0;
    for (size_t g = 0; g < views_.size(); ++g) {
      covered += views_[g].best.pixels;
      passed += views_[g].best.pixels * passed_pixel_fraction(g);
    }
    for (size_t g = 0; g < views_.size() && passed > kMaxPassedPixels * covered; ++g)
      moved[g] = passed_pixel_fraction(g) > kMaxPassedPixels;
    return moved;
  }

  /// Halves the step of each geometry that fails the check, and of geometries on coarser grids that share positions
  /// with it.
  bool refine_failing() {
    std::vector<uint8_t> failing = find_moved_outlines();
    bool shared = false, refined = false;
    for (size_t g = 0; g < failing.size(); ++g) {
      failing[g] |= tilts(g);
      shared |= failing[g] != 0 && !out_.grids[g].shared.empty();
    }
    if (shared) spread_to_sharing(failing);
    for (size_t g = 0; g < failing.size(); ++g)
      if (failing[g] != 0) refined |= refine_to(g, out_.grids[g].grid.step() / 2.0);
    return refined;
  }

  std::vector<VisibleChanges::Change> compare(const VisibleChanges& visible) const {
    for (size_t g = 0; g < out_.grids.size(); ++g) // as in share_and_check()
      if (!fits_lattice(measure_.geometries[g].max_abs(), out_.grids[g].grid.step()))
        return std::vector<VisibleChanges::Change>(out_.grids.size());
    return visible.compare(out_.grids);
  }

  /// Refines the steps of geometries whose visible changes are too large, and of geometries on coarser grids that share
  /// positions with them.
  bool refine_changed() {
    std::vector<uint8_t> failing(changes_.size());
    bool shared = false, refined = false;
    for (size_t g = 0; g < failing.size(); ++g) {
      failing[g] = changes_[g].excess() > 1.0;
      shared |= failing[g] != 0 && !out_.grids[g].shared.empty();
    }
    if (shared) spread_to_sharing(failing);
    for (size_t g = 0; g < failing.size(); ++g) {
      if (failing[g] == 0) continue;
      const double step = out_.grids[g].grid.step(), wanted = changes_[g].excess() > 1.0 ? changed_step(g) : step / 2.0;
      const double finest = views_[g].pixel / world_scale(plan_.geometries[g]) / kMaxPixelSteps;
      if (step > finest) refined |= refine_to(g, std::max(wanted, finest));
    }
    return refined;
  }

  /// The step at which a failing geometry is expected to change little enough. Changes are proportional to the step.
  double changed_step(size_t g) const { return out_.grids[g].grid.step() * kChangeMargin / changes_[g].excess(); }

  /// Adds geometries on coarser grids that share positions with a failing geometry.
  void spread_to_sharing(std::vector<uint8_t>& failing) const {
    std::vector<uint64_t> keys;
    for (size_t g = 0; g < failing.size(); ++g)
      if (failing[g] != 0)
        for (const SharedPosition& position : out_.grids[g].shared) keys.push_back(position.key);
    std::sort(keys.begin(), keys.end());
    tbb::parallel_for(size_t{0}, failing.size(), [&](size_t g) {
      if (failing[g] != 0 || !plan_.geometries[g].world_space) return;
      for (const GeometryPart& part : plan_.geometries[g].parts)
        for (const Vec3 p : scene_.meshes[part.mesh].positions)
          if (std::binary_search(keys.begin(), keys.end(),
                                 position_key(transform_point(part.geometry_from_mesh, DVec3(p))))) {
            failing[g] = 1;
            return;
          }
    });
  }

  /// Twice the largest distance by which a position moves, at most the step. Positions on or near the lattice move less
  /// than half a step.
  double effective_step(size_t g) const { return std::min(out_.grids[g].grid.step(), 2.0 * checks_[g].moved); }

  void report(std::span<const WantedStep> wanted) {
    const std::vector<uint8_t> outlines = find_moved_outlines();
    for (size_t g = 0; g < views_.size(); ++g) {
      const double step = effective_step(g);
      Shortfall shortfall{static_cast<uint32_t>(g), PictureBound::kNone, 0.0, out_.grids[g].grid.step(), false};
      if (tilts(g)) {
        const double tilt =
            std::max(checks_[g].mean_tilt_degrees / kMaxMeanTiltDegrees, checks_[g].tilt_degrees / kMaxTiltDegrees);
        shortfall.bound = PictureBound::kHeight;
        shortfall.wanted = std::min(wanted[g].step, shortfall.step / std::max(2.0, tilt));
      } else if (outlines[g] != 0) {
        shortfall.bound = PictureBound::kOutline;
        shortfall.wanted = std::min(wanted[g].step, shortfall.step * kMaxPassedPixels / passed_pixel_fraction(g));
      } else if (changes_[g].excess() > 1.0) {
        shortfall.bound = changes_[g].edges > 1.0 ? PictureBound::kOutline : PictureBound::kGap;
        shortfall.wanted = std::min(wanted[g].step, changed_step(g));
      } else if (views_[g].best.coverage() >= kSeen && step > kBoundSlack * wanted[g].limit) {
        shortfall.bound = wanted[g].bound;
        shortfall.wanted = wanted[g].step;
      }
      if (shortfall.bound == PictureBound::kNone || !(step > 0.0)) continue;
      const GeometryMeasure& measure = measure_.geometries[g];
      shortfall.float_limit = shortfall.step <= 2.0 * finest_step(measure);
      out_.shortfalls.push_back(shortfall);
    }
  }

  const Scene& scene_;
  const ScenePlan& plan_;
  const SceneMeasure& measure_;
  const BakeConfig& config_;
  Progress& progress_;
  StatedGrids stated_; // empty unless the default precision is chosen
  std::vector<GeometryView> views_;
  std::vector<GridCheck> checks_;               // per geometry
  std::vector<VisibleChanges::Change> changes_; // per geometry
  GridChoice out_;
};

} // namespace

GridChoice choose_grids(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                        const BakeConfig& config, Progress& progress) {
  return GridChooser(scene, plan, measure, config, progress).run();
}

} // namespace packtrace
