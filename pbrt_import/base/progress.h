#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string_view>

namespace packtrace {

/// Reports the progress of long operations and cancels them. Each command has one object. Long loops call advance()
/// from any thread; the observer is called in the same thread.
class Progress {
public:
  /// done and total are in units of the phase (bytes, meshes, samples); total 0 means unknown.
  using Observer = std::function<void(std::string_view phase, uint64_t done, uint64_t total)>;

  Progress() = default;
  explicit Progress(Observer observer) : observer_(std::move(observer)) {}

  /// Starts a phase. `phase` is not copied and must stay valid (a literal). Throws Error(kCancelled) if cancelled.
  void begin(std::string_view phase, uint64_t total);

  /// Adds finished units. Throws Error(kCancelled) if cancelled.
  void advance(uint64_t units = 1);

  /// Throws Error(kCancelled) if cancel() was called.
  void check_cancelled() const;

  /// Requests all running operations of the process to stop. Async-signal-safe.
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
