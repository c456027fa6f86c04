#include "runtime/motion/motion_track_reader.h"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "pbrt_import/base/closest_name.h"

namespace packtrace {
namespace {

using Type = JsonValue::Type;

constexpr double kMaxNumber = 1e30; // so that products of maps are floats
constexpr std::array<std::string_view, 4> kKeyFields{"time", "translate", "rotate", "scale"};
constexpr std::array<std::string_view, 3> kRotationFields{"axis", "degrees", "quaternion"};

double read_number(const JsonTree& json, const JsonValue& value, const char* what) {
  if (value.type != Type::kNumber) json.fail(value, std::string(what) + " must be a number");
  if (!(std::abs(value.number) <= kMaxNumber)) json.fail(value, std::string(what) + " must be within +-1e30");
  return value.number;
}

template <size_t kCount>
std::optional<std::array<double, kCount>> read_array(const JsonTree& json, const JsonValue& value, const char* what) {
  std::array<double, kCount> numbers{};
  size_t count = 0;
  if (value.type != Type::kArray) return std::nullopt;
  json.for_each(value, [&](const JsonValue& element) {
    if (count < kCount) numbers[count] = read_number(json, element, what);
    ++count;
  });
  if (count != kCount) return std::nullopt;
  return numbers;
}

/// A rotation as the file gives it. Turns about an axis may exceed half a circle, which quaternions cannot represent.
struct GivenRotation {
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  std::optional<DVec3> axis;
  double degrees = 0.0;
};

GivenRotation read_quaternion(const JsonTree& json, const JsonValue& value) {
  const auto q = read_array<4>(json, value, "a part of the quaternion");
  if (!q) json.fail(value, "quaternion must be [x, y, z, w]");
  const glm::dquat rotation((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
  if (!(glm::length(rotation) > 1e-12)) json.fail(value, "the quaternion has length zero");
  return {glm::normalize(rotation), std::nullopt, 0.0};
}

GivenRotation read_rotation(const JsonTree& json, const JsonValue& value) {
  constexpr const char* kForms =
      "rotate must be {\"axis\": [x, y, z], \"degrees\": d} or {\"quaternion\": [x, y, z, w]}";
  if (value.type != Type::kObject) json.fail(value, kForms);
  require_known_fields(json, value, kRotationFields);
  const JsonValue *axis = find_field(json, value, "axis"), *degrees = find_field(json, value, "degrees"),
                  *quaternion = find_field(json, value, "quaternion");
  if ((quaternion != nullptr) == (axis != nullptr) || (axis != nullptr) != (degrees != nullptr))
    json.fail(value, kForms);
  if (quaternion != nullptr) return read_quaternion(json, *quaternion);
  const DVec3 direction = read_vector(json, *axis, "axis");
  if (!(glm::length(direction) > 1e-12)) json.fail(*axis, "the axis has length zero");
  GivenRotation given;
  given.axis = glm::normalize(direction), given.degrees = read_number(json, *degrees, "degrees");
  const double half = std::fmod(given.degrees, 720.0) * std::numbers::pi / 360.0;
  given.rotation = glm::dquat(std::cos(half), *given.axis * std::sin(half));
  return given;
}

/// Rejects turns of half a circle and more about one axis, because interpolation would turn the other way.
void require_short_turn(const JsonTree& json, const JsonValue& value, const GivenRotation& before,
                        const GivenRotation& now) {
  const std::optional<DVec3> axis = now.axis ? now.axis : before.axis;
  if (!axis || (before.axis && now.axis && glm::distance(*before.axis, *now.axis) > 1e-9)) return;
  if ((!before.axis && before.rotation != glm::dquat(1.0, 0.0, 0.0, 0.0)) ||
      (!now.axis && now.rotation != glm::dquat(1.0, 0.0, 0.0, 0.0)))
    return; // one of them is a quaternion
  const double turn = std::abs(now.degrees - before.degrees);
  if (turn >= 180.0)
    json.fail(value,
              fmt::format("a turn by {:g} degrees since the key before; turns between keys take the shorter way, "
                          "so add keys less than 180 degrees apart",
                          turn));
}

DVec3 read_scale(const JsonTree& json, const JsonValue& value) {
  DVec3 scale(0.0);
  if (value.type == Type::kNumber) {
    scale = DVec3(read_number(json, value, "scale"));
  } else {
    const auto factors = read_array<3>(json, value, "scale");
    if (!factors) json.fail(value, "scale must be a number or [x, y, z]");
    scale = {(*factors)[0], (*factors)[1], (*factors)[2]};
  }
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(scale[axis]) >= 1e-12)) json.fail(value, "a scale of zero has no inverse");
  return scale;
}

/// Reads keys in order; each is checked against the one before.
class KeyReader {
public:
  explicit KeyReader(const JsonTree& json) : json_(json) {}

