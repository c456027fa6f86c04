#include "runtime/commands/cli/cli_support.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "pbrt_import/base/output_file.h"
#include "pbrt_import/base/printable.h"
#include "pbrt_import/base/progress.h"
#include "runtime/commands/cli/command_line.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/large_heaps.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/whole_number.h"

namespace packtrace {

namespace {

constexpr int kInternalError = 1;
constexpr uint32_t kMaxThreads = 1024;
constexpr const char* kThreadsVariable = "PACKTRACE_THREADS";

/// ANSI escape sequence for the colour of a severity.
const char* color_of(Severity severity) {
  switch (severity) {
  case Severity::kNote:
    return "\x1b[36m";
  case Severity::kWarning:
    return "\x1b[33m";
  case Severity::kError:
    return "\x1b[31m";
  }
  return "";
}

bool is_shown(Severity severity, const GlobalOptions& globals) {
  if (severity == Severity::kError) return true;
  return !globals.quiet && (severity == Severity::kWarning || globals.verbosity > 0);
}

/// The message with its severity ("error:") in colour.
std::string painted(const Diagnostic& diagnostic) {
  std::string text = printable(to_string(diagnostic));
  // The location may contain the word as well, so the search starts after it.
  const std::string word = std::string(to_string(diagnostic.severity)) + ":";
  if (const size_t at = text.find(word, printable(to_string(diagnostic.location)).size()); at != std::string::npos) {
    text.insert(at + word.size(), "\x1b[0m");
    text.insert(at, color_of(diagnostic.severity));
  }
  return text;
}

int print_failure(const std::string& message, int exit_code) {
  const bool color = wants_color(stderr);
  const std::string text =
      std::string("packtrace: ") + (color ? "\x1b[31merror:\x1b[0m " : "error: ") + printable(message) + "\n";
  std::fwrite(text.data(), 1, text.size(), stderr);
  return exit_code;
}

/// Flushes standard output, so that a failure, for example on a full disk, is reported.
void flush_output() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw Error(ErrorKind::kIo, "cannot write to standard output");
}

/// Parses the command line, runs its verb and returns the exit code.
int run_words(CLI::App& app, GlobalOptions& globals, std::span<const char* const> words) {
  int code = 0;
  if (parse_command_line(app, words)) {
    std::optional<tbb::global_control> limit;
    if (const uint32_t threads = thread_limit(globals); threads > 0)
      limit.emplace(tbb::global_control::max_allowed_parallelism, threads);
    prepare_heaps();
    code = globals.action();
  }
  flush_output();
  return code;
}

/// Whether error JSON may be written to the destination: it does not exist yet, is empty, or looks like JSON. Any other
/// file could be an input file that could not be read.
bool can_hold_error_json(const std::string& destination) {
  std::error_code unknown;
  if (destination == "-" || !std::filesystem::is_regular_file(destination, unknown)) return true;
  std::ifstream file(destination);
  char first = 0;
  return !(file >> first) || first == '{' || first == '[';
}

/// Writes a failure to the destination of --json. Like other outputs, an existing file is replaced only with --force.
void write_failure(CLI::App& app, const GlobalOptions& globals, std::span<const char* const> words,
                   nlohmann::json error) {
  // If parsing failed, globals.json is not set, so the value is searched for in the words.
  const std::string destination = globals.json.empty() ? value_in_words(words, "--json") : globals.json;
  if (destination.empty() || find_verb(app, destination)) return; // "--json info": the file name is missing
  if (!can_hold_error_json(destination)) {
    print_failure(destination + ": not a JSON file, so the error is not written to it", 0);
    return;
  }
  const bool force =
      globals.force || std::ranges::any_of(words, [](std::string_view word) { return word == "--force"; });
  const std::string verb = verb_in_words(app, words), message = error.at("message");
  try {
    JsonOutput(destination, force)
        .write({{"verb", verb.empty() ? nlohmann::json() : nlohmann::json(verb)}, {"error", std::move(error)}});
  } catch (const Error& second) {
    if (second.what() != message) print_failure(second.what(), second.exit_code());
  }
}

void add_options_of_every_verb(CLI::App& app, GlobalOptions& globals) {
  constexpr const char* kGroup = "Common options";
  app.add_flag("-q,--quiet", globals.quiet, "Print errors only")->group(kGroup);
  app.add_flag_function(
         "-v,--verbose", [&globals](int64_t count) { globals.verbosity += static_cast<int>(count); },
         "Also print notes, the chosen settings with their reasons, and details per geometry")
      ->group(kGroup);
  app.add_option(
         "--json", globals.json,
         "Write the results, or the error, as JSON to FILE (- for standard output). See docs/json_output.md for "
         "the keys")
      ->type_name("FILE")
      ->take_last()
      ->group(kGroup);
  app.add_flag("--force", globals.force, "Replace existing output files")->group(kGroup);
  app.add_option(
         "--threads", globals.threads,
         fmt::format("Number of threads, 1..{} (default: the environment variable {}, else all hardware threads)",
                     kMaxThreads, kThreadsVariable))
      ->check(CLI::Range(1u, kMaxThreads))
      ->type_name("N")
      ->take_last()
      ->group(kGroup);
  app.add_option_function<std::string>(
         "--max-memory",
         [&globals](const std::string& text) {
           try {
             globals.memory = MemoryBudget(parse_memory_size(text, machine_memory()));
           } catch (const Error& error) {
             throw CLI::ValidationError("--max-memory", error.what());
           }
         },
         "Memory limit for data whose size the input determines, in bytes or as 512M, 8G or 50% of the machine's "
         "memory (default 50%). Input that needs more fails with exit code 3")
      ->type_name("SIZE")
      ->take_last()
      ->group(kGroup);
}

extern "C" void on_interrupt(int) {
  static_assert(std::atomic<bool>::is_always_lock_free);
  if (!Progress::cancelled()) return Progress::cancel();
  remove_unfinished_output();
  _exit(static_cast<int>(ErrorKind::kCancelled));
}

} // namespace

