#pragma once

#include <string>
#include <string_view>

#include "runtime/view/view_session.h"

namespace packtrace {

/// The state of a view as TOML: views, split, settings that differ from their defaults, and the camera if it has moved.
std::string settings_toml(const ViewSession& session);

/// Restores a state. Throws Error(kInput), "NAME:LINE:COLUMN: problem", for text that is not TOML, for files of other
/// versions, for unknown names, with the closest one, and for values that are not possible; what came before stays
/// changed.
/// @param name of the file, for messages
void apply_settings_toml(std::string_view text, const std::string& name, ViewSession& session);

} // namespace packtrace
