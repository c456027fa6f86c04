#include "compress/bake/plan/material_runs.h"

#include <algorithm>
#include <map>
#include <utility>

#include "pbrt_import/base/error.h"

namespace packtrace {

void MaterialRuns::assign_slots(const Scene& scene, uint32_t geometry, GeometryUsers& users) {
  GeometryPlan& plan = plan_.geometries[geometry];
  const size_t parts = plan.parts.size();
  using Column = std::pair<uint32_t, std::vector<uint32_t>>; // class, and one material per user
  std::map<Column, std::vector<size_t>> parts_of;
  for (size_t p = 0; p < parts; ++p) {
    if (scene.meshes[plan.parts[p].mesh].triangles.empty()) continue; // its slot would have no clusters
    Column column;
    for (uint32_t u = 0; u < users.count; ++u) column.second.push_back(users.part_materials[u * parts + p]);
    column.first = baked::material_class(scene.materials[column.second.front()].flags);
    parts_of[std::move(column)].push_back(p);
  }
  for (const auto& [column, members] : parts_of) {
    for (const size_t p : members) plan.parts[p].slot = static_cast<uint32_t>(plan.slot_class.size());
    plan.slot_class.push_back(column.first);
  }
  users.first_slot.resize(users.count);
  std::vector<uint32_t> run(parts_of.size());
  for (uint32_t u = 0; u < users.count; ++u) {
    std::transform(parts_of.begin(), parts_of.end(), run.begin(),
                   [u](const auto& slot) { return slot.first.second[u]; });
    users.first_slot[u] = place(run);
    plan.material_runs.push_back(users.first_slot[u]);
  }
  std::sort(plan.material_runs.begin(), plan.material_runs.end());
  plan.material_runs.erase(std::unique(plan.material_runs.begin(), plan.material_runs.end()), plan.material_runs.end());
  users.part_materials = {};
}

uint32_t MaterialRuns::place(const std::vector<uint32_t>& run) {
  const auto end = static_cast<uint32_t>(plan_.material_slots.size());
  const auto [found, inserted] = first_of_.try_emplace(run, end);
  if (!inserted) return found->second;
  if (run.size() >= baked::kNone - end)
    throw Error(ErrorKind::kLimitExceeded, "the materials of all geometries take more than 2^32 slots");
  plan_.material_slots.insert(plan_.material_slots.end(), run.begin(), run.end());
  return end;
}

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
