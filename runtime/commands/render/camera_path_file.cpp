#include "runtime/commands/render/camera_path_file.h"

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/motion/json_tree.h"
#include "runtime/motion/motion_track_reader.h"

namespace packtrace {
namespace {

/// Reads the keys of a camera path.
class CameraKeyReader {
public:
  CameraKeyReader(const JsonTree& json, const Camera& base, DVec3 origin)
      : json_(json), origin_(origin), up_(glm::normalize(DVec3(base.world_from_camera[1]))),
        fov_degrees_(base.fov_degrees) {}

  CameraKey read(const JsonValue& value) const {
    static constexpr std::array<std::string_view, 5> kFields{"time", "position", "look", "up", "fov"};
    if (value.type != JsonValue::Type::kObject) json_.fail(value, "a key must be an object");
    require_known_fields(json_, value, kFields);
    CameraKey key;
    key.time_s = number(value, "time", nullptr);
    key.position = vector(value, "position", nullptr) - origin_;
    key.look = vector(value, "look", nullptr) - origin_;
    key.up = vector(value, "up", &up_);
    key.fov_degrees = number(value, "fov", &fov_degrees_);
    return key;
  }

private:
  const JsonValue& required(const JsonValue& key, const char* name) const {
    const JsonValue* const field = find_field(json_, key, name);
    if (field == nullptr) json_.fail(key, fmt::format("\"{}\" is missing", name));
    return *field;
  }
  double number(const JsonValue& key, const char* name, const double* otherwise) const {
    if (otherwise != nullptr && find_field(json_, key, name) == nullptr) return *otherwise;
    const JsonValue& field = required(key, name);
    if (field.type != JsonValue::Type::kNumber) json_.fail(field, fmt::format("\"{}\" must be a number", name));
    return field.number;
  }
  DVec3 vector(const JsonValue& key, const char* name, const DVec3* otherwise) const {
    if (otherwise != nullptr && find_field(json_, key, name) == nullptr) return *otherwise;
    return read_vector(json_, required(key, name), name);
  }

  const JsonTree& json_;
  DVec3 origin_, up_;
  double fov_degrees_;
};

} // namespace

CameraPath read_camera_path(const std::filesystem::path& file, const Camera& base, DVec3 origin,
                            const MemoryBudget& budget) {
  static constexpr std::array<std::string_view, 1> kTopFields{"keys"};
  const JsonTree json(file, budget);
  if (json.root().type != JsonValue::Type::kObject)
    json.fail(json.root(), "a camera path must be an object with \"keys\"");
  require_known_fields(json, json.root(), kTopFields);
  const JsonValue* const list = find_field(json, json.root(), "keys");
  if (list == nullptr || list->type != JsonValue::Type::kArray)
    json.fail(list != nullptr ? *list : json.root(), "\"keys\" must be an array of keys");
  const CameraKeyReader reader(json, base, origin);
  std::vector<CameraKey> keys;
  json.for_each(*list, [&](const JsonValue& value) {
    keys.push_back(reader.read(value));
    if (const std::string problem = camera_key_problem(keys, keys.size() - 1); !problem.empty())
      json.fail(value, problem);
  });
  if (keys.size() < 2) json.fail(*list, "a camera path needs at least two keys");
  return CameraPath(std::move(keys), base);
}

} // namespace packtrace
