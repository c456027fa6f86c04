#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// Users of a geometry: world shapes and objects. Each assigns one material to each part.
struct GeometryUsers {
  std::vector<uint32_t> part_materials; ///< materials of all parts, user by user
  uint32_t count = 0;
  std::vector<uint32_t> first_slot; ///< per user, in ScenePlan::material_slots
};

/// Builds ScenePlan::material_slots. Equal runs of materials are stored once.
class MaterialRuns {
public:
  explicit MaterialRuns(ScenePlan& plan) : plan_(plan) {}

  /// Merges parts into a slot if every user assigns them the same material. Slots are ordered by class, then by
  /// materials. Fills in the slots of the plan's geometry, and the users' first slots; clears their materials.
  /// Throws Error(kLimitExceeded) if all geometries have more slots than 32 bits can number.
  void assign_slots(const Scene& scene, uint32_t geometry, GeometryUsers& users);

private:
  uint32_t place(const std::vector<uint32_t>& run);

  ScenePlan& plan_;
  std::map<std::vector<uint32_t>, uint32_t> first_of_; // run to its first slot
};

/// Removes material slots from a plan: from its geometries, its runs of materials and its instances.
/// @param kept_slots per geometry: the slots to keep, ascending. If every geometry keeps all of its slots, nothing
/// changes.
void remove_material_slots(ScenePlan& plan, std::span<const std::vector<uint32_t>> kept_slots);

} // namespace packtrace
