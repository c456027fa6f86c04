#include "pbrt_import/base/setting.h"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

[[noreturn]] void fail(std::string_view owner, const std::string& message) {
  throw Error(ErrorKind::kUsage, std::string(owner) + ": " + message);
}

} // namespace

void check_setting(const SettingInfo& info, bool whole, double value, std::string_view owner) {
  const auto refuse = [&](const std::string& why) {
    fail(owner, std::string(info.name) + " is " + setting_text(value) + ", not " + why);
  };
  if (!(value >= info.low && value <= info.high)) // true for NaN
    refuse("in [" + setting_text(info.low) + ".." + setting_text(info.high) + "]");
  if (!whole) return;
  if (value != std::floor(value)) refuse("a whole number");
  const auto number = static_cast<uint64_t>(value);
  if (info.rule == SettingRule::kOdd && number % 2 == 0) refuse("odd");
  if (info.rule == SettingRule::kPowerOfTwo && !std::has_single_bit(number)) refuse("a power of two");
}

std::string setting_range(const SettingInfo& info) {
  const std::string range = setting_text(info.low) + " to " + setting_text(info.high);
  switch (info.rule) {
  case SettingRule::kOdd:
    return range + ", odd";
  case SettingRule::kPowerOfTwo:
    return range + ", a power of two";
  case SettingRule::kAny:
    break;
  }
  return range;
}

std::string setting_text(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return std::to_string(static_cast<int64_t>(value));
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), static_cast<float>(value)).ptr;
  return {text.data(), end};
}

std::pair<std::string_view, double> parse_assignment(std::string_view text, std::string_view owner) {
  const size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0)
    fail(owner, "'" + std::string(text) + "' is not of the form NAME=VALUE");
  const std::string_view name = text.substr(0, equals), word = text.substr(equals + 1);
  if (word == "on" || word == "off") return {name, word == "on" ? 1.0 : 0.0};
  float value = 0.0f;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size())
    fail(owner, "the value of " + std::string(name) + " is '" + std::string(word) + "', not a number, on or off");
  return {name, static_cast<double>(value)};
}

size_t find_setting(std::string_view name, std::span<const std::string_view> names, std::string_view owner) {
  for (size_t i = 0; i < names.size(); ++i)
    if (names[i] == name) return i;
  std::string message = "no setting '" + std::string(name) + "'";
  if (const std::string_view closest = closest_name(name, names); !closest.empty())
    message.append("; did you mean ").append(closest).append("?");
  fail(owner, message);
}

} // namespace packtrace
