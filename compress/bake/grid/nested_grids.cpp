#include "compress/bake/grid/nested_grids.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

namespace packtrace {
namespace {

constexpr double kMaxStepRatio = 16.0; // a larger ratio of a step and the wanted step is visible, too
constexpr double kFloatStep = 0x1p-23; // relative to coordinates: finer steps than the spacing of floats are useless
constexpr double kMaxHalvings = 60.0;  // keeps shifts of lattice coordinates valid
constexpr double kMaxSteps = 0x1p50;   // keeps coordinates well inside the lattice

template <typename PerPosition>
void for_each_position(const Scene& scene, const GeometryPlan& plan, const PerPosition& per_position) {
  for (const GeometryPart& part : plan.parts)
    for (const Vec3 p : scene.meshes[part.mesh].positions)
      per_position(transform_point(part.geometry_from_mesh, DVec3(p)));
}

/// Collects the positions of world-space geometry on finer grids than the scene's, and finds the coarsest grid of each.
class PositionSharing {
public:
  PositionSharing(const Scene& scene, const ScenePlan& plan, std::span<const GeometryMeasure> measures,
                  std::span<const uint32_t> halvings)
      : scene_(scene), plan_(plan), measures_(measures), halvings_(halvings) {}

  std::vector<std::vector<SharedPosition>> run() {
    std::vector<std::vector<SharedPosition>> shared(halvings_.size());
    gather_positions();
    if (keys_.empty()) return shared;
    flag_scene_grid_positions();
    for (size_t begin = 0, end = 0; begin < keys_.size(); begin = end) {
      uint32_t least = halvings_[keys_[begin].geometry];
      for (end = begin; end < keys_.size() && keys_[end].position == keys_[begin].position; ++end) {
        least = std::min(least, halvings_[keys_[end].geometry]);
        if (on_scene_grid_[end] != 0) least = 0;
      }
      for (size_t i = begin; i < end; ++i) {
        const uint32_t shift = halvings_[keys_[i].geometry] - least;
        std::vector<SharedPosition>& mine = shared[keys_[i].geometry];
        if (shift > 0 && (mine.empty() || mine.back().key != keys_[i].position))
          mine.push_back({keys_[i].position, shift});
      }
    }
    return shared;
  }

private:
  struct Key {
    uint64_t position;
    uint32_t geometry;
    bool operator<(const Key& other) const {
      return position != other.position ? position < other.position : geometry < other.geometry;
    }
  };

  void gather_positions() {
    for (uint32_t g = 0; g < halvings_.size(); ++g) {
      if (halvings_[g] == 0) continue;
      bounds_.extend(measures_[g].bounds);
      for_each_position(scene_, plan_.geometries[g], [&](DVec3 p) { keys_.push_back({position_key(p), g}); });
    }
    tbb::parallel_sort(keys_.begin(), keys_.end());
    on_scene_grid_.assign(keys_.size(), 0);
  }

  bool may_touch(const Bounds& box) const {
    for (int axis = 0; axis < 3; ++axis)
      if (!(box.lo[axis] <= bounds_.hi[axis] && bounds_.lo[axis] <= box.hi[axis])) return false;
    return true;
  }

  /// Flags the first key of each position that also belongs to geometry on the scene's own grid.
  void flag_scene_grid_positions() {
    tbb::parallel_for(size_t{0}, halvings_.size(), [&](size_t g) {
      if (halvings_[g] > 0 || !plan_.geometries[g].world_space || !may_touch(measures_[g].bounds)) return;
      for_each_position(scene_, plan_.geometries[g], [&](DVec3 p) {
        const uint64_t key = position_key(p);
        const auto found = std::lower_bound(keys_.begin(), keys_.end(), Key{key, 0});
        if (found != keys_.end() && found->position == key)
          std::atomic_ref(on_scene_grid_[static_cast<size_t>(found - keys_.begin())])
              .store(1, std::memory_order_relaxed);
      });
    });
  }

  const Scene& scene_;
  const ScenePlan& plan_;
  const std::span<const GeometryMeasure> measures_;
  const std::span<const uint32_t> halvings_;
  std::vector<Key> keys_;              // of all positions of geometry on finer grids, sorted
  std::vector<uint8_t> on_scene_grid_; // per key
  Bounds bounds_;                      // of geometry on finer grids
};

} // namespace

uint32_t max_halvings(const GeometryMeasure& measure, double world_step, double finest) {
  const double largest = measure.max_abs();
  if (!(largest > 0.0)) return 0;
  const double by_floats = std::log2(world_step / finest);
  const double by_lattice = std::log2(world_step / largest * kMaxSteps);
  const double by_exponent = std::log2(world_step) - (kMinStepExponent + 4);
  return static_cast<uint32_t>(
      std::clamp(std::floor(std::min({by_floats, by_lattice, by_exponent})), 0.0, kMaxHalvings));
}

std::vector<uint32_t> halvings_of_small_geometries(const ScenePlan& plan, std::span<const GeometryMeasure> measures,
                                                   double precision, double world_step) {
  std::vector<uint32_t> halvings(plan.geometries.size());
  for (size_t g = 0; g < halvings.size(); ++g) {
    const GeometryMeasure& measure = measures[g];
    if (!plan.geometries[g].world_space || measure.bounds.empty() || !(measure.median_edge > 0.0)) continue;
    if (world_step <= std::max(kMaxStepRatio * precision, kRoughEdge) * measure.median_edge) continue;
    const double wanted = std::ceil(std::log2(world_step / (precision * measure.median_edge)));
    halvings[g] = static_cast<uint32_t>(
        std::min(wanted, static_cast<double>(max_halvings(measure, world_step, measure.max_abs() * kFloatStep))));
  }
  return halvings;
}

std::vector<std::vector<SharedPosition>> find_shared_positions(const Scene& scene, const ScenePlan& plan,
                                                               std::span<const GeometryMeasure> measures,
                                                               std::span<const uint32_t> halvings) {
  return PositionSharing(scene, plan, measures, halvings).run();
}

} // namespace packtrace
