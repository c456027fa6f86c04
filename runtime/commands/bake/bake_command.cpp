#include "runtime/commands/commands.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/with_file.h"
#include "pbrt_import/ply_sequence.h"
#include "pbrt_import/scene/separate_motion.h"
#include "runtime/commands/bake/bake_options.h"
#include "runtime/commands/bake/bake_report.h"
#include "runtime/commands/bake/bake_target.h"
#include "runtime/commands/bake/level_chain_file.h"
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/motion/motion_keys.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Advice on how to produce a file of the type that the output's extension names.
std::string advice_for(const BakeOptions& options) {
  const std::filesystem::path output(options.output);
  const std::string baked = std::filesystem::path(output).replace_extension(".ptk").string(),
                    ending = ending_of(output);
  const char* verb = nullptr;
  if (ending == ".glb" || ending == ".gltf" || ending == ".v16") verb = "export";
  if (ending == ".png" || ending == ".exr") verb = "render";
  if (!verb) return "use the extension .ptk: -o " + shell_word(baked);
  const std::string wanted =
      ending == ".gltf" ? std::filesystem::path(output).replace_extension(".glb").string() : options.output;
  return fmt::format("bake to {}, then packtrace {} {} -o {}", shell_word(baked), verb, shell_word(baked),
                     shell_word(wanted));
}

/// @param output null for a dry run
void print_results(BinaryOutput* output, const BakeReport& baked, const ImportResult& imported,
                   const BakeTimings& timings, const GlobalOptions& globals) {
  std::FILE* const text = output != nullptr ? output->text_stream() : stdout;
  print_printable(fmt::format("{}: import {:.3f} s, bake {:.3f} s, peak memory {:.0f} MiB\n",
                              output != nullptr ? output->name() : "dry run", timings.import_s, timings.bake_s,
                              static_cast<double>(peak_rss_bytes()) / (1 << 20)),
                  text);
  fmt::print(text, "{}", bake_text(baked));
  fmt::print(text, "{}", left_out_cameras_text(imported));
  if (globals.verbosity > 0) print_printable("\n" + to_text(baked.file, true), text);
  std::fflush(text);
}

/// Adds what moves: the scene's own motion and that of the keys.
void add_motion_of(const BakeOptions& options, const GlobalOptions& globals, Scene& scene) {
  if (options.motion == "off")
    scene.motion = {};
  else
    separate_motion(scene);
  if (options.keys.empty()) return;
  refuse_to_replace({options.keys}, options.output);
  add_motion(scene.motion, read_motion_keys(options.keys, motion_targets(scene), globals.memory));
}

constexpr double kSequenceFps = 24.0;

/// Finds the frames of the meshes that --sequence names.
void add_sequences(const BakeOptions& options, const ImportResult& imported, BakeConfig& config) {
  const double fps = options.sequence_fps.value_or(kSequenceFps);
  for (const std::string& pattern : options.sequences) {
    if (pattern != kAnimationSequence) {
      config.sequences.push_back(
          find_mesh_sequence(imported.scene, imported.files, options.input, pattern, options.sequence_start, fps));
      continue;
    }
    if (imported.sequences.empty())
      throw FileError(ErrorKind::kInput, options.input, "no animation deforms its meshes by morph targets or skins");
    config.sequences.insert(config.sequences.end(), imported.sequences.begin(), imported.sequences.end());
  }
}

int run(const BakeOptions& given, const GlobalOptions& globals) {
  BakeOptions options = given;
  options.input = options.inputs.front();
  options.scene.joined_files.assign(options.inputs.begin() + 1, options.inputs.end());
  apply_preset(options);
  BakeConfig config = make_config(options);
  if (options.output.empty() && !options.dry_run) fail_without_output("bake", options.input, ".ptk");
  refuse_foreign_ending(options.output, {".ptk"}, "bake", advice_for(options));
  JsonOutput json(globals.json, globals.force);
  std::optional<BinaryOutput> output;
  if (!options.dry_run) output.emplace(options.output, globals.force, json);
  nlohmann::json target;
  if (!options.targets.empty()) {
    target = find_target(options, globals);
    config = make_config(options);
  }
  config.memory = globals.memory;
  ProgressDisplay display(globals);
  Progress progress(display.observer());

  options.scene.keep_unused_objects = !options.distance_levels.empty(); // levels need no instance
  options.scene.keep_shading = config.purpose == baked::kShading;
  if (std::ranges::find(options.sequences, kAnimationSequence) != options.sequences.end())
    options.scene.frames_per_second = options.sequence_fps.value_or(kSequenceFps);
  const Stopwatch importing;
  ImportResult imported = import_for_command(options.input, options.scene, globals, progress, display, config.textures);
  BakeTimings timings;
  timings.import_s = importing.seconds();
  refuse_to_replace(imported.files, options.output);
  add_motion_of(options, globals, imported.scene);
  add_sequences(options, imported, config);
  if (!options.distance_levels.empty()) {
    refuse_to_replace({options.distance_levels}, options.output);
    config.level_chains = read_level_chains(options.distance_levels, imported.scene, globals.memory);
  }

  Diagnostics diagnostics;
  const Stopwatch baking;
  BakedScene scene =
      with_file(options.input, [&] { return bake_to_bytes(imported.scene, config, diagnostics, progress); });
  if (output) {
    progress.begin("writing the file", 0);
    output->write(scene.bytes);
    forget_resumed_levels(config, scene.report, diagnostics);
  }
  timings.bake_s = baking.seconds();
  display.finish();
  report_diagnostics(diagnostics, globals);

  const BakeReport& baked = scene.report;
  if (json.wanted()) {
    nlohmann::json document = bake_json(options, baked, imported.statistics, timings, globals.verbosity > 0);
    if (!target.is_null()) document["target"] = target;
    json.write(document);
  }
  if (!json.to_stdout() && !globals.quiet)
    print_results(output ? &*output : nullptr, baked, imported, timings, globals);
  print_printable(precision_warning(baked, config.precision_kind != PrecisionKind::kPicture), stderr);
  return 0;
}

} // namespace

void add_bake_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<BakeOptions>();
  CLI::App& verb = add_verb(app, globals, "bake", "Convert a pbrt-v3 scene or mesh files into a compact .ptk file",
                            [options, &globals] { return run(*options, globals); });
  add_bake_options(verb, *options);
}

} // namespace packtrace
