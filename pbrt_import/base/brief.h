#pragma once

#include <array>
#include <charconv>
#include <string>
#include <system_error>

namespace packtrace {

/// Short decimal form of a number for messages: three significant digits. std::to_string would show 1e-9 as 0.
inline std::string brief(double value) {
  std::array<char, 32> text{};
  const auto [end, code] = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 3);
  return code == std::errc{} ? std::string(text.data(), end) : "?";
}

} // namespace packtrace
