#include "runtime/motion/motion_keys.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "pbrt_import/base/closest_name.h"
#include "runtime/motion/motion_track_reader.h"

namespace packtrace {
namespace {

constexpr std::array<std::string_view, 1> kRootFields{"instances"};
constexpr std::array<std::string_view, 5> kInstanceFields{"name", "interpolation", "loop", "pivot", "keys"};

class KeysReader {
public:
  KeysReader(const std::filesystem::path& file, const MotionTargets& targets, const MemoryBudget& budget)
      : json_(file, budget), targets_(targets), given_(targets.instances.size(), nullptr) {
    for (uint32_t i = 0; i < targets.instances.size(); ++i) by_name_[targets.instances[i].name].push_back(i);
  }

  RigidMotion run() {
    const JsonValue& root = json_.root();
    if (root.type != JsonValue::Type::kObject) json_.fail(root, "not an object with \"instances\"");
    require_known_fields(json_, root, kRootFields);
    const JsonValue* const instances = find_field(json_, root, "instances");
    if (instances == nullptr) json_.fail(root, "\"instances\" is missing");
    if (instances->type != JsonValue::Type::kArray) json_.fail(*instances, "instances must be an array of objects");
    json_.for_each(*instances, [&](const JsonValue& instance) { add(instance); });
    if (motion_.instances.empty()) json_.fail(*instances, "no instances");
    std::sort(motion_.instances.begin(), motion_.instances.end(),
              [](const InstanceMotion& a, const InstanceMotion& b) { return a.instance < b.instance; });
    return std::move(motion_);
  }

private:
  void add(const JsonValue& value) {
    if (value.type != JsonValue::Type::kObject) json_.fail(value, "an instance must be an object");
    require_known_fields(json_, value, kInstanceFields);
    const JsonValue* const name = find_field(json_, value, "name");
    if (name == nullptr) json_.fail(value, "an instance without \"name\"");
    if (name->type != JsonValue::Type::kString) json_.fail(*name, "name must be a string");
    const std::vector<uint32_t> named = find(*name);
    std::optional<Vec3> pivot;
    if (const JsonValue* given = find_field(json_, value, "pivot"))
      pivot = Vec3(read_vector(json_, *given, "pivot") - targets_.origin);
    const auto track = static_cast<uint32_t>(motion_.tracks.size());
    motion_.tracks.push_back(read_track(json_, value));
    for (const uint32_t instance : named) {
      if (given_[instance] != nullptr)
        json_.fail(*name, "instance " + std::to_string(instance) + " has keys already, in line " +
                              std::to_string(given_[instance]->line));
      given_[instance] = name;
      InstanceMotion moving;
      moving.instance = instance, moving.track = track, moving.relative = true;
      moving.pivot = pivot.value_or(default_pivot(targets_.instances[instance]));
      motion_.instances.push_back(moving);
    }
  }

  /// The instances that a name addresses. Throws if there are none, or if one cannot move.
  std::vector<uint32_t> find(const JsonValue& value) const {
    const std::string& name = json_.text(value.text);
    std::vector<uint32_t> found;
    if (const auto all = by_name_.find(name); all != by_name_.end())
      found = all->second;
    else if (const size_t mark = name.rfind('#'); mark != std::string::npos)
      found = find_numbered(value, name.substr(0, mark), std::string_view(name).substr(mark + 1));
    if (found.empty()) fail_unknown(value, name);
    for (const uint32_t instance : found)
      if (targets_.instances[instance].fixed)
        json_.fail(value, "\"" + name + "\" is part of the world's geometry, which cannot move; give its keys to bake");
    return found;
  }

  std::vector<uint32_t> find_numbered(const JsonValue& value, const std::string& name, std::string_view digits) const {
    const auto all = by_name_.find(name);
    size_t number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (all == by_name_.end() || error != std::errc() || end != digits.data() + digits.size()) return {};
    if (number >= all->second.size())
      json_.fail(value, "there is no instance " + std::to_string(number) + " of \"" + name + "\": it has " +
                            std::to_string(all->second.size()) + ", numbered from 0");
    return {all->second[number]};
  }

  [[noreturn]] void fail_unknown(const JsonValue& value, const std::string& name) const {
    std::vector<std::string_view> names;
    for (const auto& [one, instances] : by_name_) names.push_back(one);
    const size_t mark = name.rfind('#');
    std::string_view closest = closest_name(name, names);
    if (closest.empty() && mark != std::string::npos) closest = closest_name(name.substr(0, mark), names);
    std::string problem = "no instance has the name \"";
    problem.append(name).append("\"");
    std::string shown;
    if (!closest.empty()) shown.append("\"").append(closest).append("\"");
    json_.fail(value, problem.append(did_you_mean_text(shown)));
  }

  JsonTree json_;
  const MotionTargets& targets_;
  std::map<std::string, std::vector<uint32_t>, std::less<>> by_name_;
  std::vector<const JsonValue*> given_; // by instance: where it was named
  RigidMotion motion_;
};

} // namespace

RigidMotion read_motion_keys(const std::filesystem::path& file, const MotionTargets& targets,
                             const MemoryBudget& budget) {
  return KeysReader(file, targets, budget).run();
}

} // namespace packtrace
