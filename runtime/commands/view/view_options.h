#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "runtime/commands/render/render_options.h"

namespace packtrace {

/// A window's frames while something moves, unless --target-ms says otherwise: 30 per second.
inline constexpr double kWindowTargetMs = 33.0;

/// The options of `view`.
struct ViewOptions {
  std::vector<std::string> files;
  RenderOptions render;              ///< those that `render` has too
  std::optional<double> target_ms;   ///< unless set, kWindowTargetMs for a window, else 0
  std::optional<std::string> script; ///< of --headless
  std::optional<uint32_t> profile;   ///< frames
  std::optional<std::string> csv;
  std::optional<std::string> settings; ///< TOML file
};

/// Adds all options of `view` to the verb. `options` must outlive it.
void add_viewer_options(CLI::App& verb, ViewOptions& options);

/// Throws Error(kUsage) for values out of range and options that contradict each other.
void validate(const ViewOptions& options);

} // namespace packtrace
