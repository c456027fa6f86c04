#include "runtime/commands/view/view_options.h"

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/render/lod_render.h"
#include "runtime/view/script.h"
#include "runtime/view/view_controls.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxProfile = 1'000'000;

/// Keys and script actions, as help shows them.
std::string viewer_footer() {
  std::string text = "Keys and mouse:\n";
  std::string_view group;
  for (const KeyHelp& key : key_help()) {
    if (key.group != group) text += fmt::format(" {}\n", group = key.group);
    text += fmt::format("  {:<16} {}\n", key.keys, key.text);
  }
  text += "\nA script has a JSON object per line, which names one action (docs/viewer.md):\n";
  for (const ScriptAction& action : script_actions()) text += fmt::format("  {:<11} {}\n", action.name, action.help);
  return text + "\nExamples:\n"
                "  packtrace view house.ptk\n"
                "  packtrace view house.ptk house.pbrt\n"
                "  packtrace view house.ptk --headless tour.jsonl\n"
                "  packtrace view house.ptk --profile 300 --csv frames.csv\n"
                "  packtrace view town.ptk --target-ms 0";
}

} // namespace

void add_viewer_options(CLI::App& verb, ViewOptions& options) {
  verb.add_option("FILE", options.files,
                  ".ptk files, or .pbrt scenes, which are traced as floats. Several are compared: the camera is the "
                  "first one's, and the second pane shows the second")
      ->required();
  add_view_options(verb, options.render);
  verb.add_option("--target-ms", options.target_ms,
                  fmt::format("Milliseconds that a frame may take while something moves: above, its resolution falls, "
                              "and then the number of its rays. 0 keeps the quality (default {} in a window, else 0)",
                              kWindowTargetMs))
      ->type_name("MS");
  verb.add_option("--settings", options.settings,
                  "Start with the views, settings and camera of a .toml file that the window saved")
      ->type_name("FILE");
  constexpr const char* kGroup = "Without a window";
  verb.add_option("--headless", options.script,
                  "Run a script instead of opening a window: a JSON object per line, with keys, camera, settings, "
                  "screenshots and picks. The same script gives the same bytes")
      ->type_name("SCRIPT")
      ->group(kGroup);
  verb.add_option("--profile", options.profile,
                  "Render as many frames of a turn about what the view shows, and report the times of their passes; "
                  "with --headless after the script")
      ->type_name("FRAMES")
      ->group(kGroup);
  verb.add_option("--csv", options.csv, "Write a table of the frames of --profile")->type_name("FILE")->group(kGroup);
  add_quality_options(verb, options.render);
  add_shade_options(verb, options.render.shade);
  add_tracer_options(verb, options.render);
  add_lod_options(verb, options.render.lod);
  add_scene_options(verb, options.render.scene);
  verb.footer(viewer_footer());
}

void validate(const ViewOptions& options) {
  if (options.target_ms && !(*options.target_ms >= 0.0 && *options.target_ms <= 1e6))
    throw Error(ErrorKind::kUsage, fmt::format("--target-ms {}: must be in [0, 1000000]", *options.target_ms));
  if (options.profile && (*options.profile < 1 || *options.profile > kMaxProfile))
    throw Error(ErrorKind::kUsage, fmt::format("--profile {}: must be in [1, {}]", *options.profile, kMaxProfile));
  if (options.csv && !options.profile) throw Error(ErrorKind::kUsage, "--csv requires --profile");
}

} // namespace packtrace
