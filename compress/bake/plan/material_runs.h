#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// Removes material slots from a plan: from its geometries, its runs of materials and its instances.
/// @param kept_slots per geometry: the slots to keep, ascending. If every geometry keeps all of its slots, nothing
/// changes.
void remove_material_slots(ScenePlan& plan, std::span<const std::vector<uint32_t>> kept_slots);

} // namespace packtrace
