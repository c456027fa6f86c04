#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace packtrace::test {

struct CommandResult {
  int exit_code = -1;
  std::string out; ///< standard output
  std::string err; ///< standard error
};

/// Runs the packtrace program under test with these arguments, no shell between.
CommandResult run_packtrace(const std::vector<std::string>& arguments);

std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

/// A room of two quads with a camera, about the smallest scene that renders.
std::string small_scene_text();

} // namespace packtrace::test
