#pragma once

#include <filesystem>
#include <iterator>
#include <string>
#include <system_error>

#include <cerrno>
#include <stdlib.h>

namespace packtrace {

/// A new, empty folder. The destructor removes it with its contents.
class TemporaryFolder {
public:
  /// @throws std::filesystem::filesystem_error where none can be made
  explicit TemporaryFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path()) {
    std::string name = (parent / "packtrace_XXXXXX").string();
    if (!::mkdtemp(name.data()))
      throw std::filesystem::filesystem_error("cannot make a folder", name,
                                              std::error_code(errno, std::generic_category()));
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored; // nothing is lost if files stay
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  /// How many files there are, hidden ones included.
  size_t files() const {
    const std::filesystem::directory_iterator begin(path_), end;
    return static_cast<size_t>(std::distance(begin, end));
  }

private:
  std::filesystem::path path_;
};

} // namespace packtrace
