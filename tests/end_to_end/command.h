#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace packtrace::test {

struct CommandResult {
  int exit_code = -1;
  std::string out; ///< standard output
  std::string err; ///< standard error
};

/// Runs a program with these arguments, no shell between and nothing on its standard input.
/// @param program a path, or a name to be found as a shell finds it
/// @param environment "NAME=value", added to this process's own
/// @param folder to run in; empty: this process's
/// @param prepare called in the new process before the program starts, to set limits for example
CommandResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                          const std::vector<std::string>& environment = {}, const std::filesystem::path& folder = {},
                          const std::function<void()>& prepare = {});

/// run_program() of the packtrace program under test.
CommandResult run_packtrace(const std::vector<std::string>& arguments, const std::vector<std::string>& environment = {},
                            const std::filesystem::path& folder = {});
/// The same after prepare() in the new process.
CommandResult run_packtrace(const std::vector<std::string>& arguments, const std::function<void()>& prepare);

std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

/// A room of two quads with a camera, about the smallest scene that renders.
std::string small_scene_text();

} // namespace packtrace::test
