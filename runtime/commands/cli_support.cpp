#include "runtime/commands/cli_support.h"

#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <new>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>
#include <unistd.h>

#include "pbrt_import/base/output_file.h"
#include "pbrt_import/base/printable.h"
#include "pbrt_import/base/progress.h"
#include "runtime/commands/arguments.h"
#include "runtime/commands/command_line.h"
#include "runtime/commands/json_output.h"
#include "runtime/commands/option_checks.h"

namespace packtrace {

namespace {

constexpr int kInternalError = 1;
constexpr uint32_t kMaxThreads = 1024;
constexpr const char* kThreadsVariable = "PACKTRACE_THREADS";

/// ANSI colour per severity.
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

/// The message with its "error:" in colour.
std::string painted(const Diagnostic& diagnostic) {
  std::string text = printable(to_string(diagnostic));
  // The place may contain anything, so skip it before looking for the word.
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

/// What is still buffered would otherwise be lost without a word, for example on a full disk.
void flush_output() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw Error(ErrorKind::kIo, "cannot write to standard output");
}

/// Parses the words and runs their verb. Returns its exit code.
int run_words(CLI::App& app, GlobalOptions& globals, std::span<const char* const> words) {
  int code = 0;
  if (parse_command_line(app, words)) {
    std::optional<tbb::global_control> limit;
    if (const uint32_t threads = thread_limit(globals); threads > 0)
      limit.emplace(tbb::global_control::max_allowed_parallelism, threads);
    code = globals.action();
  }
  flush_output();
  return code;
}

/// Whether an error may be written there: where there is nothing yet, or results. What is no JSON may be a file of the
/// scene that could not be read.
bool may_take_error(const std::string& destination) {
  std::error_code unknown;
  if (destination == "-" || !std::filesystem::is_regular_file(destination, unknown)) return true;
  std::ifstream file(destination);
  char first = 0;
  return !(file >> first) || first == '{' || first == '[';
}

/// Writes a failure to where --json goes. A file that is there stays unless --force was given, like any other output.
void write_failure(CLI::App& app, const GlobalOptions& globals, std::span<const char* const> words,
                   nlohmann::json error) {
  // Where the words could not be parsed, no option has its value.
  const std::string destination = globals.json.empty() ? value_in_words(words, "--json") : globals.json;
  if (destination.empty() || find_verb(app, destination)) return; // "--json info": the name was forgotten
  if (!may_take_error(destination)) {
    print_failure(destination + ": holds something else than JSON, so the error is not written there", 0);
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
  constexpr const char* kGroup = "Options of every verb";
  app.add_flag("-q,--quiet", globals.quiet, "Print errors only")->group(kGroup);
  app.add_flag_function(
         "-v,--verbose", [&globals](int64_t count) { globals.verbosity += static_cast<int>(count); },
         "Print more; may be repeated")
      ->group(kGroup);
  app.add_option("--json", globals.json, "Write results, or the error, as JSON to FILE, or to standard output for -")
      ->type_name("FILE")
      ->take_last()
      ->group(kGroup);
  app.add_flag("--force", globals.force, "Replace existing files")->group(kGroup);
  app.add_option("--threads", globals.threads,
                 fmt::format("Use N threads, 1..{} (default: the environment variable {}, else all)", kMaxThreads,
                             kThreadsVariable))
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
         "Memory that the input may take: bytes, 512M, 8G, or 50% of the machine's (the default). Input that needs "
         "more ends with exit code 3")
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
  verb.option_defaults()->take_last(); // as scripts and aliases expect that append to a command
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
  } catch (const std::system_error& error) { // of std::filesystem, or fmt::print on a full disk
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
  uint32_t threads = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), threads);
  if (error != std::errc() || end != text.data() + text.size() || threads < 1 || threads > kMaxThreads)
    throw Error(ErrorKind::kUsage, fmt::format("{} is '{}'; give a number of threads from 1 to {}, or unset it",
                                               kThreadsVariable, text, kMaxThreads));
  return threads;
}

void install_interrupt_handlers() {
  struct sigaction action{};
  action.sa_handler = on_interrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // Writing beyond a limit of file sizes fails with EFBIG instead, which is reported like a full disk.
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

} // namespace packtrace
