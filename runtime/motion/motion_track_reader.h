#pragma once

#include <span>
#include <string_view>

#include "pbrt_import/scene/math.h"
#include "pbrt_import/scene/rigid_motion.h"
#include "runtime/motion/json_tree.h"

namespace packtrace {

/// Throws Error(kInput) for a member of an object whose name is not in the list.
void require_known_fields(const JsonTree& json, const JsonValue& object, std::span<const std::string_view> known);

/// Member of an object; null if there is none.
const JsonValue* find_field(const JsonTree& json, const JsonValue& object, std::string_view name);

/// Throws Error(kInput), "WHAT must be [x, y, z]", unless the value is an array of three numbers within +-1e30.
DVec3 read_vector(const JsonTree& json, const JsonValue& value, const char* what);

/// Reads "interpolation", "loop" and "keys" of an instance.
MotionTrack read_track(const JsonTree& json, const JsonValue& instance);

} // namespace packtrace
