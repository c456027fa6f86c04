#include "runtime/commands/view/view_window.h"

#include <atomic>
#include <filesystem>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/isa.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/view/file_watch.h"
#include "runtime/commands/view/view_files.h"
#include "runtime/stopwatch.h"
#include "runtime/view/frame_thread.h"
#include "runtime/view/profile.h"
#include "runtime/view/window/settings_file.h"
#include "runtime/view/window/window.h"

namespace packtrace {
namespace {

constexpr uint32_t kProfileFrames = 300;

/// The first name of STEM-0001ENDING, STEM-0002ENDING, ... that neither ending has a file of.
std::string free_name(const std::string& file, std::initializer_list<const char*> endings) {
  const std::string stem = std::filesystem::path(file).stem().string();
  for (uint32_t number = 1;; ++number) {
    const std::string name = fmt::format("{}-{:04}", stem, number);
    bool taken = false;
    for (const char* ending : endings) taken = taken || std::filesystem::exists(name + ending);
    if (!taken) return name;
  }
}

/// What the window does with files.
class WindowFiles {
public:
  WindowFiles(FrameThread& frames, const ViewOptions& options, const GlobalOptions& globals, ViewOutputs& outputs)
      : frames_(frames), options_(options), globals_(globals), outputs_(outputs), names_(options.files),
        watch_([this](size_t file) { reload(file); }) {
    for (const std::string& name : names_) watch_.add(name);
  }
  /// Ends what is being loaded.
  ~WindowFiles() { closing_ = true; }

  void screenshot(ViewSession& session) {
    const std::string base = free_name(session.files()[session.pane(0).file].name, {".png", ".exr", ".keys.json"});
    if (session.split() == SplitMode::kOff) {
      save_pane(session, 0, base);
      return;
    }
    save_pane(session, 0, base + "-first");
    save_pane(session, 1, base + "-second");
    outputs_.save_screen(session, base + ".png");
    outputs_.report({{"screen", base + ".png"}});
    frames_.set_status("saved " + base + ".png, and both views beside it");
  }

  void record(ViewSession& session, ViewControls& controls) {
    if (!controls.recording()) {
      controls.record(true);
      frames_.set_message("recording the camera; R ends it");
      return;
    }
    controls.record(false);
    if (controls.recorded().size() < 2) return;
    const std::string name = free_name(session.files().front().name, {".json"}) + ".json";
    outputs_.save_text(name, camera_path_text(controls.recorded()));
    frames_.set_message(
        fmt::format("saved {}; render {} --path {} plays it", name, session.files().front().name, name));
  }

  void profile(ViewSession& session) {
    Progress progress;
    const std::string name = free_name(session.files().front().name, {".csv"}) + ".csv";
    outputs_.save_text(name, profile_csv(profile_orbit(session, kProfileFrames, progress)));
    frames_.set_message("saved " + name);
  }

  void save_settings(ViewSession& session) {
    const std::string name = free_name(session.files().front().name, {".toml"}) + ".toml";
    outputs_.save_text(name, settings_toml(session));
    frames_.set_message(fmt::format("saved {}; view --settings {} restores it", name, name));
  }

  /// Loads a file and shows it in the first pane.
  void open(const std::string& name) {
    watch_.run([this, name] {
      load(name, [this, name](const ViewFile& file, const ViewCamera&) {
        frames_.post([file](ViewSession& session, ViewControls&) {
          session.add_file(file);
          session.set_file(0, session.files().size() - 1);
        });
        names_.push_back(name);
        watch_.add(name);
        frames_.set_message("opened " + name);
      });
    });
  }

private:
  void save_pane(ViewSession& session, size_t pane, const std::string& base) {
    const std::vector<std::string> files{base + ".png", base + ".exr"};
    outputs_.save_pane(session, pane, files);
    const size_t file = session.pane(pane).file;
    if (const HandMoves& moves = session.hand_moves(file); !moves.empty()) {
      const std::string keys = base + ".keys.json";
      outputs_.save_text(keys, moves.keys_text(session.files()[file]));
      session.set_keys_file(file, keys);
    }
    const std::vector<std::string> command = session.command(pane);
    outputs_.report({{"screenshot", files}, {"pane", pane}, {"command", command}});
    frames_.set_status("saved " + base + ".png and .exr" +
                       (command.empty() ? ": a moving picture has no command" : ": " + command_text(command)));
  }

