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

/// Formats "phase: 42% after 1.3 s, 1.8 s left". Unknown parts are omitted.
/// @param total 0: unknown
std::string progress_text(std::string_view phase, uint64_t done, uint64_t total, double elapsed_s);

/// An observer that calls both, the first unless it is empty.
Progress::Observer both(Progress::Observer first, Progress::Observer second);

/// Displays a Progress on standard error. On a terminal there is one line per phase that updates in place. Otherwise a
/// plain line is printed every kPlainInterval, and at the end of phases of at least kMinPlainPhase.
/// The object must outlive the Progress that it observes.
class ProgressDisplay {
public:
  struct Config {
    std::FILE* stream = stderr;
    bool terminal = false;
    bool quiet = false;
    std::function<double()> seconds; ///< clock with any origin, seconds; empty: the steady clock
  };
  static constexpr double kTerminalInterval = 0.1; ///< seconds
  static constexpr double kPlainInterval = 10.0;   ///< seconds
  static constexpr double kMinPlainPhase = 0.5;    ///< seconds; shorter phases get no plain line

  explicit ProgressDisplay(const GlobalOptions& globals);
  explicit ProgressDisplay(Config config);
  ~ProgressDisplay() { finish(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// Returns the observer for Progress's constructor; it may be called from any thread. Empty if quiet.
  Progress::Observer observer();

  /// Ends the current line, so that other output can follow.
  void finish();

private:
  void observe(std::string_view phase, uint64_t done, uint64_t total);
  void print(const std::string& text, bool last_of_phase);
  void end_phase(bool done);

  Config config_;
  std::mutex mutex_;
  std::atomic<double> next_print_{0.0}; ///< earliest time of the next print within a phase
  std::string phase_;                   ///< current phase; empty: none
  double phase_start_ = 0.0;
  uint64_t done_ = 0, total_ = 0;
};

} // namespace packtrace
