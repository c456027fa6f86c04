#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/help_formatter.h"
#include "runtime/commands/commands.h"

int main(int argc, char** argv) {
  packtrace::install_interrupt_handlers();
  CLI::App app("packtrace: bake pbrt-v3 scenes into compact, ray-traceable files and render their ambient occlusion",
               "packtrace");
  const std::string version = "packtrace " PACKTRACE_VERSION;
  app.set_version_flag("-V,--version", version, "Print the version and exit");
  app.formatter(std::make_shared<packtrace::HelpFormatter>());
  app.footer("'packtrace help VERB' shows the options of a verb, with examples. Typical use:\n"
             "  packtrace bake scene.pbrt -o scene.ptk\n"
             "  packtrace info scene.ptk\n"
             "  packtrace render scene.ptk -o scene.png\n"
             "Exit codes: 0 success, 1 internal error, 2 wrong command line, 3 unusable input\n"
             "or too little memory, 4 unsupported feature, 5 limit exceeded (compare),\n"
             "6 I/O error, 7 cancelled.");
  packtrace::GlobalOptions globals;
  packtrace::add_global_options(app, globals);
  packtrace::add_bake_command(app, globals);
  packtrace::add_info_command(app, globals);
  packtrace::add_render_command(app, globals);
  packtrace::add_denoise_command(app, globals);
  packtrace::add_compare_command(app, globals);
  packtrace::add_export_command(app, globals);
  packtrace::add_measure_command(app, globals, PACKTRACE_VERSION);
  packtrace::add_view_command(app, globals);
  packtrace::add_help_commands(app, globals, version);
  return packtrace::run_verbs(app, globals, argc, argv);
}
