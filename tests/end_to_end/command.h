#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace packtrace::test {

struct CommandResult {
  int exit_code = -1;
  std::string out; ///< standard output
  std::string err; ///< standard error
};

/// Runs the packtrace program under test with these arguments, no shell between.
CommandResult run_packtrace(const std::vector<std::string>& arguments);

/// A fresh directory under the system's temporary one, removed with its contents at the end of scope.
class TemporaryDirectory {
public:
  TemporaryDirectory();
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

private:
  std::filesystem::path path_;
};

std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

/// A room of two quads with a camera, about the smallest scene that renders.
std::string small_scene_text();

} // namespace packtrace::test
