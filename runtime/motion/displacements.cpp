#include "runtime/motion/displacements.h"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace packtrace {
namespace {

/// The name that addresses one instance in a file of keys: NAME, or NAME#K if it is not unique.
std::string key_name(const MotionTargets& targets, uint32_t instance) {
  const std::string& name = targets.instances[instance].name;
  const auto begin = targets.instances.begin();
  const auto before = std::count_if(begin, begin + instance, [&](const MotionTarget& t) { return t.name == name; });
  const auto after = std::count_if(begin + instance + 1, targets.instances.end(),
                                   [&](const MotionTarget& t) { return t.name == name; });
  return before + after == 0 ? name : name + "#" + std::to_string(before);
}

} // namespace

RigidMotion displacement_motion(std::span<const Displacement> displacements, const MotionTargets& targets) {
  RigidMotion motion;
  for (const Displacement& displaced : displacements) {
    InstanceMotion moving;
    moving.instance = displaced.instance, moving.relative = true;
    moving.pivot = default_pivot(targets.instances[displaced.instance]);
    moving.track = static_cast<uint32_t>(motion.tracks.size());
    MotionKey key;
    key.translation = displaced.world;
    motion.tracks.push_back({KeyInterpolation::kLinear, false, {key}});
    motion.instances.push_back(moving);
  }
  return motion;
}

std::string displacement_keys(std::span<const Displacement> displacements, const MotionTargets& targets) {
  nlohmann::json instances = nlohmann::json::array();
  for (const Displacement& displaced : displacements) {
    const DVec3& by = displaced.world;
    instances.push_back({{"name", key_name(targets, displaced.instance)},
                         {"keys", {{{"time", 0}, {"translate", {by.x, by.y, by.z}}}}}});
  }
  return nlohmann::json{{"instances", instances}}.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

} // namespace packtrace
