#include "compress/bake/grid/seam_gaps.h"

#include <algorithm>
#include <cmath>

#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/grid/touching_boxes.h"

namespace packtrace {
namespace {

/// Largest world-space distance of a decoded point from its source point, for an error per object axis.
double displacement(const baked::InstanceRecord& instance, double error) {
  DVec3 world(0.0);
  for (size_t i = 0; i < 9; ++i)
    world[static_cast<int>(i % 3)] += std::abs(double{instance.world_from_object[i]}) * error;
  return glm::length(world);
}

} // namespace

InstanceSeams::InstanceSeams(const BakedFile& file) : boxes_(file.instances().size()) {
  std::vector<double> own(boxes_.size());
  std::vector<uint32_t> asked;
  for (uint32_t i = 0; i < boxes_.size(); ++i) {
    const baked::InstanceRecord& instance = file.instances()[i];
    const baked::GeometryRecord& geometry = file.geometries()[instance.geometry];
    Bounds box = object_bounds(geometry);
    if (box.empty()) continue;
    box.lo -= geometry.position_error_bound, box.hi += geometry.position_error_bound;
    boxes_[i] = placed_box(instance, box);
    own[i] = displacement(instance, geometry.position_error_bound);
    if ((geometry.flags & baked::kWorldSpace) == 0) asked.push_back(i);
  }
  own_grid_instance_count_ = asked.size();
  touching_ = std::move(asked);
  const std::vector<double> beside = largest_touching(own);
  size_t kept = 0;
  for (size_t i = 0; i < beside.size(); ++i) {
    if (std::isinf(beside[i])) continue; // touches nothing
    gaps_.push_back(own[touching_[i]] + beside[i]);
    touching_[kept++] = touching_[i];
  }
  touching_.resize(kept);
}

SeamSummary InstanceSeams::summary() const {
  return {own_grid_instance_count_, touching_.size(), gaps_.empty() ? 0.0 : *std::ranges::max_element(gaps_)};
}

std::vector<double> InstanceSeams::largest_touching(std::span<const double> values) const {
  std::vector<double> sizes(values.size());
  std::ranges::transform(values, sizes.begin(), [](double value) { return -value; });
  std::vector<double> result = smallest_touching(boxes_, sizes, touching_);
  for (double& value : result) value = -value;
  return result;
}

} // namespace packtrace
