#pragma once

#include <filesystem>

namespace packtrace {

/// Keeps the content of a file that is about to be replaced, under a temporary name beside it (a hard link). File
/// systems without hard links keep nothing.
class ReplacedFile {
public:
  /// @param file not a symbolic link; nothing is kept of a file that does not exist
  explicit ReplacedFile(std::filesystem::path file);
  /// Removes the temporary name.
  ~ReplacedFile();
  ReplacedFile(const ReplacedFile&) = delete;
  ReplacedFile& operator=(const ReplacedFile&) = delete;

  /// Puts the content that the file had back in place. If that fails, it keeps its temporary name.
  void restore() noexcept;

private:
  const std::filesystem::path file_;
  std::filesystem::path kept_; ///< empty: nothing is kept
};

} // namespace packtrace
