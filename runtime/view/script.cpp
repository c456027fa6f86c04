#include "runtime/view/script.h"

#include <algorithm>

#include <fmt/format.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr ScriptAction kActions[] = {
    {"frames", "", "renders as many frames"},
    {"still", "", "renders frames until the still picture has as many"},
    {"key", "frames ctrl", "presses a key; with frames, holds it while as many are rendered"},
    {"drag", "button frames", "drags the mouse by [x, y] pixels with the left, middle or right button"},
    {"wheel", "", "turns the mouse wheel by as many steps"},
    {"camera", "", "moves the camera: \"start\", or {\"position\", \"look\", \"up\", \"fov\"}"},
    {"pivot", "", "sets the pivot to what pixel [x, y] shows"},
    {"select", "pane", "picks the object in pixel [x, y], to be moved"},
    {"move", "", "moves the picked object by [x, y, z] world units; null puts it back"},
    {"keys", "", "writes the keys of the moved objects as a file for render --keys"},
    {"time", "", "shows the scene at a time in seconds, or null for the scene at rest"},
    {"view", "pane", "shows a layer in a pane, 0 or 1"},
    {"set", "pane", "changes settings: {\"NAME\": value, ...}; without a pane, of both"},
    {"file", "pane", "shows a file, by its number from 0, in a pane"},
    {"split", "divider gain", "\"off\", \"divider\" or \"difference\""},
    {"size", "", "resizes the picture to [width, height]"},
    {"quality", "", "fixes the quality step of moving frames, 0 to 6; null: by the time they take"},
    {"target_ms", "", "milliseconds that a moving frame may take; 0: all the time it needs"},
    {"record", "", "begins to record the camera with true; ends it and writes a path file with its name"},
    {"screenshot", "pane", "writes a pane as .png or .exr, or several names: [\"a.png\", \"a.exr\"]"},
    {"screen", "", "writes the picture on the screen as .png"},
    {"pick", "pane", "reports what pixel [x, y] shows"},
    {"metrics", "", "reports RMSE, PSNR and FLIP of the two panes"},
    {"report", "", "reports the state: true"},
};

const ScriptAction* find_action(std::string_view name) {
  const auto found = std::ranges::find(script_actions(), name, &ScriptAction::name);
  return found != script_actions().end() ? &*found : nullptr;
}

bool is_field(std::string_view list, std::string_view name) {
  for (size_t begin = 0; begin <= list.size();) {
    const size_t end = std::min(list.find(' ', begin), list.size());
    if (list.substr(begin, end - begin) == name) return !name.empty();
    begin = end + 1;
  }
  return false;
}

/// All names that a field can have.
std::vector<std::string_view> field_names() {
  std::vector<std::string_view> names{"frames", "ctrl", "button", "pane", "divider", "gain"};
  for (const ScriptAction& action : script_actions()) names.push_back(action.name);
  return names;
}

/// Finds the action of a line and checks its fields. "frames" is an action only on its own.
std::string action_of(const nlohmann::json& line, const std::string& name, uint32_t number) {
  std::string action;
  for (const auto& [field, value] : line.items())
    if (find_action(field) != nullptr && (field != "frames" || line.size() == 1)) {
      if (!action.empty()) fail_in_script(name, number, action + " and " + field + ": a line has one action");
      action = field;
    }
  for (const auto& [field, value] : line.items()) {
    if (field == action) continue;
    const std::vector<std::string_view> known = field_names();
    if (std::ranges::find(known, std::string_view(field)) == known.end())
      fail_in_script(name, number, field + ": no such field" + did_you_mean_text(closest_name(field, known)));
    if (action.empty()) continue;
    if (!is_field(find_action(action)->others, field))
      fail_in_script(name, number, field + ": has no meaning with " + action);
  }
  if (action.empty()) {
    std::string list;
    for (const ScriptAction& known : script_actions()) list.append(list.empty() ? "" : ", ").append(known.name);
    fail_in_script(name, number, "no action; actions are " + list);
  }
  return action;
}

} // namespace

void fail_in_script(const std::string& name, uint32_t line, const std::string& problem) {
  throw Error(ErrorKind::kInput, fmt::format("{}:{}: {}", name, line, problem));
}

std::span<const ScriptAction> script_actions() { return kActions; }

std::vector<ScriptLine> parse_script(std::string_view text, const std::string& name) {
  std::vector<ScriptLine> script;
  uint32_t number = 0;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    ++number;
    const size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    ScriptLine parsed;
    parsed.number = number;
    try {
      parsed.fields = nlohmann::json::parse(line);
    } catch (const nlohmann::json::parse_error& error) {
      fail_in_script(name, number, fmt::format("column {}: not JSON", error.byte));
    } catch (const nlohmann::json::out_of_range&) {
      fail_in_script(name, number, "a number is too large");
    }
    if (!parsed.fields.is_object()) fail_in_script(name, number, "must be an object, such as {\"frames\": 8}");
    parsed.action = action_of(parsed.fields, name, number);
    script.push_back(std::move(parsed));
  }
  return script;
}

} // namespace packtrace
