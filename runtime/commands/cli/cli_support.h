#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <string_view>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/memory_budget.h"

namespace CLI {
class App;
}

namespace packtrace {

/// Options common to all verbs, and the action of the verb that was given.
struct GlobalOptions {
  bool quiet = false;                   ///< print errors only
  int verbosity = 0;                    ///< number of -v options; from 1 on, notes are printed
  std::string json;                     ///< JSON output: a file, "-" for standard output, empty for none
  bool force = false;                   ///< replace existing files
  uint32_t threads = 0;                 ///< 0: PACKTRACE_THREADS, or all hardware threads
  MemoryBudget memory = MemoryBudget(); ///< limit for allocations whose size depends on the input
  std::function<int()> action;          ///< runs the verb on the command line and returns its exit code
};

/// Adds the common options to the program itself, so that they may also precede the verb.
void add_global_options(CLI::App& app, GlobalOptions& globals);

/// Adds a verb that accepts the common options. Each command's file has a function
///   void add_NAME_command(CLI::App& app, GlobalOptions& globals);
/// that calls add_verb() and adds the verb's own options to the result. `globals` must outlive the app.
CLI::App& add_verb(CLI::App& app, GlobalOptions& globals, const std::string& name, const std::string& description,
                   std::function<int()> action);

/// Parses the command line, limits the number of threads, runs the verb and returns the exit code for main(). Errors
/// are printed to standard error. The exit code is that of an Error, 3 for lack of memory, 6 for file system errors and
/// 1 for internal errors. With --json, errors are also written as JSON (docs/json_output.md).
int run_verbs(CLI::App& app, GlobalOptions& globals, int argc, const char* const* argv);

/// Prints an error as run_verbs() does and returns its exit code. For verbs that continue after an error or have
/// already written their JSON.
int report_error(const Error& error);

/// Returns the number of threads to use: --threads, else the environment variable PACKTRACE_THREADS, else 0, which
/// means all hardware threads. Throws Error(kUsage) if the variable is not a valid number of threads.
uint32_t thread_limit(const GlobalOptions& globals);

/// Makes SIGINT and SIGTERM cancel the work cooperatively (Progress::cancel()). A second signal removes unfinished
/// output files and ends the process at once with exit code 7. SIGXFSZ is ignored, so that writing beyond the file size
/// limit fails with an error instead.
void install_interrupt_handlers();

/// True if the stream supports cursor movement: it is a terminal and TERM is not "dumb".
bool is_terminal(std::FILE* stream);
/// True if is_terminal(), and NO_COLOR is unset or empty.
bool wants_color(std::FILE* stream);

/// Prints text after printable() has escaped it, since names of files and of scene objects may contain control
/// characters. Write errors are detected when the verb ends.
void print_printable(std::string_view text, std::FILE* stream = stdout);

/// Formats diagnostics, one per line: errors always, warnings unless quiet, notes with -v. Without -v at most
/// kMaxShownProblems are listed, followed by a line with the number of the others.
std::string format_diagnostics(const Diagnostics& diagnostics, const GlobalOptions& globals, bool color);
inline constexpr size_t kMaxShownProblems = 20;

/// Prints format_diagnostics() to standard error.
void report_diagnostics(const Diagnostics& diagnostics, const GlobalOptions& globals);

/// Peak resident memory of this process in bytes, including mapped file pages.
uint64_t peak_rss_bytes();

} // namespace packtrace
