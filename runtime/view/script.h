#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "runtime/view/view_controls.h"
#include "runtime/view/view_session.h"

namespace packtrace {

/// A line of a script: one action, with its parameters.
struct ScriptLine {
  uint32_t number = 0; ///< from 1
  std::string action;  ///< the name of a ScriptAction
  nlohmann::json fields;
};

/// An action of scripts, for help and messages.
struct ScriptAction {
  std::string_view name;
  std::string_view others; ///< other fields that the line may have, separated by spaces
  std::string_view help;
};
std::span<const ScriptAction> script_actions();

/// Reads a script: a JSON object per line, with the name of one action among its fields. Empty lines and lines that
/// begin with # are skipped. Throws Error(kInput), "NAME:LINE: problem", for text that is not JSON, and for unknown or
/// missing actions and fields, with the closest name.
/// @param name of the file, for messages
std::vector<ScriptLine> parse_script(std::string_view text, const std::string& name);

/// Throws Error(kInput), "NAME:LINE: problem".
[[noreturn]] void fail_in_script(const std::string& name, uint32_t line, const std::string& problem);

/// Callbacks of a script into the program that runs it.
class ScriptHost {
public:
  virtual ~ScriptHost() = default;
  /// Writes image files of a pane.
  /// @param files names ending in .png or .exr
  virtual void save_pane(ViewSession& session, size_t pane, const std::vector<std::string>& files) = 0;
  /// Writes the picture on the screen as a .png file.
  virtual void save_screen(ViewSession& session, const std::string& file) = 0;
  /// Writes a text file.
  virtual void save_text(const std::string& file, const std::string& text) = 0;
  /// Reports a result, such as a pick.
  virtual void report(const nlohmann::json& result) = 0;
};

/// Runs a script. Time advances by 1/60 s per frame regardless of the frame's duration, so results depend on the script
/// alone, except for profiles and views with a target time per frame.
/// @param name of the file, for messages
/// Throws Error(kInput), "NAME:LINE: FIELD: problem", for values that are wrong or not possible; what
/// ViewSession::step() and the host throw.
void run_script(const std::vector<ScriptLine>& script, const std::string& name, ViewSession& session,
                ViewControls& controls, ScriptHost& host, Progress& progress);

/// A pick as JSON.
nlohmann::json pick_json(const Pick& pick);

} // namespace packtrace
