#include "runtime/view/window/settings_file.h"

#include <algorithm>
#include <array>
#include <functional>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"
#include "runtime/view/view_settings.h"

namespace packtrace {
namespace {

constexpr int64_t kVersion = 1;
constexpr std::array<std::string_view, 3> kSplits{"off", "divider", "difference"};
constexpr std::array<const char*, 2> kPaneTables{"first", "second"};

/// Applies a file's tables to a session.
class SettingsReader {
public:
  SettingsReader(const std::string& name, ViewSession& session) : name_(name), session_(session) {}

  void read(const toml::table& root) {
    const toml::node* const version = root.get("version");
    if (version == nullptr) fail(root.source(), "version is missing; this is no file of settings");
    if (version->value<int64_t>() != kVersion)
      fail(version->source(), fmt::format("only version {} can be read", kVersion));
    each(root, "",
         [&](std::string_view key, const toml::node& value) {
           if (key == "version") return true;
           if (key == "view")
             read_view(table(value, key));
           else if (key == kPaneTables[0])
             read_pane(0, table(value, key));
           else if (key == kPaneTables[1])
             read_pane(1, table(value, key));
           else
             return false;
           return true;
         },
         {"version", "view", kPaneTables[0], kPaneTables[1]});
  }

private:
  [[noreturn]] void fail(const toml::source_region& place, const std::string& problem) const {
    throw Error(ErrorKind::kInput, fmt::format("{}:{}:{}: {}", name_, place.begin.line, place.begin.column, problem));
  }

  /// Calls read(key, value) for each entry; unknown or invalid entries are reported with their position.
  void each(const toml::table& table, const std::string& prefix,
            const std::function<bool(std::string_view, const toml::node&)>& read,
            const std::vector<std::string_view>& known) const {
    for (const auto& [key, value] : table) {
      try {
        if (read(key.str(), value)) continue;
      } catch (const Error& error) {
        if (error.kind() != ErrorKind::kUsage) throw;
        fail(value.source(), prefix + std::string(key.str()) + ": " + error.what());
      }
      fail(key.source(),
           prefix + std::string(key.str()) + ": no such name" + did_you_mean_text(closest_name(key.str(), known)));
    }
  }

  const toml::table& table(const toml::node& value, std::string_view key) const {
    if (!value.is_table()) fail(value.source(), std::string(key) + ": must be a table");
    return *value.as_table();
  }
  std::string text(const toml::node& value) const {
    if (!value.is_string()) fail(value.source(), "must be a text");
    return value.as_string()->get();
  }
  double number(const toml::node& value) const {
    if (!value.is_number()) fail(value.source(), "must be a number");
    return *value.value<double>();
  }
  /// A value as the words of settings.
  std::string word(const toml::node& value) const {
    if (value.is_string()) return value.as_string()->get();
    if (value.is_boolean()) return *value.value<bool>() ? "on" : "off";
    return value.is_integer() ? std::to_string(*value.value<int64_t>()) : setting_text(number(value));
  }

  void read_view(const toml::table& view) {
    each(view, "view.",
         [&](std::string_view key, const toml::node& value) {
           if (key == "divider")
             session_.set_divider(number(value));
           else if (key == "gain")
             session_.set_gain(number(value));
           else if (key == "target_ms")
             session_.set_target_ms(number(value));
           else if (key == "camera")
             session_.move_camera(
                 [&](ViewCamera& camera) { camera.set(parse_camera_key(text(value), camera.current_key())); });
           else if (key == "split") {
             const auto found = std::ranges::find(kSplits, text(value));
             if (found == kSplits.end()) fail(value.source(), "view.split: must be off, divider or difference");
             session_.set_split(static_cast<SplitMode>(found - kSplits.begin()));
           } else
             return false;
           return true;
         },
         {"divider", "gain", "target_ms", "camera", "split"});
  }

  void read_pane(size_t pane, const toml::table& entries) {
    const std::string prefix = std::string(kPaneTables[pane]) + ".";
    each(entries, prefix,
         [&](std::string_view key, const toml::node& value) {
           if (key == "view")
             session_.set_layer(pane, text(value));
           else
             session_.set_setting(pane, key, word(value));
           return true;
         },
         {});
  }

  const std::string& name_;
  ViewSession& session_;
};

} // namespace

std::string settings_toml(const ViewSession& session) {
  std::string text = fmt::format("# packtrace view --settings FILE\nversion = {}\n\n[view]\nsplit = \"{}\"\n"
                                 "divider = {}\ngain = {}\ntarget_ms = {}\n",
                                 kVersion, kSplits[static_cast<size_t>(session.split())], session.divider(),
                                 session.gain(), session.target_ms());
  if (session.camera().key()) text += fmt::format("camera = \"{}\"\n", camera_key_text(*session.camera().key()));
  for (size_t pane = 0; pane < kPaneTables.size(); ++pane) {
    text += fmt::format("\n[{}]\nview = \"{}\"\n", kPaneTables[pane], session.pane(pane).layer);
    for (const ViewSetting& s : view_settings(session.pane(pane).config)) {
      if (s.value == s.default_value) continue;
      const bool quoted = !s.words.empty();
      text += fmt::format("\"{}\" = {}\n", s.name,
                          s.is_switch ? (s.value == "on" ? "true" : "false")
                          : quoted    ? "\"" + s.value + "\""
                                      : s.value);
    }
  }
  return text;
}

void apply_settings_toml(std::string_view text, const std::string& name, ViewSession& session) {
  toml::table root;
  try {
    root = toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw Error(ErrorKind::kInput, fmt::format("{}:{}:{}: {}", name, error.source().begin.line,
                                               error.source().begin.column, error.description()));
  }
  SettingsReader(name, session).read(root);
}

} // namespace packtrace
