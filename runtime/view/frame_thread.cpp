#include "runtime/view/frame_thread.h"

#include <algorithm>
#include <chrono>

#include "pbrt_import/base/error.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Frames after which a still picture is not refined any more: later ones change no pixel of a screen.
constexpr uint32_t kMaxStillFrames = 4096;
/// Frames of a still picture that are not shown after a movement: its last frame has less noise than these.
constexpr uint32_t kHeldFrames = 4;
/// Later frames of a still picture are shown at this rate, since making a picture takes as long as a frame.
constexpr uint32_t kEagerFrames = 16;
constexpr double kShowSeconds = 0.1;
/// Longest time that controls see between frames, so that a pause does not become a jump.
constexpr double kMaxSeconds = 0.2;
/// Pixels up to which the two panes are compared in every picture that is shown.
constexpr size_t kLiveMetrics = size_t{1} << 20;

std::vector<uint8_t> bytes_of(const Image& picture) {
  std::vector<uint8_t> bytes(picture.data.size());
  std::ranges::transform(picture.data, bytes.begin(),
                         [](float v) { return static_cast<uint8_t>(std::clamp(v, 0.0f, 1.0f) * 255.0f + 0.5f); });
  return bytes;
}

} // namespace

double input_clock_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

FrameThread::FrameThread(Host host) : host_(std::move(host)) {
  thread_ = std::thread([this] {
    try {
      run();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
  });
}

FrameThread::~FrameThread() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void FrameThread::post(Task task, Urgency urgency) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
    if (urgency == Urgency::kMoves && !input_s_) input_s_ = input_clock_s();
    if (urgency == Urgency::kNow || (urgency == Urgency::kMoves && refining_)) stop_ = true;
  }
  wake_.notify_all();
}

void FrameThread::post_reading(Task task) {
  post([this, task = std::move(task)](ViewSession& session, ViewControls& controls) {
    Progress progress([this](std::string_view, uint64_t, uint64_t) {
      if (quit_) throw Error(ErrorKind::kCancelled, "the window was closed");
    });
    if (session.settle(progress)) task(session, controls);
  });
}

void FrameThread::set_pick(std::optional<std::array<uint32_t, 2>> pixel) {
  {
    const std::lock_guard lock(mutex_);
    if (pick_ == pixel) return;
    pick_ = pixel;
    republish_ = true;
  }
  wake_.notify_all();
}

void FrameThread::show_contents(bool shown) {
  {
    const std::lock_guard lock(mutex_);
    if (contents_shown_ == shown) return;
    contents_shown_ = shown;
    republish_ = true;
  }
  wake_.notify_all();
}

void FrameThread::set_message(const std::string& message) {
  set_status(message);
  host_.message(message);
}

void FrameThread::set_status(const std::string& status) {
  const std::lock_guard lock(mutex_);
  message_ = status;
}

std::string FrameThread::message() const {
  const std::lock_guard lock(mutex_);
  return message_;
}

std::pair<std::string, double> FrameThread::loading() const {
  const std::lock_guard lock(mutex_);
  return loading_;
}

std::shared_ptr<const ViewSnapshot> FrameThread::snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

std::exception_ptr FrameThread::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

/// Runs the tasks that were posted. Returns false at the end of the thread.
bool FrameThread::run_tasks() {
  std::vector<Task> tasks;
  {
    const std::lock_guard lock(mutex_);
    if (quit_) return false;
    stop_ = false;
    tasks.swap(tasks_);
    if (!started_input_s_) started_input_s_ = input_s_;
    input_s_.reset();
  }
  for (const Task& task : tasks) try {
      task(*session_, *controls_);
    } catch (const Error& error) {
      set_message(error.what());
    }
  return true;
}

void FrameThread::load() {
  session_ = host_.load([this](std::string_view phase, uint64_t done, uint64_t total) {
    if (quit_) throw Error(ErrorKind::kCancelled, "the window was closed");
    const std::lock_guard lock(mutex_);
    loading_ = {std::string(phase), total > 0 ? static_cast<double>(done) / static_cast<double>(total) : 0.0};
  });
  controls_ = std::make_unique<ViewControls>(*session_);
}

void FrameThread::run() {
  load();
  double last_s = input_clock_s();
  while (run_tasks()) {
    const double start_s = input_clock_s();
    controls_->advance(std::min(start_s - last_s, kMaxSeconds));
    last_s = start_s;
    render();
    wait_for_work();
  }
}