  void reload(size_t index) {
    load(names_[index], [this, index](const ViewFile& file, const ViewCamera& start) {
      frames_.post(
          [index, file, start](ViewSession& session, ViewControls&) { session.replace_file(index, file, start); });
      frames_.set_message("read " + names_[index] + " again");
    });
  }

  /// Loads a file in the watching thread. A file that cannot be loaded leaves everything as it is; the message says
  /// why.
  template <typename Loaded>
  void load(const std::string& name, const Loaded& loaded) {
    try {
      ProgressDisplay display(globals_);
      const Stopwatch watch;
      Progress progress(both(display.observer(), [&](std::string_view phase, uint64_t done, uint64_t total) {
        if (closing_) throw Error(ErrorKind::kCancelled, "the window was closed");
        frames_.set_status("loading " + name + ", " + progress_text(phase, done, total, watch.seconds()));
      }));
      const ViewFile file =
          load_view_file(name, options_.render, globals_, detail_config(options_.render.lod, false), progress, display);
      loaded(file, start_camera(file, options_.render, globals_));
    } catch (const std::exception& error) {
      if (closing_) return;
      frames_.set_message(std::string(error.what()) + "; the picture shows what was there before");
    }
  }

  FrameThread& frames_;
  const ViewOptions& options_;
  const GlobalOptions& globals_;
  ViewOutputs& outputs_;
  std::vector<std::string> names_; ///< of the watching thread, after the constructor
  std::atomic<bool> closing_{false};
  FileWatch watch_; ///< last: its thread uses the others
};

std::string isa_words() {
  switch (chosen_isa()) {
  case Isa::kAvx512:
    return "AVX-512";
  case Isa::kAvx2:
    return "AVX2";
  default:
    return "scalar";
  }
}

} // namespace

void restore_settings(const std::string& file, ViewSession& session) {
  constexpr uint64_t kMaxBytes = uint64_t{1} << 20;
  const std::vector<std::byte> bytes = read_file_bytes(file, kMaxBytes);
  apply_settings_toml({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, file, session);
}

void show_in_window(ImageSize size,
                    const std::function<std::unique_ptr<ViewSession>(const Progress::Observer& observer)>& load,
                    const ViewOptions& options, const GlobalOptions& globals, ViewOutputs& outputs) {
  ViewerWindow window(size, isa_words(), options.files.front());
  FrameThread frames({load, command_text, [&](const std::string& text) { outputs.report({{"message", text}}); }});
  WindowFiles files(frames, options, globals, outputs);
  WindowActions actions;
  actions.screenshot = [&](ViewSession& s, ViewControls&) { files.screenshot(s); };
  actions.record = [&](ViewSession& s, ViewControls& controls) { files.record(s, controls); };
  actions.profile = [&](ViewSession& s, ViewControls&) { files.profile(s); };
  actions.save_settings = [&](ViewSession& s, ViewControls&) { files.save_settings(s); };
  actions.picked = [&](ViewSession& s, size_t pane, const Pick& pick) {
    outputs.report({{"pick", pick_json(pick)}, {"pane", pane}, {"command", s.command(pane)}});
  };
  actions.dropped = [&](const std::string& name) { files.open(name); };
  window.run(frames, actions);
  if (const InputLatency& latency = window.latency(); latency.count() > 0)
    outputs.report({{"input_to_picture",
                     {{"inputs", latency.count()},
                      {"median_ms", latency.percentile_ms(0.5)},
                      {"p95_ms", latency.percentile_ms(0.95)}}}});
}

} // namespace packtrace
