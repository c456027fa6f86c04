#pragma once

#include <filesystem>
#include <system_error>

#include "pbrt_import/base/regular_file.h"

namespace packtrace {

/// Keeps the content of a file that is about to be replaced, under a temporary name beside it: a hard link, or a copy
/// where the file system has none.
class ReplacedFile {
public:
  using Link = void(const std::filesystem::path& file, const std::filesystem::path& name, std::error_code& error);

  /// @param file not a symbolic link; nothing is kept of a file that does not exist
  /// @param link makes the hard link; tests pass one that fails
  /// Throws Error(kIo), which names the file, if it can be neither linked nor copied.
  explicit ReplacedFile(std::filesystem::path file, Link& link = std::filesystem::create_hard_link);
  /// Removes the temporary name.
  ~ReplacedFile();
  ReplacedFile(const ReplacedFile&) = delete;
  ReplacedFile& operator=(const ReplacedFile&) = delete;

  /// Puts the content that the file had back in place. If that fails, it keeps its temporary name.
  void restore() noexcept;

private:
  const std::filesystem::path file_;
  std::filesystem::path kept_; ///< empty: nothing is kept
  Descriptor lock_;            ///< locks kept_, so that no other process removes it as a stale file
};

} // namespace packtrace
