#include "runtime/commands/cli/cli_support.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"
#include "pbrt_import/base/progress.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/whole_number.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

struct Outcome {
  int code = -1;
  std::string out, err;
};

/// Runs a program with a single verb, "go", which performs `action`.
Outcome run(std::vector<const char*> arguments, std::function<int(const GlobalOptions&)> action) {
  CLI::App app("test");
  GlobalOptions globals;
  add_verb(app, globals, "go", "Goes", [&] { return action(globals); });
  arguments.insert(arguments.begin(), "packtrace");
  Outcome result;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  result.code = run_verbs(app, globals, static_cast<int>(arguments.size()), arguments.data());
  result.out = testing::internal::GetCapturedStdout();
  result.err = testing::internal::GetCapturedStderr();
  return result;
}

TEST(CliSupport, GlobalOptionsReachTheVerb) {
  GlobalOptions seen;
  const Outcome result =
      run({"go", "-q", "-vv", "--json", "-", "--force", "--threads", "3"}, [&](const GlobalOptions& globals) {
        seen = globals;
        EXPECT_EQ(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism), 3u);
        return 0;
      });
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_TRUE(seen.quiet);
  EXPECT_EQ(seen.verbosity, 2);
  EXPECT_EQ(seen.json, "-");
  EXPECT_TRUE(seen.force);
}

TEST(CliSupport, WrongCommandLinesExitWithTwoAndRunNothing) {
  const auto never = [](const GlobalOptions&) {
    ADD_FAILURE() << "the verb ran";
    return 0;
  };
  for (const std::vector<const char*>& arguments : {std::vector<const char*>{},
                                                    {"stop"},
                                                    {"go", "--unknown"},
                                                    {"go", "--threads", "0"},
                                                    {"go", "--threads", "-1"},
                                                    {"go", "--threads", "many"},
                                                    {"go", "extra"},
                                                    {"go", "--json"}}) {
    const Outcome result = run(arguments, never);
    EXPECT_EQ(result.code, 2);
    EXPECT_FALSE(result.err.empty());
  }
}

TEST(CliSupport, HelpIsASuccess) {
  for (const std::vector<const char*>& arguments : {std::vector<const char*>{"--help"}, {"go", "--help"}}) {
    const Outcome result = run(arguments, [](const GlobalOptions&) { return 9; });
    EXPECT_EQ(result.code, 0);
    EXPECT_NE(result.out.find("go"), std::string::npos);
  }
}

TEST(CliSupport, ErrorsBecomeExitCodesAndOneLine) {
  for (const ErrorKind kind : {ErrorKind::kUsage, ErrorKind::kInput, ErrorKind::kUnsupported, ErrorKind::kLimitExceeded,
                               ErrorKind::kIo, ErrorKind::kCancelled}) {
    const Outcome result = run({"go"}, [&](const GlobalOptions&) -> int { throw Error(kind, "a.ptk: broken"); });
    EXPECT_EQ(result.code, static_cast<int>(kind));
    EXPECT_EQ(result.err, "packtrace: error: a.ptk: broken\n");
    EXPECT_EQ(result.out, "");
  }
  EXPECT_EQ(run({"go"}, [](const GlobalOptions&) -> int { throw std::bad_alloc(); }).code, 3);
  EXPECT_EQ(run({"go"}, [](const GlobalOptions&) -> int { throw std::logic_error("no"); }).code, 1);
  EXPECT_EQ(run({"go"}, [](const GlobalOptions&) { return 4; }).code, 4);
}

TEST(CliSupport, LostOutputIsAnIoError) {
  struct Guard { // runs in a child process, because it redirects the stdout of its process
    static void run() {
      CLI::App app("test");
      GlobalOptions globals;
      add_verb(app, globals, "go", "Goes", [] { return std::puts("a line that stays in the buffer") < 0 ? 1 : 0; });
      const std::array<const char*, 2> arguments{"packtrace", "go"};
      const bool full = std::freopen("/dev/full", "w", stdout) != nullptr;
      std::_Exit(full ? run_verbs(app, globals, 2, arguments.data()) : 1);
    }
  };
  EXPECT_EXIT(Guard::run(), testing::ExitedWithCode(6), "cannot write to standard output");
}

