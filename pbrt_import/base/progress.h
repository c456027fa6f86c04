#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string_view>

namespace packtrace {

/// Carries progress out of long operations and cancellation into them. One object serves one command.
/// Long loops call advance() from any thread; the observer is called from whichever thread crossed a step.
class Progress {
public:
  /// done and total count the phase's own units (bytes, meshes, samples); total 0: unknown.
  using Observer = std::function<void(std::string_view phase, uint64_t done, uint64_t total)>;

  Progress() = default;
  explicit Progress(Observer observer) : observer_(std::move(observer)) {}

  /// Starts a phase. phase must outlive it (a literal). Throws Error(kCancelled) if cancelled.
  void begin(std::string_view phase, uint64_t total);

  /// Adds finished units. Throws Error(kCancelled) if cancelled.
  void advance(uint64_t units = 1);

  /// Throws Error(kCancelled) if cancel() was called.
  void check_cancelled() const;

  /// Asks all running operations of the process to stop. Async-signal-safe.
  static void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  static bool cancelled() { return cancelled_.load(std::memory_order_relaxed); }

private:
  Observer observer_;
  std::string_view phase_;
  uint64_t total_ = 0;
  std::atomic<uint64_t> done_{0};
  static std::atomic<bool> cancelled_;
};

} // namespace packtrace
