#include "runtime/commands/commands.h"

#include <functional>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/completion.h"
#include "runtime/commands/cli/man_page.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/option_list.h"

namespace packtrace {
namespace {

/// Adds a verb without the common options, which only apply to verbs that work on files.
CLI::App& add_plain_verb(CLI::App& app, GlobalOptions& globals, const char* name, const char* description,
                         std::function<void()> print) {
  CLI::App& verb = *app.add_subcommand(name, description)->group("About packtrace")->footer("");
  verb.callback([&globals, print = std::move(print)] {
    globals.action = [print] {
      print();
      return 0;
    };
  });
  return verb;
}

} // namespace

void add_help_commands(CLI::App& app, GlobalOptions& globals, const std::string& version) {
  const auto topic = std::make_shared<std::string>(), shell = std::make_shared<std::string>();
  CLI::App& help = add_plain_verb(app, globals, "help", "Show help for packtrace or one of its verbs", [&app, topic] {
    // App::help() would describe the parsed verb, which is `help` itself.
    const CLI::App& explained = topic->empty() ? app : *find_verb(app, *topic);
    const std::string name = topic->empty() ? app.get_name() : app.get_name() + " " + *topic;
    fmt::print("{}", app.get_formatter()->make_help(&explained, name, CLI::AppFormatMode::Normal));
  });
  add_plain_verb(app, globals, "version", "Print the version", [version] { fmt::print("{}\n", version); });
  CLI::App& completion =
      add_plain_verb(app, globals, "completion", "Print a completion script for bash, zsh or fish",
                     [&app, shell] { fmt::print("{}", completion_script(list_options(app), *shell)); });
  completion.add_option("SHELL", *shell, "Shell to print the script for")
      ->required()
      ->check(one_of(completion_shells()));
  completion.footer("The script completes verbs, options, their values and file names. Install it with\n"
                    "one of these commands:\n"
                    "  packtrace completion bash > ~/.local/share/bash-completion/completions/packtrace\n"
                    "  packtrace completion zsh > \"${fpath[1]}/_packtrace\"\n"
                    "  packtrace completion fish > ~/.config/fish/completions/packtrace.fish\n"
                    "or use it in the current bash only:\n"
                    "  source <(packtrace completion bash)");
  add_plain_verb(app, globals, "man", "Print the manual page",
                 [&app, version] { fmt::print("{}", man_page(list_options(app), version)); })
      .footer("Examples:\n"
              "  packtrace man | man -l -\n"
              "  packtrace man > ~/.local/share/man/man1/packtrace.1");
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands([](CLI::App* known) { return !known->get_group().empty(); }))
    verbs.push_back(verb->get_name());
  help.add_option("VERB", *topic, "Verb to describe")->check(one_of(verbs));
}

} // namespace packtrace
