#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "runtime/view/view_controls.h"
#include "runtime/view/view_session.h"
#include "runtime/view/view_settings.h"

namespace packtrace {

/// What a window shows: the picture of a frame, and what the session and its controls were then.
struct ViewSnapshot {
  uint64_t number = 0; ///< of the published frame, from 1
  ImageSize size;      ///< of the picture: smaller than the view while something moves
  std::vector<uint8_t> rgb;
  ViewFrame frame;
  double frame_ms = 0.0; ///< wall time of the frame with its picture
  std::vector<std::string> files;
  std::array<std::string, 2> layers;
  std::array<size_t, 2> pane_files{};
  std::array<std::vector<ViewSetting>, 2> settings;
  SplitMode split = SplitMode::kOff;
  double divider = 0.5, gain = 8.0, speed = 0.0, target_ms = 0.0;
  bool paused = false, plays = false, orbits = false, recording = false;
  std::optional<Pick> pick; ///< of the last set_pick()
  std::optional<DifferenceMetrics> metrics;
  std::string command; ///< of the first pane; empty while something moves
  std::string message; ///< the last one: what was saved, or why something failed
};

/// Renders the frames of a session in a thread of its own, so that a window can answer meanwhile. Everything that
/// changes the session runs in this thread between frames.
class FrameThread {
public:
  using Task = std::function<void(ViewSession& session, ViewControls& controls)>;

  /// @param command_text writes words as a command line
  FrameThread(std::unique_ptr<ViewSession> session,
              std::function<std::string(const std::vector<std::string>&)> command_text);
  /// Ends the frame within a tile, and the thread.
  ~FrameThread();
  FrameThread(const FrameThread&) = delete;
  FrameThread& operator=(const FrameThread&) = delete;

  /// What a task does to the frame that is being rendered.
  enum class Urgency : uint8_t {
    kAfterFrame, ///< waits for its end
    kMoves,      ///< ends it within a tile if it refines a still picture, which begins anew: for movements
    kNow,        ///< ends it within a tile
  };

  /// Runs a task before the next frame. What it throws as Error becomes the message.
  void post(Task task, Urgency urgency = Urgency::kAfterFrame);
  /// The pixel whose pick() the snapshots have; none: no pick.
  void set_pick(std::optional<std::array<uint32_t, 2>> pixel);
  /// Shows a message. May be called from any thread.
  void set_message(const std::string& message);

  /// The last frame that was published; null before the first.
  std::shared_ptr<const ViewSnapshot> snapshot() const;
  /// The error that ended the thread, or null.
  std::exception_ptr failure() const;

private:
  void run();
  bool run_tasks();
  void render();
  void render_frame();
  bool worth_showing() const;
  void publish(double step_ms);
  void wait_for_work();

  std::unique_ptr<ViewSession> session_;
  ViewControls controls_;
  std::function<std::string(const std::vector<std::string>&)> command_text_;
  mutable std::mutex mutex_; ///< of what follows, up to failure_
  std::condition_variable wake_;
  std::vector<Task> tasks_;
  std::optional<std::array<uint32_t, 2>> pick_;
  std::string message_;
  bool republish_ = false; ///< pick or message changed
  std::shared_ptr<const ViewSnapshot> snapshot_;
  std::exception_ptr failure_;
  std::atomic<bool> stop_{false};     ///< end the frame
  std::atomic<bool> refining_{false}; ///< the frame refines a still picture
  bool quit_ = false, blocked_ = false;
  bool moved_ = false; ///< the frame that was published last was moving
  double last_shown_s_ = 0.0;
  uint64_t published_ = 0;
  std::thread thread_; ///< last: it uses the others
};

} // namespace packtrace
