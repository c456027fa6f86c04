#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/commands.h"
#include "runtime/commands/render/render_camera.h"
#include "runtime/commands/view/view_files.h"
#include "runtime/commands/view/view_options.h"
#include "runtime/commands/view/view_outputs.h"
#include "runtime/commands/view/view_window.h"
#include "runtime/view/profile.h"

namespace packtrace {
namespace {

constexpr uint64_t kMaxScriptBytes = uint64_t{1} << 26;
constexpr ImageSize kWindow{960, 540}; ///< default of --size

bool opens_window(const ViewOptions& options) { return !options.script && !options.profile; }

ImageSize view_size(const ViewOptions& options) {
  return options.render.size.empty() ? kWindow : parse_size(options.render.size);
}

/// Loads the files and makes the view of them.
std::unique_ptr<ViewSession> make_session(const ViewOptions& options, const GlobalOptions& globals,
                                          ProgressDisplay& display, Progress& progress) {
  const DetailConfig detail = detail_config(options.render.lod, false);
  ViewSession::Config config;
  config.size = view_size(options);
  config.frame = frame_config(options.render, detail);
  config.frame.size = config.size;
  config.frame.validate();
  config.target_ms = options.target_ms.value_or(opens_window(options) ? kWindowTargetMs : 0.0);
  config.memory = globals.memory;
  std::vector<ViewFile> files;
  for (const std::string& name : options.files)
    files.push_back(load_view_file(name, options.render, globals, detail, progress, display));
  ViewCamera camera = start_camera(files.front(), options.render, globals);
  return std::make_unique<ViewSession>(std::move(files), std::move(camera), config);
}

/// Renders a frame to see what is in the middle of the view, which becomes the camera's pivot. Frames the whole scene
/// if the camera of the start sees nothing and was not asked for.
void find_pivot(ViewSession& session, const ViewOptions& options, const GlobalOptions& globals, Progress& progress) {
  session.step_once(progress);
  const ImageSize size = session.size();
  if (!session.last().report.seen && !options.render.camera) {
    const SceneSource& source = *session.files().front().at_rest.source;
    if (!globals.quiet)
      print_printable(options.files.front() + ": warning: the camera sees nothing; showing the whole scene\n", stderr);
    ViewCamera framing(framing_camera(source.world_bounds(), size, source.cameras()), source.origin(), DVec3(0, 1, 0),
                       source.world_bounds().diagonal());
    session.move_camera([&](ViewCamera& camera) { camera.set(framing.current_key()); });
    session.step_once(progress);
  }
  session.set_pivot(size.width / 2, size.height / 2);
}

bool has_picks(const std::vector<ScriptLine>& script) {
  return std::ranges::any_of(script, [](const ScriptLine& line) { return line.action == "pick"; });
}

/// Makes the session as the viewer begins with it.
/// @param keep_views ViewSession::keep_views()
/// @param observer gets the progress, besides standard error; may be empty
std::unique_ptr<ViewSession> start_session(const ViewOptions& options, const GlobalOptions& globals, bool keep_views,
                                           const Progress::Observer& observer) {
  ProgressDisplay display(globals);
  Progress progress(observer ? both(display.observer(), observer) : display.observer());
  std::unique_ptr<ViewSession> session = make_session(options, globals, display, progress);
  session->keep_views(keep_views);
  if (options.render.shade.shades()) session->set_layer(0, options.render.shade.view);
  display.finish();
  Progress first_frame(observer);
  find_pivot(*session, options, globals, first_frame);
  if (options.settings) restore_settings(*options.settings, *session);
  return session;
}

/// Runs the profile and writes its table. Returns its report.
nlohmann::json run_profile(ViewSession& session, const ViewOptions& options, const GlobalOptions& globals,
                           Progress& progress) {
  std::unique_ptr<OutputFile> csv;
  if (options.csv) csv = std::make_unique<OutputFile>(*options.csv, globals.force);
  const std::vector<ProfileRow> rows = profile_orbit(session, *options.profile, progress);
  if (csv) {
    const std::string table = profile_csv(rows);
    csv->write(std::as_bytes(std::span(table)));
    csv->commit();
  }
  return profile_json(rows);
}

void print_profile(const nlohmann::json& profile) {
  const auto row = [](const std::string& name, const nlohmann::json& spread) {
    fmt::print("  {:<9}{:9.1f} ms, 99 % below {:.1f} ms\n", name, spread.at("median_ms").get<double>(),
               spread.at("p99_ms").get<double>());
  };
  fmt::print("{} frames\n", profile.at("frames").get<uint64_t>());
  row("a frame", profile.at("total"));
  for (const auto& [name, member] : kPasses)
    if (profile.at("passes").at(name).at("max_ms").get<double>() > 0.0) row(name, profile.at("passes").at(name));
}

int run_viewer(const ViewOptions& options, const GlobalOptions& globals) {
  validate(options);
  std::vector<ScriptLine> script;
  if (options.script) {
    const std::vector<std::byte> bytes = read_file_bytes(*options.script, kMaxScriptBytes);
    script = parse_script({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, *options.script);
  }
  JsonOutput json(globals.json, globals.force);
  ViewOutputs outputs(globals);
  nlohmann::json result = {{"verb", "view"}, {"inputs", options.files}};
  const bool window = opens_window(options);
  if (window) {
    show_in_window(
        view_size(options),
        // Picks follow the mouse.
        [&](const Progress::Observer& observer) { return start_session(options, globals, true, observer); }, options,
        globals, outputs);
    result["results"] = outputs.results();
  }
  std::unique_ptr<ViewSession> session;
  if (!window) session = start_session(options, globals, has_picks(script), {});
  Progress progress;
  if (options.script) {
    ViewControls controls(*session);
    run_script(script, *options.script, *session, controls, outputs, progress);
    result["results"] = outputs.results();
  }
  if (options.profile) {
    result["profile"] = run_profile(*session, options, globals, progress);
    if (!json.to_stdout() && !globals.quiet) print_profile(result["profile"]);
  }
  result["peak_rss_bytes"] = peak_rss_bytes();
  if (json.wanted()) json.write(result);
  return 0;
}

} // namespace

void add_view_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<ViewOptions>();
  CLI::App& verb = add_verb(app, globals, "view", "Look at .ptk files and .pbrt scenes, live or by a script",
                            [options, &globals] { return run_viewer(*options, globals); });
  add_viewer_options(verb, *options);
}

} // namespace packtrace
