#pragma once

#include <functional>
#include <string>

#include "runtime/view/frame_thread.h"
#include "runtime/view/input_latency.h"

namespace packtrace {

/// Callbacks of a window into the program. They run in the frame thread.
struct WindowActions {
  FrameThread::Task screenshot, record, profile, save_settings;
  /// A click. Runs in the frame thread, too.
  std::function<void(ViewSession& session, size_t pane, const Pick& pick)> picked;
  std::function<void(const std::string& file)> dropped; ///< a file was dropped on the window
};

/// A window for the frames of a FrameThread, with keys, mouse and panels. One per process, from the main thread.
class ViewerWindow {
public:
  /// Opens the window. Throws Error(kUnsupported) without a display or OpenGL 3.3, saying what to do.
  /// @param device words for the title: the instruction set
  /// @param file the name to show until there is a frame
  ViewerWindow(ImageSize size, std::string device, const std::string& file);
  ~ViewerWindow();
  ViewerWindow(const ViewerWindow&) = delete;
  ViewerWindow& operator=(const ViewerWindow&) = delete;

  /// Shows frames until the window is closed. Rethrows what ended the frame thread.
  void run(FrameThread& frames, const WindowActions& actions);

  /// The times from movements to their pictures on the screen.
  const InputLatency& latency() const;

  struct State; ///< of window_state.h

private:
  std::unique_ptr<State> state_;
};

} // namespace packtrace
