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

/// What every verb understands, and the verb that was given.
struct GlobalOptions {
  bool quiet = false;   ///< errors only
  int verbosity = 0;    ///< how often -v was given; 1 shows notes
  std::string json;     ///< where results go as JSON: a file, "-" for standard output, empty for nowhere
  bool force = false;   ///< existing files may be replaced
  uint32_t threads = 0; ///< 0: PACKTRACE_THREADS, or as many as the machine has
  MemoryBudget memory = MemoryBudget(); ///< for all that the input decides the size of
  std::function<int()> action;          ///< of the verb on the command line; returns the exit code
};

/// Adds the options of every verb to the program itself, so that they may stand before the verb too.
void add_global_options(CLI::App& app, GlobalOptions& globals);

/// Adds a verb that takes the global options too. A command's file offers
///   void add_NAME_command(CLI::App& app, GlobalOptions& globals);
/// which calls this and adds its own options to the result. `globals` must outlive the app.
CLI::App& add_verb(CLI::App& app, GlobalOptions& globals, const std::string& name, const std::string& description,
                   std::function<int()> action);

/// Parses the command line, limits the threads, and runs the verb: main() returns the result. Errors are printed to
/// standard error and become exit codes: those of Error, 2 for the command line, 3 for lack of memory, 6 for the file
/// system, 1 for what should not happen. With --json they are written there too (docs/json_output.md).
int run_verbs(CLI::App& app, GlobalOptions& globals, int argc, const char* const* argv);

/// Prints an error as run_verbs() does, for verbs that go on or have written their JSON. Returns its exit code.
int report_error(const Error& error);

/// How many threads may work: --threads, else the environment variable PACKTRACE_THREADS, else 0 for as many as the
/// machine has. Throws Error(kUsage) where the variable is no number of threads.
uint32_t thread_limit(const GlobalOptions& globals);

/// Makes SIGINT and SIGTERM stop the work cooperatively (Progress::cancel()). The second one ends the process at once
/// with exit code 7, after removing unfinished output files. SIGXFSZ is ignored: what writes beyond a limit of file
/// sizes gets an error.
void install_interrupt_handlers();

/// True where colours and cursor movements are welcome: a terminal, TERM is not "dumb".
bool is_terminal(std::FILE* stream);
/// is_terminal(), and NO_COLOR is unset or empty.
bool wants_color(std::FILE* stream);

/// Text for people, as printable() shows it: names from scenes and of files may hold anything. A failure to write shows
/// when the verb ends.
void print_printable(std::string_view text, std::FILE* stream = stdout);

/// The problems found, one after the other, each ending in a newline. Errors always; warnings unless quiet; notes
/// with -v. Without -v at most kMaxShownProblems, then a line that counts the rest.
std::string format_diagnostics(const Diagnostics& diagnostics, const GlobalOptions& globals, bool color);
inline constexpr size_t kMaxShownProblems = 20;

/// Prints format_diagnostics() to standard error.
void report_diagnostics(const Diagnostics& diagnostics, const GlobalOptions& globals);

} // namespace packtrace
