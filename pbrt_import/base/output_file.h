#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "pbrt_import/base/regular_file.h"

namespace packtrace {

/// An output file that is created atomically: the caller writes to path(), or calls write() or append(), and commit()
/// moves the complete file to the target. Until then the target is untouched.
///
/// If the file system supports it, the file has no name before commit(), so that nothing remains of it however the
/// process ends. Otherwise it is a temporary file in the target's folder, which the destructor removes; files left by
/// killed processes are removed by the next OutputFile in that folder.
class OutputFile {
public:
  /// If the target is a symbolic link, the file that it points to is replaced.
  /// @param force whether an existing target may be replaced
  /// Throws Error(kIo) if the target exists and force is not set, if the target is not a regular file, or if its folder
  /// is missing or not writable; Error(kUsage) for an empty name, or if another uncommitted OutputFile has the same
  /// target.
  OutputFile(std::filesystem::path target, bool force);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Path to write to. Its name is temporary, so writers must not derive the format from it.
  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& target() const { return target_; }

  /// Replaces the content of the uncommitted file. Throws Error(kIo), which names the target, on failure.
  void write(std::span<const std::byte> bytes);

  /// Writes behind what write() and append() have written. Throws like write().
  void append(std::span<const std::byte> bytes);

  /// Moves the file to the target. Throws Error(kIo) on failure, or if the target was created meanwhile and force is
  /// not set.
  void commit();

private:
  void give_name();
  void copy_to_named();
  int put_in_place();

  std::filesystem::path target_;
  Descriptor descriptor_;
  uint64_t written_ = 0; ///< bytes by write() and append()
  std::filesystem::path path_;
  std::filesystem::path temporary_; ///< its name in the target's folder; empty while it has no name
  bool force_ = false;
  bool committed_ = false;
};

/// Throws Error(kUsage) if the target is one of the input files of a command, under any name. Without a target, checks
/// all uncommitted OutputFiles of the process.
void refuse_to_replace(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& target);
void refuse_to_replace(const std::vector<std::filesystem::path>& inputs);

/// A new name for a temporary file in a folder. remove_stale_output() removes the file when the process has ended.
std::filesystem::path new_temporary_name(const std::filesystem::path& folder);

/// Removes the temporary files of all uncommitted OutputFiles of the process. Async-signal-safe.
void remove_unfinished_output() noexcept;

/// Removes temporary files of ended processes from a folder. Errors are ignored.
void remove_stale_output(const std::filesystem::path& folder) noexcept;

} // namespace packtrace
