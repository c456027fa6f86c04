#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// Sequential reader of one regular file; files that start with gzip's magic bytes are inflated on the way.
class InputFile {
public:
  /// Opens path. Throws Error(kInput), message without the path, if it is missing, unreadable or not a regular file.
  /// @param max_bytes of content, after inflating
  InputFile(const std::filesystem::path& path, uint64_t max_bytes);
  ~InputFile();
  InputFile(InputFile&&) noexcept;
  InputFile& operator=(InputFile&&) noexcept;

  /// Fills buffer from the start; fewer bytes than asked for only at the end of the file, or before damaged gzip data,
  /// which the next call throws Error(kInput) for. Throws Error(kInput) if reading fails, Error(kLimitExceeded) past
  /// max_bytes.
  size_t read(std::span<char> buffer);

  /// Like read, from an offset in the content of a file that is not compressed. Any thread may call it.
  size_t read_at(uint64_t offset, std::span<char> buffer) const;

  /// Bytes on disk.
  uint64_t stored_bytes() const;
  bool compressed() const;
  /// What gzip says of the length of the content, in its last four bytes: right for files of one member below 4 GiB,
  /// else, or where it cannot be, 0.
  uint64_t claimed_bytes() const;

  /// True where both are the same file on disk, whatever their names.
  bool same_file(const InputFile& other) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The whole content, inflated if need be.
/// @param memory grows by what this takes, before it is taken; null: nobody counts
/// Throws like InputFile, and MemoryError.
std::vector<std::byte> read_whole_file(const std::filesystem::path& path, uint64_t max_bytes,
                                       MemoryReservation* memory = nullptr);

} // namespace packtrace
