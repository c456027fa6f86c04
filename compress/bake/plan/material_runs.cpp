#include "compress/bake/plan/material_runs.h"

#include <algorithm>
#include <map>
#include <utility>

namespace packtrace {

void remove_material_slots(ScenePlan& plan, std::span<const std::vector<uint32_t>> kept_slots) {
  bool all = true;
  for (size_t i = 0; i < kept_slots.size(); ++i) all &= kept_slots[i].size() == plan.geometries[i].slot_class.size();
  if (all) return;
  std::vector<uint32_t> materials;
  std::map<std::vector<uint32_t>, uint32_t> first_of; // new run to its first slot
  // Geometry and old first slot to the new first slot.
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> first_of_instance;
  for (uint32_t i = 0; i < kept_slots.size(); ++i) {
    GeometryPlan& geometry = plan.geometries[i];
    std::vector<uint32_t> runs;
    for (const uint32_t before : geometry.material_runs) {
      std::vector<uint32_t> run;
      for (const uint32_t slot : kept_slots[i]) run.push_back(plan.material_slots[before + slot]);
      const auto [found, inserted] = first_of.try_emplace(run, static_cast<uint32_t>(materials.size()));
      if (inserted) materials.insert(materials.end(), run.begin(), run.end());
      first_of_instance[{i, before}] = found->second;
      runs.push_back(found->second);
    }
    std::sort(runs.begin(), runs.end());
    runs.erase(std::unique(runs.begin(), runs.end()), runs.end());
    geometry.material_runs = std::move(runs);
    std::vector<uint32_t> classes;
    for (const uint32_t slot : kept_slots[i]) classes.push_back(geometry.slot_class[slot]);
    geometry.slot_class = std::move(classes);
  }
  plan.material_slots = std::move(materials);
  for (baked::InstanceRecord& instance : plan.instances) {
    const auto found = first_of_instance.find({instance.geometry, instance.first_slot});
    instance.first_slot = found != first_of_instance.end() ? found->second : 0; // left-out instances have no slots
  }
}

} // namespace packtrace
