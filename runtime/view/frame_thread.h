#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "runtime/view/view_controls.h"
#include "runtime/view/view_session.h"
#include "runtime/view/view_settings.h"

namespace packtrace {

/// State that a window shows: the image of a frame, and the session and its controls at that time.
struct ViewSnapshot {
  uint64_t number = 0; ///< of the published frame, from 1
  ImageSize size;      ///< of the picture: smaller than the view while something moves
  std::vector<uint8_t> rgb;
  ViewFrame frame;
  double frame_ms = 0.0; ///< wall time of the frame with its picture
  /// Time of the oldest input that this image is the first to show, by input_clock_s(); none: it shows no new input.
  std::optional<double> input_s;
  std::vector<std::string> files;
  std::array<std::string, 2> layers;
  std::array<size_t, 2> pane_files{};
  uint32_t spp = 0; ///< occlusion samples per pixel and frame of the first pane
  std::array<std::vector<ViewSetting>, 2> settings;
  SplitMode split = SplitMode::kOff;
  double divider = 0.5, gain = 8.0, speed = 0.0, target_ms = 0.0;
  bool paused = false, plays = false, orbits = false, lights_turn = false, recording = false;
  std::optional<Gizmo> gizmo;           ///< of the picked instance
  std::optional<Pick> pick;             ///< of the last set_pick()
  std::optional<FileContents> contents; ///< of the first pane, if show_contents()
  std::optional<DifferenceMetrics> metrics;
  std::string command; ///< of the first pane; empty while something moves
};

/// A clock for the time from an input to its picture, in seconds.
double input_clock_s();

/// Creates a session and renders its frames in a separate thread, so that a window stays responsive. Everything that
/// changes the session runs in this thread between frames.
class FrameThread {
public:
  using Task = std::function<void(ViewSession& session, ViewControls& controls)>;

  /// Callbacks into the program.
  struct Host {
    /// Creates the session, and reports progress to the observer, which cancels by Error(kCancelled) when the
    /// FrameThread is destroyed.
    std::function<std::unique_ptr<ViewSession>(const Progress::Observer& observer)> load;
    /// Writes words as a command line.
    std::function<std::string(const std::vector<std::string>&)> command_text;
    /// Gets each set_message(). Called from any thread.
    std::function<void(const std::string&)> message;
  };

  explicit FrameThread(Host host);
  /// Ends the thread, and the current frame within a tile.
  ~FrameThread();
  FrameThread(const FrameThread&) = delete;
  FrameThread& operator=(const FrameThread&) = delete;

  /// Effect of a task on the frame that is being rendered.
  enum class Urgency : uint8_t {
    kAfterFrame, ///< waits for its end
    kMoves,      ///< ends it within a tile if it refines a still picture, which begins anew: for movements
    kNow,        ///< ends it within a tile
  };

  /// Runs a task before the next frame. The text of an Error that it throws becomes the message.
  void post(Task task, Urgency urgency = Urgency::kAfterFrame);
  /// Runs a task that reads the image. A frame is rendered first if the image does not show the effect of all posted
  /// tasks.
  void post_reading(Task task);
  /// The pixel whose pick() the snapshots have; none: no pick.
  void set_pick(std::optional<std::array<uint32_t, 2>> pixel);
  /// Whether the snapshots have the contents of the file.
  void show_contents(bool shown);
  /// Shows a message: what was saved, or why something failed. May be called from any thread.
  void set_message(const std::string& message);
  /// Shows the progress of something until the next message. May be called from any thread.
  void set_status(const std::string& status);
  /// The last message or status.
  std::string message() const;
  /// Progress of creating the session: its phase, and the completed fraction in [0, 1], 0 if unknown.
  std::pair<std::string, double> loading() const;

  /// The last frame that was published; null before the first.
  std::shared_ptr<const ViewSnapshot> snapshot() const;
  /// The error that ended the thread, or null.
  std::exception_ptr failure() const;

private:
  void run();
  void load();
  bool run_tasks();
  void render();
  void render_frame();
  bool worth_showing() const;
  void publish(double step_ms);
  void wait_for_work();

  Host host_;
  std::unique_ptr<ViewSession> session_;   ///< of the thread; null until it is loaded
  std::unique_ptr<ViewControls> controls_; ///< the same
  mutable std::mutex mutex_;               ///< of what follows, up to failure_
  std::condition_variable wake_;
  std::vector<Task> tasks_;
  std::optional<std::array<uint32_t, 2>> pick_;
  std::string message_;
  std::pair<std::string, double> loading_{"loading", 0.0};
  bool contents_shown_ = false;
  std::optional<double> input_s_; ///< of the oldest movement that is not shown yet
  bool republish_ = false;        ///< the pick or contents_shown_ changed
  std::shared_ptr<const ViewSnapshot> snapshot_;
  std::exception_ptr failure_;
  std::atomic<bool> quit_{false};         ///< end the thread
  std::atomic<bool> stop_{false};         ///< end the frame
  std::atomic<bool> refining_{false};     ///< the frame refines a still picture
  std::optional<double> started_input_s_; ///< of the thread: the same, of those that the next frame shows
  bool blocked_ = false;
  bool moved_ = false; ///< the frame that was published last was moving
  double last_shown_s_ = 0.0;
  uint64_t published_ = 0;
  std::thread thread_; ///< last: it uses the others
};

} // namespace packtrace
