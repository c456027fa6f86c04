#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>

namespace packtrace {

/// Reads a text of decimal digits alone; none for any other text and for numbers of more than 32 bits.
inline std::optional<uint32_t> whole_number(std::string_view text) {
  uint32_t value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  return error == std::errc() && end == last ? std::optional(value) : std::nullopt;
}

} // namespace packtrace