TEST(CliSupport, TheFirstInterruptCancels) {
  EXPECT_EXIT(
      {
        install_interrupt_handlers();
        std::raise(SIGINT);
        std::_Exit(Progress::cancelled() ? 42 : 1);
      },
      testing::ExitedWithCode(42), "");
}

TEST(CliSupport, TheSecondInterruptEndsWithoutLeavingFiles) {
  const TemporaryFolder folder;
  EXPECT_EXIT(
      {
        const OutputFile file(folder / "a", false);
        install_interrupt_handlers();
        std::raise(SIGTERM);
        std::raise(SIGINT);
        std::_Exit(1);
      },
      testing::ExitedWithCode(7), "");
  EXPECT_EQ(folder.files(), 0u);
}

void report_some_problems(Diagnostics& diagnostics) {
  const auto file = std::make_shared<const SourceFile>(SourceFile{"error: a.pbrt", {}});
  diagnostics.report(Severity::kNote, {file, 1, 1}, "a note", 1);
  diagnostics.report(Severity::kWarning, {file, 2, 1}, "a warning", 2);
  diagnostics.report(Severity::kError, {file, 3, 1}, "an error", 3);
}

TEST(CliSupport, DiagnosticsAreShownByVerbosity) {
  Diagnostics diagnostics;
  report_some_problems(diagnostics);
  const auto lines = [&](bool quiet, int verbosity) {
    GlobalOptions globals;
    globals.quiet = quiet, globals.verbosity = verbosity;
    const std::string text = format_diagnostics(diagnostics, globals, false);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines(true, 0), 1);
  EXPECT_EQ(lines(false, 0), 2);
  EXPECT_EQ(lines(false, 1), 3);
}

TEST(CliSupport, ColourMarksTheSeverityAndNotThePlace) {
  Diagnostics diagnostics;
  report_some_problems(diagnostics);
  GlobalOptions globals;
  globals.quiet = true;
  EXPECT_EQ(format_diagnostics(diagnostics, globals, true), "error: a.pbrt:3:1: \x1b[31merror:\x1b[0m an error\n");
  EXPECT_EQ(format_diagnostics(diagnostics, globals, false), "error: a.pbrt:3:1: error: an error\n");
}

TEST(CliSupport, ManyProblemsAreCountedInsteadOfShown) {
  Diagnostics diagnostics;
  for (uint64_t i = 0; i < 50; ++i) diagnostics.report(Severity::kWarning, {}, "problem " + std::to_string(i), i);
  GlobalOptions globals;
  const std::string few = format_diagnostics(diagnostics, globals, false);
  EXPECT_EQ(std::count(few.begin(), few.end(), '\n'), static_cast<ptrdiff_t>(kMaxShownProblems) + 1);
  EXPECT_NE(few.find("30 more"), std::string::npos) << few;
  globals.verbosity = 1;
  const std::string all = format_diagnostics(diagnostics, globals, false);
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 50);
}

TEST(CliSupport, FilesAreNoTerminals) {
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  EXPECT_FALSE(is_terminal(file));
  EXPECT_FALSE(wants_color(file));
  std::fclose(file);
}

TEST(WholeNumber, IsDigitsAlone) {
  EXPECT_EQ(whole_number("0"), 0u);
  EXPECT_EQ(whole_number("4294967295"), 4294967295u);
  for (const char* text : {"", "auto", "-1", "+1", " 1", "1 ", "1.5", "0x1", "4294967296"})
    EXPECT_EQ(whole_number(text), std::nullopt) << text;
}

TEST(NumberIn, IncludesBothEnds) {
  const CLI::Validator check = number_in(0.5, 8.0);
  for (const char* const text : {"0.5", "3", "8"}) EXPECT_EQ(check(std::string(text)), "") << text;
  for (const char* const text : {"0.499", "8.001", "-1", "nan", "wide"})
    EXPECT_NE(check(std::string(text)), "") << text;
}

} // namespace
} // namespace packtrace
