#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "runtime/gpu/device/device.h"
#include "runtime/gpu/device_rays.h"

namespace packtrace::gpu {

/// Sizes of dispatches. Parts of a picture differ in cost, so the slowest dispatch of late decides.
struct Pace {
  uint64_t rays = 1u << 14; ///< of the next dispatch
  double slowest_ms = 0.0;  ///< time of a ray; 0: not known

  /// Dispatches may grow to twice their size at once, and shrink to any.
  void adapt(uint64_t last_rays, double ms, double wanted_ms) {
    slowest_ms *= 0.8;
    // Short dispatches do not fill the device, so their time does not predict that of longer ones.
    if (ms > wanted_ms / 4) slowest_ms = std::max(slowest_ms, ms / static_cast<double>(last_rays));
    const double grown = 2.0 * static_cast<double>(last_rays);
    rays =
        std::max(static_cast<uint64_t>(slowest_ms * grown > wanted_ms ? wanted_ms / slowest_ms : grown), uint64_t{1});
  }
};

/// Runs work items in dispatches that take about the wanted time.
class TimedDispatches {
public:
  /// @param pace of the dispatches, which follows their times
  /// @param rays_per_item rays of a work item
  TimedDispatches(Device& device, Pace& pace, uint64_t rays_per_item, uint64_t most_items,
                  const DeviceRays::Watch& watch)
      : device_(device), pace_(pace), rays_per_item_(rays_per_item), watch_(watch),
        most_(std::max(most_items, uint64_t{1})) {}

  /// @param run function of the first item and the number of items that returns ms
  template <typename Run>
  DeviceTime all(uint64_t count, uint64_t granularity, const Run& run) {
    DeviceTime time;
    for (uint64_t first = 0; first < count;) {
      const uint64_t fitting = std::min(pace_.rays / rays_per_item_, most_);
      const uint64_t wanted = std::max(fitting / granularity, uint64_t{1}) * granularity;
      const uint64_t items = std::min(count - first, wanted);
      if (watch_) watch_(static_cast<double>(first) / static_cast<double>(count));
      const double ms = run(first, items);
      first += items;
      time.ms += ms, ++time.dispatches;
      time.longest_ms = std::max(time.longest_ms, ms);
      if (items == wanted || ms > device_.config().dispatch_ms)
        pace_.adapt(items * rays_per_item_, ms, device_.config().dispatch_ms);
    }
    return time;
  }

private:
  Device& device_;
  Pace& pace_;
  uint64_t rays_per_item_;
  const DeviceRays::Watch watch_;
  uint64_t most_;
};

/// Chooses between two kernels with the same results. Which one is faster depends on how many rays a dispatch has.
/// Parts of a picture differ in cost and the device's clock changes, so both are compared on the same rays, now and
/// then.
class FasterKernel {
public:
  /// Whether to run the next dispatch with both kernels and to pass their times to add().
  bool compares(uint64_t rays) {
    const size_t turn = trials_[std::bit_width(rays)].dispatches++;
    return turn == 0 || turn == kSecondTurn || turn % kTurns == 0;
  }
  /// Number of the faster kernel.
  size_t choice(uint64_t rays) const { return trials_[std::bit_width(rays)].log_ratio < 0.0 ? 1 : 0; }
  void add(uint64_t rays, const std::array<double, 2>& ms) {
    Trials& trials = trials_[std::bit_width(rays)];
    const double log_ratio = std::log(std::max(ms[1], 1e-6) / std::max(ms[0], 1e-6));
    trials.log_ratio += (log_ratio - trials.log_ratio) / std::min(++trials.comparisons, kMemory);
  }

private:
  static constexpr size_t kSecondTurn = 4, kTurns = 64; ///< the first dispatches may find the clock low
  static constexpr int kMemory = 2;                     ///< comparisons that count

  struct Trials {
    double log_ratio = 0.0; ///< of the time of kernel 1 to that of kernel 0
    size_t dispatches = 0;
    int comparisons = 0;
  };
  std::array<Trials, 65> trials_; ///< by the number of bits of the number of rays
};

} // namespace packtrace::gpu
