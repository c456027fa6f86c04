#pragma once

#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/view/script.h"

namespace packtrace {

/// Writes what a view saves. Pictures of a pane are those that `render` writes.
class ViewOutputs : public ScriptHost {
public:
  explicit ViewOutputs(const GlobalOptions& globals) : globals_(globals) {}

  void save_pane(ViewSession& session, size_t pane, const std::vector<std::string>& files) override;
  void save_screen(ViewSession& session, const std::string& file) override;
  void save_text(const std::string& file, const std::string& text) override;
  /// Prints the result as a line of JSON, unless quiet, and keeps it. May be called from any thread.
  void report(const nlohmann::json& result) override;

  const nlohmann::json& results() const { return results_; }

private:
  const GlobalOptions& globals_;
  std::mutex mutex_; ///< of the output and results_
  nlohmann::json results_ = nlohmann::json::array();
};

/// The words as a command line, quoted for a shell.
std::string command_text(const std::vector<std::string>& words);

} // namespace packtrace
