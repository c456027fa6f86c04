#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "runtime/view/frame_thread.h"
#include "runtime/view/window/window.h"

namespace packtrace {

/// Draws the window before the first frame.
/// @param loading FrameThread::loading()
void draw_loading(const std::string& file, const std::pair<std::string, double>& loading);

/// Draws the arrows of the picked instance over the picture.
/// @param held the arrow that is being dragged
void draw_gizmo(const Gizmo& gizmo, std::optional<size_t> held);

/// The panels over the picture: views and settings, times, pick, help.
class Panels {
public:
  bool shown = true, help = false;
  InputLatency latency;
  bool any() const { return shown || help; }

  /// Adds the times of a new frame.
  void add_frame(const ViewSnapshot& snapshot);
  /// Draws all panels that are shown. Changes are posted to the frame thread.
  void draw(const ViewSnapshot& snapshot, FrameThread& frames, const WindowActions& actions);

  /// Frames per second, from the median of the last frames.
  double fps() const;

private:
  void draw_views(const ViewSnapshot& snapshot, FrameThread& frames, const WindowActions& actions);
  void draw_times(const ViewSnapshot& snapshot) const;

  std::vector<float> ms_; ///< of the last frames, the newest last
  size_t settings_pane_ = 0;
};

} // namespace packtrace
