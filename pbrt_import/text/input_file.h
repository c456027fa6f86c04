#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// Sequential reader of one regular file. Files that start with gzip's magic bytes are inflated.
class InputFile {
public:
  /// Opens a file. Throws Error(kInput), with a message without the path, if it is missing, unreadable or not a regular
  /// file.
  /// @param max_bytes limit of the content's size, after inflating
  InputFile(const std::filesystem::path& path, uint64_t max_bytes);
  ~InputFile();
  InputFile(InputFile&&) noexcept;
  InputFile& operator=(InputFile&&) noexcept;

  /// Reads the next bytes of the content and returns their number. It is less than the size of the buffer only at the
  /// end of the file or before damaged gzip data; the next call then throws Error(kInput) for the damage. Throws
  /// Error(kInput) if reading fails, Error(kLimitExceeded) if the content exceeds max_bytes.
  size_t read(std::span<char> buffer);

  /// Like read(), but at an offset in the content. Only for uncompressed files; thread-safe.
  size_t read_at(uint64_t offset, std::span<char> buffer) const;

  /// Size of the file on disk in bytes.
  uint64_t stored_bytes() const;
  bool compressed() const;
  /// Content length according to the last four bytes of a gzip file, which is correct for a single member of less than
  /// 2^32 bytes. 0 for uncompressed files and for lengths that deflate cannot reach with the stored bytes.
  uint64_t claimed_bytes() const;

  /// True if both are the same file on disk, regardless of their names.
  bool same_file(const InputFile& other) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Reads the whole content of a file, inflated if it is compressed.
/// @param memory grows by the memory that reading needs, before it is allocated; null: not counted
/// Throws like InputFile, and MemoryError.
std::vector<std::byte> read_whole_file(const std::filesystem::path& path, uint64_t max_bytes,
                                       MemoryReservation* memory = nullptr);

} // namespace packtrace
