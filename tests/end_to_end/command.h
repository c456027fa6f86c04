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

/// Runs a program directly, without a shell, and with empty standard input.
/// @param program a path, or a name to look up in PATH
/// @param environment "NAME=value" entries, added to this process's environment
/// @param folder working folder; empty: this process's
/// @param prepare called in the child process before the program starts, for example to set limits
CommandResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                          const std::vector<std::string>& environment = {}, const std::filesystem::path& folder = {},
                          const std::function<void()>& prepare = {});

/// Path of the packtrace program under test.
std::string packtrace_program();
/// Runs it with run_program().
CommandResult run_packtrace(const std::vector<std::string>& arguments, const std::vector<std::string>& environment = {},
                            const std::filesystem::path& folder = {});
/// Same, with prepare() called in the child process first.
CommandResult run_packtrace(const std::vector<std::string>& arguments, const std::function<void()>& prepare);

std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

/// Text of a minimal scene: a room of two quads with a camera.
std::string small_scene_text();

} // namespace packtrace::test
