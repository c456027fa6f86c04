#pragma once

#include <span>
#include <string>
#include <string_view>

namespace packtrace {

/// The candidate with the smallest edit distance to the name; empty if all need more than two edits, or more than a
/// third of the name's length. A difference in case counts half an edit and is allowed on top. Names of more than 64
/// characters have no candidate.
std::string_view closest_name(std::string_view name, std::span<const std::string_view> candidates);

/// Suffix of a message about an unknown name: "; did you mean SHOWN?", or empty if `shown` is empty.
std::string did_you_mean_text(std::string_view shown);

} // namespace packtrace
