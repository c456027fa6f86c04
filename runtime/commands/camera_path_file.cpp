#include "runtime/commands/camera_path_file.h"

#include <algorithm>
#include <fstream>
#include <initializer_list>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr uintmax_t kMaxPathFileBytes = uintmax_t{64} << 20;

std::string text_of(const std::filesystem::path& file) {
  std::error_code error;
  const uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) throw Error(ErrorKind::kInput, fmt::format("{}: {}", file.string(), error.message()));
  if (bytes > kMaxPathFileBytes)
    throw Error(ErrorKind::kInput, fmt::format("{}: a camera path has at most 64 MiB", file.string()));
  std::ifstream stream(file, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (!stream) throw Error(ErrorKind::kInput, file.string() + ": cannot be read");
  return text;
}

nlohmann::json parse_json(const std::string& text, const std::string& name) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const auto end = text.begin() + static_cast<ptrdiff_t>(std::min(error.byte > 0 ? error.byte - 1 : 0, text.size()));
    const auto line = 1 + std::count(text.begin(), end, '\n');
    const size_t start = std::string_view(text.data(), static_cast<size_t>(end - text.begin())).rfind('\n');
    const auto column = (end - text.begin()) - (start == std::string_view::npos ? -1 : static_cast<ptrdiff_t>(start));
    throw Error(ErrorKind::kInput, fmt::format("{}:{}:{}: not JSON", name, line, column));
  }
}

/// Reads one object of the file; messages name the place.
class KeyReader {
public:
  KeyReader(const nlohmann::json& object, std::string place) : object_(object), place_(std::move(place)) {
    if (!object.is_object()) fail("must be an object");
  }

  void allow(std::initializer_list<std::string_view> fields) const {
    for (const auto& [name, value] : object_.items())
      if (std::ranges::find(fields, name) == fields.end())
        throw Error(ErrorKind::kInput, fmt::format("{}: unknown field \"{}\"", place_, name));
  }
  double number(const char* name, const double* otherwise) const {
    if (!object_.contains(name) && otherwise != nullptr) return *otherwise;
    if (!object_.contains(name) || !object_.at(name).is_number()) fail(fmt::format("\"{}\" must be a number", name));
    return object_.at(name).get<double>();
  }
  DVec3 vector(const char* name, const DVec3* otherwise) const {
    if (!object_.contains(name) && otherwise != nullptr) return *otherwise;
    const auto value = object_.find(name);
    const bool good = value != object_.end() && value->is_array() && value->size() == 3 &&
                      std::ranges::all_of(*value, [](const nlohmann::json& x) { return x.is_number(); });
    if (!good) fail(fmt::format("\"{}\" must be an array of three numbers", name));
    return {(*value)[0].get<double>(), (*value)[1].get<double>(), (*value)[2].get<double>()};
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorKind::kInput, fmt::format("{}: {}", place_, what));
  }

private:
  const nlohmann::json& object_;
  std::string place_;
};

} // namespace

CameraPath read_camera_path(const std::filesystem::path& file, const Camera& base, DVec3 origin) {
  const std::string name = file.string();
  const nlohmann::json document = parse_json(text_of(file), name);
  const KeyReader top(document, name);
  top.allow({"keys"});
  const auto list = document.find("keys");
  if (list == document.end() || !list->is_array()) top.fail("\"keys\" must be an array of keys");
  std::vector<CameraKey> keys;
  const DVec3 up(glm::normalize(DVec3(base.world_from_camera[1])));
  for (size_t i = 0; i < list->size(); ++i) {
    const KeyReader reader((*list)[i], fmt::format("{}: key {}", name, i));
    reader.allow({"time", "position", "look", "up", "fov"});
    CameraKey key;
    key.time_s = reader.number("time", nullptr);
    key.position = reader.vector("position", nullptr) - origin;
    key.look = reader.vector("look", nullptr) - origin;
    key.up = reader.vector("up", &up);
    key.fov_degrees = reader.number("fov", &base.fov_degrees);
    keys.push_back(key);
  }
  try {
    return CameraPath(std::move(keys), base);
  } catch (const Error& error) {
    throw Error(ErrorKind::kInput, fmt::format("{}: {}", name, error.what()));
  }
}

} // namespace packtrace