/// Renders a frame, and publishes it if it is worth showing. What cannot be rendered, such as a picture that needs too
/// much memory, becomes the message until something changes.
void FrameThread::render() {
  try {
    render_frame();
    blocked_ = false;
  } catch (const Error& error) {
    refining_ = false;
    blocked_ = true;
    set_message(error.what());
    if (session_->split() == SplitMode::kDifference) session_->set_split(SplitMode::kOff);
  }
}

void FrameThread::render_frame() {
  const uint32_t still_frames = session_->last().still_frames;
  if (still_frames >= kMaxStillFrames && !session_->changed()) return;
  refining_ = still_frames > 0 && !session_->changed();
  Progress progress([this](std::string_view, uint64_t, uint64_t) {
    if (stop_) throw Error(ErrorKind::kCancelled, "input");
  });
  const Stopwatch watch;
  const bool finished = session_->step(progress);
  refining_ = false;
  if (!finished) return;
  if (worth_showing()) publish(1e3 * watch.seconds());
}

bool FrameThread::worth_showing() const {
  const uint32_t still_frames = session_->last().still_frames;
  if (session_->last().moving || published_ == 0) return true;
  if (still_frames < kHeldFrames) return !moved_;
  return still_frames <= kEagerFrames || input_clock_s() - last_shown_s_ >= kShowSeconds;
}

void FrameThread::publish(double step_ms) {
  const Stopwatch watch;
  const auto shown = std::make_shared<ViewSnapshot>();
  ViewSession& s = *session_;
  const Image picture = s.picture();
  shown->size = picture.size;
  shown->rgb = bytes_of(picture);
  shown->frame = s.last();
  for (const ViewFile& file : s.files()) shown->files.push_back(file.name);
  for (size_t pane = 0; pane < 2; ++pane) {
    shown->layers[pane] = s.pane(pane).layer;
    shown->pane_files[pane] = s.pane(pane).file;
    shown->settings[pane] = view_settings(s.pane(pane).config);
  }
  shown->spp = s.rendered_config(0).ao.spp;
  shown->split = s.split(), shown->divider = s.divider(), shown->gain = s.gain();
  shown->speed = controls_->speed(), shown->target_ms = s.target_ms();
  shown->paused = controls_->paused(), shown->plays = controls_->plays(), shown->orbits = controls_->orbits();
  shown->lights_turn = controls_->lights_turn();
  shown->recording = controls_->recording();
  shown->gizmo = s.gizmo();
  shown->command = host_.command_text(s.command(0));
  if (s.split() == SplitMode::kDifference && !s.last().moving && s.size().pixels() <= kLiveMetrics)
    shown->metrics = s.metrics();
  const std::lock_guard lock(mutex_);
  if (pick_ && (*pick_)[0] < s.size().width && (*pick_)[1] < s.size().height)
    shown->pick = s.pick(s.pane_at((*pick_)[0]), (*pick_)[0], (*pick_)[1]);
  if (contents_shown_) shown->contents = s.contents(0);
  // What came while the frame was rendered is shown by a later one.
  if (started_input_s_ && s.last().moving) shown->input_s = started_input_s_, started_input_s_.reset();
  // The window never took the previous snapshot, so this one is the first to show the input of both.
  if (snapshot_ && snapshot_.use_count() == 1 && snapshot_->input_s) shown->input_s = snapshot_->input_s;
  shown->number = ++published_;
  shown->frame_ms = step_ms + 1e3 * watch.seconds();
  session_->add_frame_time(shown->frame_ms);
  republish_ = false;
  snapshot_ = shown;
  last_shown_s_ = input_clock_s();
  moved_ = s.last().moving;
}

/// Waits while the picture has converged and there are no tasks.
void FrameThread::wait_for_work() {
  std::unique_lock lock(mutex_);
  const bool finished = session_->last().still_frames >= kMaxStillFrames && !session_->changed() && !controls_->busy();
  if (blocked_) {
    wake_.wait(lock, [this] { return quit_ || !tasks_.empty(); });
    return;
  }
  if (finished) wake_.wait(lock, [this] { return quit_ || !tasks_.empty() || republish_; });
  const bool again = republish_ && session_->last().report.frames > 0 && !session_->last().moving &&
                     (finished || input_clock_s() - last_shown_s_ > kShowSeconds / 2);
  lock.unlock();
  if (again && session_->last().still_frames >= (moved_ ? kHeldFrames : 1)) publish(0.0);
}

} // namespace packtrace
