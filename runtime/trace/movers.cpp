#include "runtime/trace/movers.h"

#include <string>

#include "pbrt_import/base/error.h"
#include "runtime/trace/placement.h"
#include "runtime/trace/unit_space.h"

namespace packtrace {
namespace {

std::string instance_label(uint32_t instance) { return "instance " + std::to_string(instance); }

void check_ascending(std::span<const uint32_t> instances, size_t count) {
  for (size_t i = 0; i < instances.size(); ++i) {
    if (instances[i] >= count)
      throw Error(ErrorKind::kUsage,
                  instance_label(instances[i]) + " cannot move: the scene has " + std::to_string(count) + " instances");
    if (i > 0 && instances[i] <= instances[i - 1])
      throw Error(ErrorKind::kUsage, "the numbers of moving instances must ascend; " + instance_label(instances[i]) +
                                         " follows " + std::to_string(instances[i - 1]));
  }
}

bool is_finite_transform(const Affine& m) {
  return is_finite(m[0]) && is_finite(m[1]) && is_finite(m[2]) && is_finite(m[3]);
}

} // namespace

std::vector<uint8_t> movable_instances(const Movers& movers, size_t count) {
  if (movers.instances.empty()) return {};
  check_ascending(movers.instances, count);
  if (!movers.world.empty() && !(is_finite(movers.world.lo) && is_finite(movers.world.hi)))
    throw Error(ErrorKind::kUsage, "the bounds of the moving instances are not finite");
  std::vector<uint8_t> movable(count, 0);
  for (const uint32_t i : movers.instances) movable[i] = 1;
  return movable;
}

void check_moves(std::span<const uint8_t> movable, std::span<const uint32_t> instances,
                 std::span<const Affine> world_from_object) {
  if (instances.size() != world_from_object.size())
    throw Error(ErrorKind::kUsage, "moving " + std::to_string(instances.size()) +
                                       " instances needs as many transforms, not " +
                                       std::to_string(world_from_object.size()));
  for (const uint32_t i : instances)
    if (i >= movable.size() || movable[i] == 0)
      throw Error(ErrorKind::kUsage, instance_label(i) + " may not move: it is not among the movers of the tracer");
  check_ascending(instances, movable.size());
  for (size_t i = 0; i < instances.size(); ++i)
    if (!is_finite_transform(world_from_object[i]))
      throw Error(ErrorKind::kInput, "the transform of " + instance_label(instances[i]) + " is not finite");
}

bool within_traced_space(const DAffine& unit_from_surface, DVec3 lo, DVec3 hi) {
  const DVec3 centre = transform_point(unit_from_surface, (lo + hi) * 0.5), half = (hi - lo) * 0.5;
  const DVec3 reach = glm::abs(centre) + glm::abs(unit_from_surface[0]) * half.x +
                      glm::abs(unit_from_surface[1]) * half.y + glm::abs(unit_from_surface[2]) * half.z;
  constexpr double kFarthest = 2.0 * UnitSpace::kHalfSize;
  return reach.x <= kFarthest && reach.y <= kFarthest && reach.z <= kFarthest;
}

void throw_out_of_space(uint32_t instance) {
  throw Error(ErrorKind::kUsage,
              instance_label(instance) +
                  " would leave the bounds of the moving instances; make a tracer with larger bounds");
}

Bounds bounds_of_motion(const SceneSource& source, std::span<const Bounds> bounds, const Movers& movers) {
  Bounds world = placed_bounds(source, bounds);
  if (!movers.instances.empty() && !movers.world.empty()) world.extend(movers.world);
  return world;
}

} // namespace packtrace
