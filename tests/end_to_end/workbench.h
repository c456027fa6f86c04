#pragma once

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/end_to_end/command.h"

namespace packtrace::test {

/// Number of files and folders in a directory.
inline size_t file_count(const std::filesystem::path& directory) {
  return static_cast<size_t>(
      std::distance(std::filesystem::directory_iterator(directory), std::filesystem::directory_iterator()));
}

/// A temporary directory with the small scene and, on request, its baked file.
class Workbench {
public:
  Workbench() { write_text(scene(), small_scene_text()); }
  std::string scene() const { return directory_ / "small.pbrt"; }
  std::string baked() const { return directory_ / "small.ptk"; }
  std::string operator/(const std::string& name) const { return directory_ / name; }
  const std::filesystem::path& path() const { return directory_.path(); }
  void bake() const {
    const CommandResult result = run_packtrace({"bake", scene(), "-o", baked(), "-q"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

private:
  TemporaryFolder directory_;
};

} // namespace packtrace::test
