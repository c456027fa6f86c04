#include "runtime/commands/bake/level_chain_file.h"

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "compress/format/deformation/deformation_format.h"
#include "pbrt_import/base/closest_name.h"
#include "runtime/motion/json_tree.h"
#include "runtime/motion/motion_track_reader.h"

namespace packtrace {
namespace {

class LevelChainReader {
public:
  LevelChainReader(const std::filesystem::path& file, const Scene& scene, const MemoryBudget& budget)
      : json_(file, budget), used_(scene.objects.size(), nullptr) {
    for (uint32_t i = 0; i < scene.objects.size(); ++i) by_name_.try_emplace(scene.objects[i].name, i);
  }

  std::vector<LevelChain> run() {
    static constexpr std::array<std::string_view, 1> kFields{"chains"};
    if (json_.root().type != JsonValue::Type::kObject) json_.fail(json_.root(), "not an object with \"chains\"");
    require_known_fields(json_, json_.root(), kFields);
    std::vector<LevelChain> chains;
    json_.for_each(array_of(json_.root(), "chains"),
                   [&](const JsonValue& value) { chains.push_back(read_chain(value)); });
    if (chains.empty()) json_.fail(json_.root(), "no chains");
    return chains;
  }

private:
  const JsonValue& array_of(const JsonValue& object, const char* name) const {
    const JsonValue* const field = find_field(json_, object, name);
    if (field == nullptr) json_.fail(object, fmt::format("\"{}\" is missing", name));
    if (field->type != JsonValue::Type::kArray) json_.fail(*field, fmt::format("{} must be an array", name));
    return *field;
  }

  LevelChain read_chain(const JsonValue& value) {
    static constexpr std::array<std::string_view, 2> kFields{"objects", "distances"};
    if (value.type != JsonValue::Type::kObject) json_.fail(value, "a chain must be an object");
    require_known_fields(json_, value, kFields);
    LevelChain chain;
    const JsonValue &objects = array_of(value, "objects"), &distances = array_of(value, "distances");
    json_.for_each(objects, [&](const JsonValue& name) { chain.objects.push_back(find_object(name)); });
    json_.for_each(distances, [&](const JsonValue& distance) {
      const double nearer = chain.distances.empty() ? 0.0 : chain.distances.back();
      if (distance.type != JsonValue::Type::kNumber || !(distance.number > nearer) || !std::isfinite(distance.number))
        json_.fail(distance, "distances must be positive numbers that ascend");
      chain.distances.push_back(distance.number);
    });
    if (chain.objects.size() < 2 || chain.objects.size() > baked::kMaxChainLevels)
      json_.fail(objects,
                 fmt::format("a chain has 2 to {} objects, not {}", baked::kMaxChainLevels, chain.objects.size()));
    if (chain.distances.size() + 1 != chain.objects.size())
      json_.fail(distances, fmt::format("{} objects need {} distances, not {}", chain.objects.size(),
                                        chain.objects.size() - 1, chain.distances.size()));
    return chain;
  }

  uint32_t find_object(const JsonValue& value) {
    if (value.type != JsonValue::Type::kString) json_.fail(value, "objects must be names");
    const std::string& name = json_.text(value.text);
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) {
      std::vector<std::string_view> names;
      for (const auto& [one, number] : by_name_) names.push_back(one);
      const std::string_view closest = closest_name(name, names);
      json_.fail(value, fmt::format("no object has the name \"{}\"", name) +
                            did_you_mean_text(closest.empty() ? "" : fmt::format("\"{}\"", closest)));
    }
    const JsonValue*& used = used_[found->second];
    if (used != nullptr) json_.fail(value, fmt::format("object \"{}\" is given already, in line {}", name, used->line));
    used = &value;
    return found->second;
  }

  JsonTree json_;
  std::map<std::string, uint32_t, std::less<>> by_name_;
  std::vector<const JsonValue*> used_; // by object: where it was named
};

} // namespace

std::vector<LevelChain> read_level_chains(const std::filesystem::path& file, const Scene& scene,
                                          const MemoryBudget& budget) {
  return LevelChainReader(file, scene, budget).run();
}

} // namespace packtrace
