#include "runtime/commands/cli/progress_display.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "runtime/commands/cli/cli_support.h"

namespace packtrace {

namespace {

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string duration_text(double seconds) {
  if (seconds < 60.0) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<uint64_t>(seconds + 0.5);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

} // namespace

std::string progress_text(std::string_view phase, uint64_t done, uint64_t total, double elapsed_s) {
  std::string text = fmt::format("{}:", phase);
  const double fraction = total > 0 ? std::min(1.0, static_cast<double>(done) / static_cast<double>(total)) : 0.0;
  // Rounded down, so that 100% means finished.
  if (total > 0) text += fmt::format(" {}% after", static_cast<int>(fraction * 100.0));
  text.append(" ").append(duration_text(elapsed_s));
  if (fraction > 0.0 && fraction < 1.0)
    text += fmt::format(", {} left", duration_text(elapsed_s * (1.0 - fraction) / fraction));
  return text;
}

Progress::Observer both(Progress::Observer first, Progress::Observer second) {
  if (!first) return second;
  return [a = std::move(first), b = std::move(second)](std::string_view phase, uint64_t done, uint64_t total) {
    a(phase, done, total);
    b(phase, done, total);
  };
}

ProgressDisplay::ProgressDisplay(const GlobalOptions& globals)
    : ProgressDisplay(Config{stderr, is_terminal(stderr), globals.quiet, {}}) {}

ProgressDisplay::ProgressDisplay(Config config) : config_(std::move(config)) {
  if (!config_.seconds) config_.seconds = steady_seconds;
}

Progress::Observer ProgressDisplay::observer() {
  if (config_.quiet) return {};
  return [this](std::string_view phase, uint64_t done, uint64_t total) { observe(phase, done, total); };
}

void ProgressDisplay::observe(std::string_view phase, uint64_t done, uint64_t total) {
  const double now = config_.seconds();
  const bool begins = done == 0;
  if (!begins && now < next_print_.load(std::memory_order_relaxed)) {
    // Frequent calls return here without taking the lock. A later call reports the progress anyway; only the end of a
    // phase has no later call.
    if (total == 0 || done < total) return;
  }
  const std::lock_guard lock(mutex_);
  if (begins || phase != phase_) {
    end_phase(true); // a new phase has begun, so the previous one is finished whatever its count
    phase_ = phase;
    phase_start_ = now;
    done_ = 0;
    next_print_.store(now + (config_.terminal ? kTerminalInterval : kPlainInterval), std::memory_order_relaxed);
  }
  done_ = std::max(done_, done); // reports from several threads may arrive out of order
  total_ = total;
  if (now < next_print_.load(std::memory_order_relaxed)) return;
  next_print_.store(now + (config_.terminal ? kTerminalInterval : kPlainInterval), std::memory_order_relaxed);
  print(progress_text(phase_, done_, total_, now - phase_start_), false);
}

void ProgressDisplay::print(const std::string& text, bool last_of_phase) {
  // A single write per line keeps other output from getting in between.
  const std::string line = config_.terminal ? "\r\x1b[K" + text + (last_of_phase ? "\n" : "") : text + "\n";
  std::fwrite(line.data(), 1, line.size(), config_.stream);
  std::fflush(config_.stream);
}

void ProgressDisplay::end_phase(bool done) {
  if (phase_.empty()) return;
  const double elapsed = config_.seconds() - phase_start_;
  const bool whole = done || total_ == 0 || done_ >= total_;
  if (config_.terminal || !whole || elapsed >= kMinPlainPhase)
    print(fmt::format("{}: {}{}", phase_, whole ? "" : "stopped after ", duration_text(elapsed)), true);
  phase_.clear();
}

void ProgressDisplay::finish() {
  const std::lock_guard lock(mutex_);
  end_phase(false);
}

} // namespace packtrace
