// Compares shell completions and the manual page with the options that --help lists.

#include <cstdlib>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/end_to_end/workbench.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

const std::vector<std::string> kVerbs{"bake",   "info", "render",  "denoise",    "compare",
                                      "export", "help", "version", "completion", "man"};

/// Short and long options that a verb's help lists at the start of its lines.
std::set<std::string> options_of(const std::string& verb) {
  const std::string help = run_packtrace({verb, "--help"}).out;
  std::set<std::string> options;
  const std::regex line("\n  (-[^ ]+)"), name("--?[a-zA-Z][a-zA-Z0-9-]*");
  for (std::sregex_iterator found(help.begin(), help.end(), line), end; found != end; ++found) {
    const std::string names = (*found)[1];
    for (std::sregex_iterator option(names.begin(), names.end(), name); option != end; ++option)
      options.insert(option->str());
  }
  EXPECT_TRUE(options.contains("--help")) << help;
  return options;
}

bool is_installed(const std::string& program) {
  return run_program("sh", {"-c", "command -v " + program}).exit_code == 0;
}

/// Returns the part of a text from one marker to another.
std::string between(const std::string& text, const std::string& from, const std::string& to) {
  const size_t begin = text.find(from);
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find(to, begin + from.size()) - begin);
}

TEST(Completion, BashKnowsEachOptionOfEachVerb) {
  const std::string script = run_packtrace({"completion", "bash"}).out;
  for (const std::string& verb : kVerbs) {
    const std::string part = between(script, "\n    " + verb + ")\n", "fi ;;\n");
    for (const std::string& option : options_of(verb))
      EXPECT_TRUE(std::regex_search(part, std::regex("[\" ]" + option + "[\" ]"))) << verb << ' ' << option;
  }
}

TEST(Completion, ZshKnowsEachOptionOfEachVerb) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const std::string script = run_packtrace({"completion", "zsh"}).out;
  for (const std::string& verb : kVerbs) {
    const std::string part = between(script, "\n      " + verb + ") _arguments", " ;;\n");
    for (const std::string& option : options_of(verb))
      EXPECT_TRUE(std::regex_search(part, std::regex("'\\*?" + option + "[+=-]*\\["))) << verb << ' ' << option;
  }
}

TEST(Completion, FishKnowsEachOptionOfEachVerb) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const std::string script = run_packtrace({"completion", "fish"}).out;
  for (const std::string& verb : kVerbs)
    for (const std::string& option : options_of(verb)) {
      const std::string flag = option.starts_with("--") ? " -l " + option.substr(2) : " -s " + option.substr(1);
      EXPECT_TRUE(std::regex_search(script, std::regex("seen_subcommand_from " + verb + "'[^\n]*" + flag + "[ \n]")))
          << verb << ' ' << option;
    }
}

TEST(Completion, TheManualPageHasEachOptionOfEachVerb) {
  std::string page = run_packtrace({"man"}).out;
  page = std::regex_replace(page, std::regex("\\\\-"), "-");
  for (const std::string& verb : kVerbs) {
    const std::string part = between(page, ".SS " + verb + "\n", ".SS ") + between(page, ".SH OPTIONS", ".SH VERBS");
    for (const std::string& option : options_of(verb))
      EXPECT_NE(part.find("\\fB" + option + "\\fR"), std::string::npos) << verb << ' ' << option;
  }
}

/// Shells, named by the program that reads their scripts.
class CompletionScript : public testing::TestWithParam<const char*> {};

TEST_P(CompletionScript, IsAcceptedByItsShell) {
  const std::string shell = GetParam();
  if (!is_installed(shell)) GTEST_SKIP() << shell << " is not installed";
  const TemporaryFolder folder;
  write_text(folder / "script", run_packtrace({"completion", shell}).out);
  const CommandResult checked = run_program(shell, {"-n", folder / "script"});
  EXPECT_EQ(checked.exit_code, 0);
  EXPECT_EQ(checked.err, "");
}

INSTANTIATE_TEST_SUITE_P(Shells, CompletionScript, testing::Values("bash", "zsh", "fish"));

TEST(Completion, TheManualPageIsAcceptedByMandoc) {
  if (!is_installed("mandoc")) GTEST_SKIP() << "mandoc is not installed";
  const TemporaryFolder folder;
  write_text(folder / "packtrace.1", run_packtrace({"man"}).out);
  const CommandResult checked = run_program("mandoc", {"-T", "lint", "-W", "warning", folder / "packtrace.1"});
  // The page has no date: a build date would make its text differ between builds of the same program.
  EXPECT_EQ(std::regex_replace(checked.out, std::regex(".*missing date.*\n"), ""), "");
}

TEST(Completion, TheManualPageIsAcceptedByGroff) {
  if (!is_installed("groff")) GTEST_SKIP() << "groff is not installed";
  const TemporaryFolder folder;
  write_text(folder / "packtrace.1", run_packtrace({"man"}).out);
  const CommandResult checked = run_program("groff", {"-man", "-ww", "-z", folder / "packtrace.1"});
  EXPECT_EQ(checked.exit_code, 0);
  EXPECT_EQ(checked.err, "");
}

/// Returns bash's completions for the last of the words.
std::string bash_offers(const std::string& words, const std::filesystem::path& folder) {
  const std::string script = R"(
    source <("$0" completion bash)
    COMP_WORDS=()" + words + R"()
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
    _packtrace
    printf '%s\n' "${COMPREPLY[@]}")";
  return run_program("bash", {"-c", script, packtrace_program()}, {}, folder).out;
}

TEST(Completion, BashOffersVerbsValuesAndFiles) {
  const Workbench bench;
  EXPECT_EQ(bash_offers("packtrace ren", bench.path()), "render\n");
  EXPECT_EQ(bash_offers("packtrace -q exp", bench.path()), "export\n");
  EXPECT_EQ(bash_offers("packtrace bake --cod", bench.path()), "--codec\n");
  EXPECT_EQ(bash_offers("packtrace bake --codec s", bench.path()), "small\n");
  EXPECT_EQ(bash_offers("packtrace bake --codec = f", bench.path()), "fast\n");
  EXPECT_EQ(bash_offers("packtrace bake sm", bench.path()), "small.pbrt\n");
  EXPECT_EQ(bash_offers("packtrace completion z", bench.path()), "zsh\n");
  EXPECT_EQ(bash_offers("packtrace render --frames 1", bench.path()), "\n") << "any number";
}

TEST(Completion, UnknownShellsAreRefused) {
  EXPECT_EQ(run_packtrace({"completion"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"completion", "tcsh"}).exit_code, 2);
}

} // namespace
} // namespace packtrace::test
