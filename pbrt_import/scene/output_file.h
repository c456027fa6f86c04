#pragma once

#include <filesystem>
#include <functional>
#include <vector>

namespace packtrace {

/// A file that appears whole or not at all: the caller writes to path(), and commit() renames it to the target. Until
/// then the target is untouched, and the destructor removes what was written.
class OutputFile {
public:
  /// Makes an empty temporary file in the target's folder. A target that is a symbolic link stands for the file it
  /// leads to.
  /// @param force an existing target may be replaced
  /// Throws Error(kIo) where the target exists and force is not set, is not a regular file, or its folder is missing
  /// or cannot be written to; Error(kUsage) for an empty name, and for the target of another OutputFile that is not
  /// committed yet.
  OutputFile(std::filesystem::path target, bool force);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Where to write. It has a name of its own, so writers must not judge the format by it.
  const std::filesystem::path& path() const { return temporary_; }
  const std::filesystem::path& target() const { return target_; }

  /// Runs work(path()). Where it throws an Error whose message names that path, the target's name stands there instead.
  void write(const std::function<void(const std::filesystem::path& path)>& work) const;

  /// Puts the file in its place. Throws Error(kIo) where that fails, or where a target appeared meanwhile and force was
  /// not set.
  void commit();

private:
  std::filesystem::path target_;
  std::filesystem::path temporary_;
  bool force_ = false;
  bool committed_ = false;
};

/// Throws Error(kUsage) if target is one of the files that a command reads, under whatever name. Without a target: any
/// of the OutputFiles of the process that are not committed.
void refuse_to_replace(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& target);
void refuse_to_replace(const std::vector<std::filesystem::path>& inputs);

/// Removes the temporary files of all OutputFiles of the process that are not committed. Async-signal-safe.
void remove_unfinished_output() noexcept;

} // namespace packtrace
