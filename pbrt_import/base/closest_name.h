#pragma once

#include <span>
#include <string>
#include <string_view>

namespace packtrace {

/// The candidate within two edits of name that needs fewest; empty if none. Case differences count half an edit.
std::string_view closest_name(std::string_view name, std::span<const std::string_view> candidates);

/// The end of a message about an unknown name: "; did you mean SHOWN?", empty where shown is.
std::string did_you_mean_text(std::string_view shown);

} // namespace packtrace
