#include "runtime/commands/cli_support.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <tbb/global_control.h>
#include <unistd.h>

#include "pbrt_import/scene/closest_name.h"
#include "pbrt_import/scene/error.h"
#include "pbrt_import/scene/output_file.h"
#include "pbrt_import/scene/progress.h"

namespace packtrace {

namespace {

constexpr int kInternalError = 1;
constexpr uint32_t kMaxThreads = 1024;

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
  std::string text = to_string(diagnostic);
  // The place may contain anything, so skip it before looking for the word.
  const std::string word = std::string(to_string(diagnostic.severity)) + ":";
  if (const size_t at = text.find(word, to_string(diagnostic.location).size()); at != std::string::npos) {
    text.insert(at + word.size(), "\x1b[0m");
    text.insert(at, color_of(diagnostic.severity));
  }
  return text;
}

int fail(const std::string& message, int exit_code) {
  const bool color = wants_color(stderr);
  const std::string text = std::string("packtrace: ") + (color ? "\x1b[31merror:\x1b[0m " : "error: ") + message + "\n";
  std::fwrite(text.data(), 1, text.size(), stderr);
  return exit_code;
}

/// What is wrong with the command line; of an option that is not there, which one is most like it.
std::string message_of(const CLI::ParseError& error, const CLI::App& app) {
  const auto verbs = app.get_subcommands();
  const std::vector<std::string> left = verbs.empty() ? std::vector<std::string>{} : verbs.front()->remaining();
  if (dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr || left.empty()) return error.what();
  const auto given = std::ranges::find_if(left, [](const std::string& word) { return word.starts_with("-"); });
  if (given == left.end()) return left.front() + ": one argument too many";
  const std::string name = given->substr(0, given->find('='));
  std::vector<std::string> names;
  for (const CLI::Option* option : verbs.front()->get_options())
    for (const std::string& known : option->get_lnames()) names.push_back("--" + known);
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string nearest(closest_name(name, known));
  return name + ": no such option" + (nearest.empty() ? "" : "; did you mean " + nearest + "?");
}

int parse(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& success) { // --help, --version
    app.exit(success);
    return 0;
  } catch (const CLI::ParseError& error) {
    const auto verbs = app.get_subcommands();
    const std::string command = "packtrace" + (verbs.empty() ? "" : " " + verbs.front()->get_name());
    return fail(message_of(error, app) + " (" + command + " --help explains)", static_cast<int>(ErrorKind::kUsage));
  }
}

/// CLI11 says "a subcommand is required" for no verb, or one that it does not know; this names it.
std::optional<std::string> unknown_verb(const CLI::App& app, int argc, const char* const* argv) {
  std::string known;
  for (const CLI::App* verb : app.get_subcommands({})) {
    if (argc >= 2 && verb->get_name() == argv[1]) return std::nullopt;
    if (!verb->get_group().empty()) known += (known.empty() ? "" : ", ") + verb->get_name();
  }
  if (argc < 2) return "a verb is needed: " + known + " (packtrace --help explains)";
  if (argv[1][0] == '-') return std::nullopt;
  return "unknown verb '" + std::string(argv[1]) + "'; there are " + known;
}

extern "C" void on_interrupt(int) {
  static_assert(std::atomic<bool>::is_always_lock_free);
  if (!Progress::cancelled()) return Progress::cancel();
  remove_unfinished_output();
  _exit(static_cast<int>(ErrorKind::kCancelled));
}

} // namespace

CLI::App& add_verb(CLI::App& app, GlobalOptions& globals, const std::string& name, const std::string& description,
                   std::function<int()> action) {
  CLI::App& verb = *app.add_subcommand(name, description);
  verb.callback([&globals, action = std::move(action)] { globals.action = action; });
  constexpr const char* kGroup = "Options of every verb";
  verb.add_flag("-q,--quiet", globals.quiet, "Print errors only")->group(kGroup);
  verb.add_flag("-v,--verbose", globals.verbosity, "Print more; may be repeated")->group(kGroup);
  verb.add_option("--json", globals.json, "Write results as JSON to FILE, or to standard output for -")
      ->type_name("FILE")
      ->group(kGroup);
  verb.add_flag("--force", globals.force, "Replace existing files")->group(kGroup);
  verb.add_option("--threads", globals.threads, "Use N threads (default: all)")
      ->check(CLI::Range(1u, kMaxThreads))
      ->type_name("N")
      ->group(kGroup);
  return verb;
}

int run_verbs(CLI::App& app, GlobalOptions& globals, int argc, const char* const* argv) {
  if (const auto problem = unknown_verb(app, argc, argv)) return fail(*problem, static_cast<int>(ErrorKind::kUsage));
  app.require_subcommand(1);
  if (const int code = parse(app, argc, argv); code != 0 || !globals.action) return code;
  try {
    std::optional<tbb::global_control> limit;
    if (globals.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, globals.threads);
    const int code = globals.action();
    // What is still buffered would otherwise be lost without a word, for example on a full disk.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      throw Error(ErrorKind::kIo, "cannot write to standard output");
    return code;
  } catch (const Error& error) {
    return fail(error.what(), error.exit_code());
  } catch (const std::bad_alloc&) {
    return fail("not enough memory", static_cast<int>(ErrorKind::kLimitExceeded));
  } catch (const std::system_error& error) { // of std::filesystem, or fmt::print on a full disk
    return fail(error.what(), static_cast<int>(ErrorKind::kIo));
  } catch (const std::exception& error) {
    return fail(std::string("internal: ") + error.what(), kInternalError);
  }
}

void install_interrupt_handlers() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool is_terminal(std::FILE* stream) {
  const char* term = std::getenv("TERM");
  return isatty(fileno(stream)) != 0 && !(term && std::string_view(term) == "dumb");
}

bool wants_color(std::FILE* stream) {
  const char* no_color = std::getenv("NO_COLOR");
  return is_terminal(stream) && !(no_color && *no_color);
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
    text += (color ? painted(diagnostic) : to_string(diagnostic)) + "\n";
  }
  if (hidden > 0) text += "... and " + std::to_string(hidden) + " more problems (-v shows all)\n";
  return text;
}

void report_diagnostics(const Diagnostics& diagnostics, const GlobalOptions& globals) {
  const std::string text = format_diagnostics(diagnostics, globals, wants_color(stderr));
  std::fwrite(text.data(), 1, text.size(), stderr);
}

} // namespace packtrace
