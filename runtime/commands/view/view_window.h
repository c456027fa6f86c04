#pragma once

#include <functional>
#include <memory>
#include <string>

#include "pbrt_import/base/progress.h"
#include "runtime/commands/view/view_options.h"
#include "runtime/commands/view/view_outputs.h"
#include "runtime/view/view_session.h"

namespace packtrace {

/// Opens a window, makes a session meanwhile, and shows it until the window is closed. Files that change on disk are
/// read again; what is saved goes to the working folder. Throws what load() throws, and Error(kUnsupported) without a
/// display or OpenGL 3.3, and if the program was built without windows (docs/viewer.md).
/// @param size of the picture in the window
/// @param load makes the session, in another thread; reports its progress to the observer
void show_in_window(ImageSize size,
                    const std::function<std::unique_ptr<ViewSession>(const Progress::Observer& observer)>& load,
                    const ViewOptions& options, const GlobalOptions& globals, ViewOutputs& outputs);

/// Restores what the window saved as .toml. Throws Error(kInput) as apply_settings_toml() does, and Error(kUnsupported)
/// if the program was built without windows.
void restore_settings(const std::string& file, ViewSession& session);

} // namespace packtrace
