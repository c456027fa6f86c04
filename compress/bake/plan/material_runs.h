#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// Takes material slots out of a plan: out of its geometries, of the runs of materials, and of its instances.
/// @param slots_left by geometry: its slots that stay, ascending. Nothing changes where that is all of them everywhere.
void close_material_slots(ScenePlan& plan, std::span<const std::vector<uint32_t>> slots_left);

} // namespace packtrace
