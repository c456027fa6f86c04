#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace packtrace {

/// Which values of a setting's range are allowed.
enum class SettingRule : uint8_t { kAny, kOdd, kPowerOfTwo };

/// Description of a setting for users.
struct SettingInfo {
  std::string_view name;    ///< of the field, and of the setting on the command line
  std::string_view help;    ///< one sentence without a full stop; units included
  double low = 0, high = 1; ///< range of allowed values, ends included; 0 and 1 for a switch
  SettingRule rule = SettingRule::kAny;
};

/// A number or switch of a configuration struct. A table of them is the only description of the struct's fields: ranges
/// are checked, help is written and values are assigned from it. The default is the field's value in Config{}.
template <typename Config>
struct Setting {
  SettingInfo info;
  std::variant<bool Config::*, uint32_t Config::*, float Config::*> field;

  double get(const Config& config) const {
    return std::visit([&](auto member) { return static_cast<double>(config.*member); }, field);
  }
  double default_value() const {
    static const Config defaults;
    return get(defaults);
  }
  bool is_switch() const { return field.index() == 0; }
  bool is_integer() const { return field.index() == 1; }
  bool is_real() const { return field.index() == 2; }
};

/// Throws Error(kUsage) if a value is outside the range, NaN, or against the rule.
/// @param whole only whole numbers are allowed
/// @param owner beginning of the message: whose setting it is, such as "denoiser"
void check_setting(const SettingInfo& info, bool whole, double value, std::string_view owner);

/// The allowed values in words: "3 to 9, odd".
std::string setting_range(const SettingInfo& info);

/// The number as text: whole numbers in digits, others as the shortest text that reads as this float: "256", "0.1".
std::string setting_text(double value);

/// Splits "NAME=VALUE". The value is a number; on and off mean 1 and 0. Throws Error(kUsage) for other texts.
std::pair<std::string_view, double> parse_assignment(std::string_view text, std::string_view owner);

/// Index of a name. Throws Error(kUsage) with the closest one if there is none.
size_t find_setting(std::string_view name, std::span<const std::string_view> names, std::string_view owner);

/// Checks all fields of a configuration. Throws Error(kUsage) naming the first that is out of range.
template <typename Config>
void check_settings(std::span<const Setting<Config>> settings, const Config& config, std::string_view owner) {
  for (const Setting<Config>& setting : settings)
    check_setting(setting.info, !setting.is_real(), setting.get(config), owner);
}

/// Assigns "NAME=VALUE". Throws Error(kUsage) for unknown names and values that are not allowed.
template <typename Config>
void assign_setting(std::span<const Setting<Config>> settings, std::string_view assignment, Config& config,
                    std::string_view owner) {
  const auto [name, value] = parse_assignment(assignment, owner);
  std::vector<std::string_view> names;
  for (const Setting<Config>& setting : settings) names.push_back(setting.info.name);
  const Setting<Config>& setting = settings[find_setting(name, names, owner)];
  check_setting(setting.info, !setting.is_real(), value, owner);
  std::visit([&](auto member) { config.*member = static_cast<std::decay_t<decltype(config.*member)>>(value); },
             setting.field);
}

} // namespace packtrace