  void add(const JsonValue& value) {
    if (value.type != Type::kObject) json_.fail(value, "a key must be an object");
    require_known_fields(json_, value, kKeyFields);
    MotionKey key;
    const JsonValue* const time = find_field(json_, value, "time");
    if (time == nullptr) json_.fail(value, "a key without \"time\"");
    key.time_s = read_number(json_, *time, "time");
    if (!keys_.empty() && !(key.time_s > keys_.back().time_s))
      json_.fail(*time, fmt::format("time {:g} is not after the time of the key before, {:g}", key.time_s,
                                    keys_.back().time_s));
    if (const JsonValue* translate = find_field(json_, value, "translate"))
      key.translation = read_vector(json_, *translate, "translate");
    read_rotation_of(value, key);
    read_scale_of(value, key);
    keys_.push_back(key);
  }

  std::vector<MotionKey> take() { return std::move(keys_); }

private:
  void read_rotation_of(const JsonValue& value, MotionKey& key) {
    const JsonValue* const rotate = find_field(json_, value, "rotate");
    const GivenRotation given = rotate != nullptr ? read_rotation(json_, *rotate) : GivenRotation{};
    if (!keys_.empty()) require_short_turn(json_, rotate != nullptr ? *rotate : value, before_, given);
    before_ = given;
    key.rotation = given.rotation;
    if (!keys_.empty() && glm::dot(key.rotation, keys_.back().rotation) < 0.0) key.rotation = -key.rotation;
  }

  void read_scale_of(const JsonValue& value, MotionKey& key) const {
    const JsonValue* const scale = find_field(json_, value, "scale");
    const DVec3 factors = scale != nullptr ? read_scale(json_, *scale) : DVec3(1.0);
    for (int axis = 0; axis < 3; ++axis) {
      key.scale[axis][axis] = factors[axis];
      if (!keys_.empty() && (factors[axis] < 0.0) != (keys_.back().scale[axis][axis] < 0.0))
        json_.fail(scale != nullptr ? *scale : value, "the scale changes its sign, so it passes through zero");
    }
  }

  const JsonTree& json_;
  GivenRotation before_;
  std::vector<MotionKey> keys_;
};

} // namespace

void require_known_fields(const JsonTree& json, const JsonValue& object, std::span<const std::string_view> known) {
  json.for_each(object, [&](const JsonValue& member) {
    const std::string& name = json.text(member.name);
    for (const std::string_view one : known)
      if (name == one) return;
    std::string problem = "unknown field \"";
    problem.append(name).append("\"").append(did_you_mean_text(closest_name(name, known)));
    json.fail(member, problem);
  });
}

const JsonValue* find_field(const JsonTree& json, const JsonValue& object, std::string_view name) {
  const JsonValue* found = nullptr;
  json.for_each(object, [&](const JsonValue& member) {
    if (json.text(member.name) == name) found = &member;
  });
  return found;
}

DVec3 read_vector(const JsonTree& json, const JsonValue& value, const char* what) {
  const auto numbers = read_array<3>(json, value, what);
  if (!numbers) json.fail(value, std::string(what) + " must be [x, y, z]");
  return {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

MotionTrack read_track(const JsonTree& json, const JsonValue& instance) {
  MotionTrack track;
  if (const JsonValue* value = find_field(json, instance, "interpolation")) {
    const std::string_view name = value->type == Type::kString ? std::string_view(json.text(value->text)) : "";
    if (name != "linear" && name != "catmull-rom")
      json.fail(*value, "interpolation must be \"linear\" or \"catmull-rom\"");
    if (name == "catmull-rom") track.interpolation = KeyInterpolation::kCatmullRom;
  }
  const JsonValue* const loop = find_field(json, instance, "loop");
  if (loop != nullptr && loop->type != Type::kBool) json.fail(*loop, "loop must be true or false");
  const JsonValue* const keys = find_field(json, instance, "keys");
  if (keys == nullptr) json.fail(instance, "an instance without \"keys\"");
  if (keys->type != Type::kArray) json.fail(*keys, "keys must be an array of objects");
  KeyReader reader(json);
  json.for_each(*keys, [&](const JsonValue& key) { reader.add(key); });
  track.keys = reader.take();
  if (track.keys.empty()) json.fail(*keys, "no keys");
  track.loop = loop != nullptr && loop->flag;
  if (track.loop && track.keys.size() < 2) json.fail(*loop, "a loop needs at least two keys");
  if (track.keys.size() < 2) track.interpolation = KeyInterpolation::kLinear;
  return track;
}

} // namespace packtrace
