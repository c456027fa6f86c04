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

/// Input needs more memory than it may take. Readers that skip what is bad pass this one on: a picture without what did
/// not fit would be a wrong one.
class MemoryError : public FileError {
public:
  explicit MemoryError(const std::string& problem) : FileError(ErrorKind::kInput, SourceLocation{}, problem) {}
  MemoryError(const SourceLocation& location, const std::string& problem)
      : FileError(ErrorKind::kInput, location, problem) {}
  MemoryError(const std::filesystem::path& file, const std::string& problem)
      : FileError(ErrorKind::kInput, file, problem) {}
};

/// The problem where an allocation itself fails.
inline constexpr const char* kNoMemory = "not enough memory: the system has no more";

/// How much memory a command may take for its input. Whatever the input decides the size of is reserved here before it
/// is allocated. Copies of a budget are the same budget; any thread may use them.
class MemoryBudget {
public:
  explicit MemoryBudget(uint64_t bytes = default_bytes());

  /// Half of machine_memory().
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

/// A part of a budget, given back by the destructor.
class MemoryReservation {
public:
  /// Of no budget: no limit, and nothing is counted.
  MemoryReservation() = default;
  /// Of nothing yet.
  explicit MemoryReservation(const MemoryBudget& budget) : budget_(budget) {}
  MemoryReservation(const MemoryBudget& budget, uint64_t bytes, std::string_view what) : MemoryReservation(budget) {
    resize(bytes, what);
  }
  ~MemoryReservation() { release(); }
  MemoryReservation(MemoryReservation&& other) noexcept;
  MemoryReservation& operator=(MemoryReservation&& other) noexcept;

  uint64_t bytes() const { return bytes_; }

  /// Throws MemoryError, "WHAT needs N GiB of memory, of M GiB left; ...", and changes nothing, where the budget has
  /// not that much left.
  void resize(uint64_t bytes, std::string_view what);
  /// Grows to bytes where it is smaller. Throws like resize().
  void cover(uint64_t bytes, std::string_view what) {
    if (bytes > bytes_) resize(bytes, what);
  }
  /// Takes what the other one holds, of the same budget.
  void merge(MemoryReservation&& other) noexcept;
  void release() noexcept;

private:
  std::optional<MemoryBudget> budget_;
  uint64_t bytes_ = 0;
};

/// Bytes that this process may use: of the machine, or less where a control group (version 1 or 2) around the process
/// or a limit of its address space (ulimit -v) says so.
uint64_t machine_memory();

/// The least limit that control groups set, UINT64_MAX where none does.
/// @param membership content of /proc/self/cgroup
/// @param root where control groups are mounted, /sys/fs/cgroup
uint64_t control_group_memory(std::string_view membership, const std::filesystem::path& root);

/// The number of bytes that text stands for: "1000000", "512K", "1.5G" (of 1024), or "50%" of all.
/// Throws Error(kUsage) where it stands for none, or for less than 1 byte.
uint64_t parse_memory_size(std::string_view text, uint64_t all);

/// "3.7 GiB".
std::string memory_text(uint64_t bytes);

} // namespace packtrace
