#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "pbrt_import/base/file_error.h"

namespace packtrace {

/// The input needs more memory than its budget has. Readers that skip bad input pass this error on, because a picture
/// without the parts that did not fit would be wrong.
class MemoryError : public FileError {
public:
  explicit MemoryError(const std::string& problem) : FileError(ErrorKind::kInput, SourceLocation{}, problem) {}
  MemoryError(const SourceLocation& location, const std::string& problem)
      : FileError(ErrorKind::kInput, location, problem) {}
  MemoryError(const std::filesystem::path& file, const std::string& problem)
      : FileError(ErrorKind::kInput, file, problem) {}
};

/// Message for allocations that fail themselves.
inline constexpr const char* kNoMemory = "not enough memory: the system has no more";

/// Limit of the memory that a command may use for its input. Every allocation whose size depends on the input is
/// reserved here first. Copies share one budget; thread-safe.
class MemoryBudget {
public:
  explicit MemoryBudget(uint64_t bytes = default_bytes());

  /// Half of machine_memory(), computed once.
  static uint64_t default_bytes();

  uint64_t limit() const { return state_->limit; }
  uint64_t used() const { return state_->used.load(std::memory_order_relaxed); }
  uint64_t left() const;

private:
  friend class MemoryReservation;
  struct State {
    uint64_t limit = 0;
    std::atomic<uint64_t> used{0};
  };
  bool take(uint64_t bytes) const;

  std::shared_ptr<State> state_;
};

/// A reserved part of a budget, which the destructor returns.
class MemoryReservation {
public:
  /// Without a budget: unlimited and not counted.
  MemoryReservation() = default;
  /// An empty reservation of a budget.
  explicit MemoryReservation(const MemoryBudget& budget) : budget_(budget) {}
  MemoryReservation(const MemoryBudget& budget, uint64_t bytes, std::string_view what) : MemoryReservation(budget) {
    resize(bytes, what);
  }
  ~MemoryReservation() { release(); }
  MemoryReservation(MemoryReservation&& other) noexcept;
  MemoryReservation& operator=(MemoryReservation&& other) noexcept;

  uint64_t bytes() const { return bytes_; }
  bool has_budget() const { return budget_.has_value(); }

  /// Sets the size of the reservation. If the budget has too little left, throws MemoryError, "WHAT needs N GiB of
  /// memory, of M GiB left; ...", and changes nothing.
  void resize(uint64_t bytes, std::string_view what);
  /// Grows the reservation to at least `bytes`. Throws like resize().
  void cover(uint64_t bytes, std::string_view what) {
    if (bytes > bytes_) resize(bytes, what);
  }
  /// Takes over the bytes of another reservation of the same budget.
  void merge(MemoryReservation&& other) noexcept;
  void release() noexcept;

private:
  std::optional<MemoryBudget> budget_;
  uint64_t bytes_ = 0;
};

/// Bytes that this process may use: the machine's memory, or less if a control group (version 1 or 2) of the process or
/// a limit of its address space or data segment (ulimit -v, -d) says so.
uint64_t machine_memory();

/// Smallest limit of the control groups of a process; UINT64_MAX if there is none.
/// @param membership content of /proc/self/cgroup
/// @param root mount point of control groups, /sys/fs/cgroup
uint64_t control_group_memory(std::string_view membership, const std::filesystem::path& root);

/// Parses a number of bytes: "1000000", "512K" or "1.5G" (units of 1024), or "50%" of `all`. Throws Error(kUsage) if
/// the text is malformed or means less than 1 byte.
uint64_t parse_memory_size(std::string_view text, uint64_t all);

/// A number of bytes as text, such as "3.7 GiB".
std::string memory_text(uint64_t bytes);

} // namespace packtrace