void add_global_options(CLI::App& app, GlobalOptions& globals) { add_options_of_every_verb(app, globals); }

CLI::App& add_verb(CLI::App& app, GlobalOptions& globals, const std::string& name, const std::string& description,
                   std::function<int()> action) {
  CLI::App& verb = *app.add_subcommand(name, description)->group("Verbs");
  verb.callback([&globals, action = std::move(action)] { globals.action = action; });
  verb.option_defaults()->take_last(); // lets scripts and aliases override options by appending them
  add_options_of_every_verb(verb, globals);
  return verb;
}

int run_verbs(CLI::App& app, GlobalOptions& globals, int argc, const char* const* argv) {
  const std::span words(argv, static_cast<size_t>(std::max(argc, 0)));
  const std::span behind_name = words.subspan(std::min<size_t>(1, words.size()));
  const auto fail = [&](const nlohmann::json& error) {
    print_failure(error.at("message"), error.at("exit_code"));
    write_failure(app, globals, behind_name, error);
    return error.at("exit_code").get<int>();
  };
  try {
    return run_words(app, globals, behind_name);
  } catch (const Error& error) {
    return fail(error_json(error));
  } catch (const std::bad_alloc&) {
    return fail(error_json(MemoryError(kNoMemory)));
  } catch (const std::system_error& error) { // from std::filesystem, std::thread, or from fmt::print on a full disk
    if (error.code() == std::errc::resource_unavailable_try_again) return fail(error_json(MemoryError(kNoMemory)));
    return fail(error_json("io", static_cast<int>(ErrorKind::kIo), error.what()));
  } catch (const std::exception& error) {
    return fail(error_json("internal", kInternalError, std::string("internal: ") + error.what()));
  }
}

int report_error(const Error& error) { return print_failure(error.what(), error.exit_code()); }

uint32_t thread_limit(const GlobalOptions& globals) {
  if (globals.threads > 0) return globals.threads;
  const char* variable = std::getenv(kThreadsVariable);
  const std::string_view text = variable ? variable : "";
  if (text.empty()) return 0;
  const std::optional<uint32_t> threads = whole_number(text);
  if (!threads || *threads < 1 || *threads > kMaxThreads)
    throw Error(ErrorKind::kUsage, fmt::format("{} is '{}'; set it to a number of threads from 1 to {}, or unset it",
                                               kThreadsVariable, text, kMaxThreads));
  return *threads;
}

namespace {

/// Libraries start threads where no handler of this program sees the error.
[[noreturn]] void on_terminate() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::exception& error) {
    const std::string_view problem = error.what();
    const bool no_thread = problem.find("pthread_create") != problem.npos;
    if (no_thread || dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
      std::fprintf(stderr, "packtrace: error: %s (%s)\n", kNoMemory, error.what());
      std::_Exit(static_cast<int>(ErrorKind::kInput));
    }
    std::fprintf(stderr, "packtrace: internal: %s\n", error.what());
  }
  std::abort();
}

} // namespace

void install_interrupt_handlers() {
  std::set_terminate(on_terminate);
  struct sigaction action{};
  action.sa_handler = on_interrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // Writing beyond the file size limit then fails with EFBIG, which is reported like a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
}

bool is_terminal(std::FILE* stream) {
  const char* term = std::getenv("TERM");
  return isatty(fileno(stream)) != 0 && !(term && std::string_view(term) == "dumb");
}

bool wants_color(std::FILE* stream) {
  const char* no_color = std::getenv("NO_COLOR");
  return is_terminal(stream) && !(no_color && *no_color);
}

void print_printable(std::string_view text, std::FILE* stream) {
  const std::string shown = printable(text);
  std::fwrite(shown.data(), 1, shown.size(), stream);
}

std::string format_diagnostics(const Diagnostics& diagnostics, const GlobalOptions& globals, bool color) {
  std::string text;
  size_t shown = 0, hidden = 0;
  for (const Diagnostic& diagnostic : diagnostics.entries()) {
    if (!is_shown(diagnostic.severity, globals)) continue;
    if (shown == kMaxShownProblems && globals.verbosity == 0) {
      ++hidden;
      continue;
    }
    ++shown;
    text += (color ? painted(diagnostic) : printable(to_string(diagnostic))) + "\n";
  }
  if (hidden > 0) text += "... and " + std::to_string(hidden) + " more problems (-v shows all)\n";
  return text;
}

void report_diagnostics(const Diagnostics& diagnostics, const GlobalOptions& globals) {
  const std::string text = format_diagnostics(diagnostics, globals, wants_color(stderr));
  std::fwrite(text.data(), 1, text.size(), stderr);
}

uint64_t peak_rss_bytes() {
  // getrusage() would count the program that started this one, whose memory the process had before exec().
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stoull(line.substr(6)) * 1024;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<uint64_t>(usage.ru_maxrss) * 1024; // Linux reports KiB
}

} // namespace packtrace
