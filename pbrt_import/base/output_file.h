#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "pbrt_import/base/regular_file.h"

namespace packtrace {

/// A file that appears whole or not at all: the caller writes to path(), or calls write(), and commit() puts the file
/// in the place of the target. Until then the target is untouched.
///
/// Where the file system can, the file has no name before commit(), so nothing is left of it however the process ends.
/// Elsewhere it is a temporary file in the target's folder, which the destructor removes; what a killed process left
/// there is removed by the next OutputFile in that folder.
class OutputFile {
public:
  /// A target that is a symbolic link stands for the file it leads to.
  /// @param force an existing target may be replaced
  /// Throws Error(kIo) where the target exists and force is not set, is not a regular file, or its folder is missing
  /// or cannot be written to; Error(kUsage) for an empty name, and for the target of another OutputFile that is not
  /// committed yet.
  OutputFile(std::filesystem::path target, bool force);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Where to write. It has a name of its own, so writers must not judge the format by it.
  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& target() const { return target_; }

  /// Replaces the content. Throws Error(kIo), which names the target, where that fails.
  void write(std::span<const std::byte> bytes);

  /// Puts the file in its place. Throws Error(kIo) where that fails, or where a target appeared meanwhile and force was
  /// not set.
  void commit();

private:
  void give_name();
  void copy_to_named();
  int put_in_place();

  std::filesystem::path target_;
  Descriptor descriptor_;
  std::filesystem::path path_;
  std::filesystem::path temporary_; ///< its name in the target's folder; empty while it has none
  bool force_ = false;
  bool committed_ = false;
};

/// Throws Error(kUsage) if target is one of the files that a command reads, under whatever name. Without a target: any
/// of the OutputFiles of the process that are not committed.
void refuse_to_replace(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& target);
void refuse_to_replace(const std::vector<std::filesystem::path>& inputs);

/// Removes the temporary files of all OutputFiles of the process that are not committed. Async-signal-safe.
void remove_unfinished_output() noexcept;

/// Removes temporary files that processes which have ended left in a folder. Does nothing where it cannot.
void remove_stale_output(const std::filesystem::path& folder) noexcept;

} // namespace packtrace
