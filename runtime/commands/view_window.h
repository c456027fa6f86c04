#pragma once

#include <memory>
#include <string>

#include "runtime/commands/view_options.h"
#include "runtime/commands/view_outputs.h"
#include "runtime/view/view_session.h"

namespace packtrace {

/// Shows a session in a window until it is closed. Files that change on disk are read again; what is saved goes to the
/// working folder. Throws Error(kUnsupported) without a display or OpenGL 3.3, and if the program was built without
/// windows (docs/viewer.md).
void show_in_window(std::unique_ptr<ViewSession> session, const ViewOptions& options, const GlobalOptions& globals,
                    ViewOutputs& outputs);

/// Restores what the window saved as .toml. Throws Error(kInput) as apply_settings_toml() does, and Error(kUnsupported)
/// if the program was built without windows.
void restore_settings(const std::string& file, ViewSession& session);

} // namespace packtrace
