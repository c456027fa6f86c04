#include "compress/bake/nested_grids.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "compress/bake/weld_table.h"
#include "compress/format/position_grid.h"

namespace packtrace {
namespace {

constexpr double kRoughFactor = 16.0;  // steps so much above what was asked for show, too
constexpr double kFloatStep = 0x1p-23; // finer than floats are at the same coordinate: no use
constexpr double kMaxHalvings = 1000.0;
constexpr double kMaxSteps = 0x1p50; // coordinates stay well inside the lattice

/// Positions are compared as floats: what the source has as one point may differ in the last bits of doubles.
uint64_t position_key(DVec3 p) {
  const auto bits = [](double x) { return uint64_t{std::bit_cast<uint32_t>(static_cast<float>(x) + 0.0f)}; };
  return mix_words(bits(p.x), bits(p.y), bits(p.z));
}

template <typename PerPosition>
void for_each_position(const Scene& scene, const GeometryPlan& plan, const PerPosition& per_position) {
  for (const GeometryPart& part : plan.parts)
    for (const Vec3 p : scene.meshes[part.mesh].positions)
      per_position(transform_point(part.geometry_from_mesh, DVec3(p)));
}

class Nesting {
public:
  Nesting(const Scene& scene, const ScenePlan& plan, std::span<const GeometryMeasure> measures, double precision,
          double world_step)
      : scene_(scene), plan_(plan), measures_(measures), precision_(precision), world_step_(world_step),
        halvings_(plan.geometries.size()), group_(plan.geometries.size()) {
    std::iota(group_.begin(), group_.end(), 0u);
  }

  std::vector<uint32_t> run() {
    for (uint32_t g = 0; g < halvings_.size(); ++g) {
      halvings_[g] = wanted_halvings(g);
      if (halvings_[g] > 0) small_.push_back(g);
    }
    if (small_.empty()) return std::move(halvings_);
    gather_positions();
    join_small_ones();
    find_tied_ones();
    settle();
    return std::move(halvings_);
  }

private:
  uint32_t wanted_halvings(uint32_t g) const {
    const GeometryMeasure& measure = measures_[g];
    if (!plan_.geometries[g].world_space || measure.bounds.empty() || !(measure.median_edge > 0.0)) return 0;
    if (world_step_ <= std::max(kRoughFactor * precision_, kRoughEdge) * measure.median_edge) return 0;
    const double wanted = std::ceil(std::log2(world_step_ / (precision_ * measure.median_edge)));
    const double useful = std::floor(std::log2(world_step_ / (measure.max_abs() * kFloatStep)));
    return static_cast<uint32_t>(std::clamp(std::min(wanted, useful), 0.0, kMaxHalvings));
  }

  struct Key {
    uint64_t position;
    uint32_t geometry;
    bool operator<(const Key& other) const {
      return position != other.position ? position < other.position : geometry < other.geometry;
    }
  };

  void gather_positions() {
    for (const uint32_t g : small_) {
      bounds_.extend(measures_[g].bounds);
      for_each_position(scene_, plan_.geometries[g], [&](DVec3 p) { keys_.push_back({position_key(p), g}); });
    }
    tbb::parallel_sort(keys_.begin(), keys_.end());
  }

  uint32_t find(uint32_t g) {
    while (group_[g] != g) g = group_[g] = group_[group_[g]];
    return g;
  }

  void join_small_ones() {
    for (size_t i = 1; i < keys_.size(); ++i)
      if (keys_[i].position == keys_[i - 1].position) {
        const uint32_t a = find(keys_[i].geometry), b = find(keys_[i - 1].geometry);
        group_[std::max(a, b)] = std::min(a, b);
      }
  }

  bool may_touch(const Bounds& box) const {
    for (int axis = 0; axis < 3; ++axis)
      if (!(box.lo[axis] <= bounds_.hi[axis] && bounds_.lo[axis] <= box.hi[axis])) return false;
    return true;
  }

  /// Small geometries with a position of one that is not small.
  void find_tied_ones() {
    tied_.assign(halvings_.size(), 0);
    tbb::parallel_for(size_t{0}, halvings_.size(), [&](size_t g) {
      if (halvings_[g] > 0 || !plan_.geometries[g].world_space || !may_touch(measures_[g].bounds)) return;
      for_each_position(scene_, plan_.geometries[g], [&](DVec3 p) {
        const uint64_t key = position_key(p);
        const auto found = std::lower_bound(keys_.begin(), keys_.end(), Key{key, 0});
        if (found != keys_.end() && found->position == key)
          std::atomic_ref(tied_[found->geometry]).store(1, std::memory_order_relaxed);
      });
    });
  }

  /// A group is tied as a whole, and its members have one step.
  void settle() {
    std::vector<uint32_t> of_group(halvings_.size());
    std::vector<uint8_t> kept(halvings_.size());
    for (const uint32_t g : small_) {
      const uint32_t group = find(g);
      of_group[group] = std::max(of_group[group], halvings_[g]);
      kept[group] |= tied_[g];
    }
    for (const uint32_t g : small_) {
      const double step = std::ldexp(world_step_, -static_cast<int>(of_group[find(g)]));
      kept[find(g)] |= measures_[g].max_abs() > kMaxSteps * step || step < exp2_exact(kMinStepExponent + 4);
    }
    for (const uint32_t g : small_) halvings_[g] = kept[find(g)] != 0 ? 0 : of_group[find(g)];
  }

  const Scene& scene_;
  const ScenePlan& plan_;
  const std::span<const GeometryMeasure> measures_;
  const double precision_, world_step_;
  std::vector<uint32_t> halvings_; // by geometry; first those wanted
  std::vector<uint32_t> group_;    // by geometry: another one of its group, in the end the smallest
  std::vector<uint8_t> tied_;      // by geometry
  std::vector<uint32_t> small_;
  std::vector<Key> keys_; // of all positions of small geometries, sorted
  Bounds bounds_;         // theirs
};

} // namespace

std::vector<uint32_t> nest_grids(const Scene& scene, const ScenePlan& plan, std::span<const GeometryMeasure> measures,
                                 const BakeConfig& config, double world_step) {
  if (config.precision_kind != PrecisionKind::kEdgeFraction) return std::vector<uint32_t>(plan.geometries.size());
  return Nesting(scene, plan, measures, config.precision, world_step).run();
}

} // namespace packtrace
