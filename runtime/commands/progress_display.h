#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>

#include "pbrt_import/base/progress.h"

namespace packtrace {

struct GlobalOptions;

/// "phase: 42% after 1.3 s, 1.8 s left"; without the parts that are not known.
std::string progress_text(std::string_view phase, uint64_t done, uint64_t total, double elapsed_s);

/// Shows a Progress on standard error: one line per phase that updates itself on a terminal, otherwise a plain line
/// when a phase of some length ends and every kPlainInterval in between. It must outlive the Progress that it observes.
class ProgressDisplay {
public:
  struct Config {
    std::FILE* stream = stderr;
    bool terminal = false;
    bool quiet = false;
    std::function<double()> seconds; ///< clock, any origin; empty: the steady clock
  };
  static constexpr double kTerminalInterval = 0.1; ///< seconds
  static constexpr double kPlainInterval = 10.0;   ///< seconds
  static constexpr double kMinPlainPhase = 0.5;       ///< seconds; shorter phases are not mentioned in plain lines

  explicit ProgressDisplay(const GlobalOptions& globals);
  explicit ProgressDisplay(Config config);
  ~ProgressDisplay() { finish(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// For Progress's constructor. May be called from any thread.
  Progress::Observer observer();

  /// Ends the current line, so that other text can follow.
  void finish();

private:
  void observe(std::string_view phase, uint64_t done, uint64_t total);
  void print(const std::string& text, bool last_of_phase);
  void end_phase(bool done);

  Config config_;
  std::mutex mutex_;
  std::atomic<double> next_print_{0.0}; ///< nothing to do before, save for new phases
  std::string phase_;                   ///< empty: none is running
  double phase_start_ = 0.0;
  uint64_t done_ = 0, total_ = 0;
};

} // namespace packtrace
