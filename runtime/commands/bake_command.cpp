#include "runtime/commands/commands.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/base/error.h"
#include "runtime/commands/bake_options.h"
#include "runtime/commands/bake_target.h"
#include "runtime/commands/binary_output.h"
#include "runtime/commands/cli_support.h"
#include "runtime/commands/file_report.h"
#include "runtime/commands/json_output.h"
#include "runtime/commands/loaded_scene.h"
#include "runtime/commands/option_checks.h"
#include "runtime/commands/process_usage.h"
#include "runtime/commands/progress_display.h"
#include "runtime/commands/requirement_report.h"
#include "runtime/commands/seam_report.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

nlohmann::json promise_json(const BakeReport& baked) {
  nlohmann::json geometries = nlohmann::json::array();
  for (const BrokenPromise& g : baked.promise)
    geometries.push_back({{"name", g.name}, {"bound", g.bound}, {"wanted", g.wanted}, {"step", g.step}});
  return {{"kept", baked.promise.empty()}, {"geometries", geometries}};
}

/// Warning about geometries whose grid step is coarser than required, with the option that avoids it; empty if there
/// are none.
/// @param chosen whether the user gave a precision option
std::string precision_warning(const BakeReport& baked, bool chosen) {
  constexpr size_t kMaxShown = 3;
  if (baked.promise.empty()) return {};
  std::vector<BrokenPromise> worst = baked.promise;
  std::stable_sort(worst.begin(), worst.end(), [](const BrokenPromise& a, const BrokenPromise& b) {
    return a.step / a.wanted > b.step / b.wanted;
  });
  std::string text =
      fmt::format("warning: the grid is too coarse for accurate ambient occlusion: {} of {} geometries\n", worst.size(),
                  baked.file.geometries);
  double step = 0.0; // finest step that is required, world units
  for (size_t i = 0; i < worst.size(); ++i) {
    const BrokenPromise& g = worst[i];
    if (!g.float_limit && (step == 0.0 || g.wanted * g.scale < step)) step = g.wanted * g.scale;
    if (i < kMaxShown)
      text += fmt::format("  {}: grid step {:.3g}{}; required {:.2g} ({})\n", g.name, g.step,
                          g.float_limit ? " (limit of float precision)" : "", g.wanted, g.bound);
  }
  if (worst.size() > kMaxShown) text += fmt::format("  and {} more; --json lists them\n", worst.size() - kMaxShown);
  if (step > 0.0)
    text += chosen ? std::string("  without a precision option, bake chooses steps that are fine enough\n")
                   : fmt::format("  --grid-step-abs {:.2g} is fine enough, but makes the file larger\n", step);
  return text;
}

nlohmann::json report(const BakeOptions& options, const BakeReport& baked, const ImportStatistics& imported,
                      double import_s, double bake_s, bool by_geometry) {
  nlohmann::json json = to_json(baked.file, by_geometry);
  json["verb"] = "bake";
  json["input"] = options.input;
  json["output"] = options.dry_run ? nlohmann::json() : nlohmann::json(options.output);
  json["seconds"] = {{"import", import_s}, {"bake", bake_s}};
  json["peak_rss_bytes"] = peak_rss_bytes();
  json["rms_position_error"] = baked.rms_position_error;
  json["mean_normal_error_degrees"] = baked.mean_normal_error_degrees;
  json["shared_shapes"] = baked.shared_shapes;
  json["instanced_shapes"] = baked.instanced_shapes;
  json["seams"] = seams_json(baked.seams);
  json["shared_objects"] = baked.shared_objects;
  json["unused_objects"] = baked.unused_objects;
  json["left_out"] = baked.left_out;
  json["resumed_geometries"] = baked.resumed_geometries;
  json["nested_geometries"] = baked.nested_geometries;
  json["finer_geometries"] = baked.finer_geometries;
  json["promise"] = promise_json(baked);
  json["median_edge"] = baked.world_median_edge;
  json["import"] = {{"directives", imported.directives},
                    {"files", imported.files_read},
                    {"bytes", imported.bytes_read},
                    {"shapes", imported.shapes},
                    {"shapes_skipped", imported.shapes_skipped},
                    {"cameras_left_out", imported.cameras_left_out},
                    {"textures_found", imported.textures_found},
                    {"textures_missing", imported.textures_missing},
                    {"problems", problems_json(imported)}};
  json["dropped_streams"] = dropped_streams_json(baked.file);
  json["warnings"] = baked.warnings;
  return json;
}

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

int run(const BakeOptions& given, const GlobalOptions& globals) {
  BakeOptions options = given;
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

  const Stopwatch importing;
  const ImportResult imported =
      import_for_command(options.input, options.scene, globals, progress, display, config.textures);
  const double import_s = importing.seconds();
  refuse_to_replace(imported.files, options.output);

  Diagnostics diagnostics;
  const Stopwatch baking;
  BakedScene scene = [&] {
    try {
      return bake_to_bytes(imported.scene, config, diagnostics, progress);
    } catch (const MemoryError& error) {
      throw MemoryError(options.input, error.what());
    }
  }();
  if (output) {
    progress.begin("writing the file", 0);
    output->write(scene.bytes);
    forget_resumed_levels(config, scene.report, diagnostics);
  }
  const BakeReport& baked = scene.report;
  const double bake_s = baking.seconds();
  display.finish();
  report_diagnostics(diagnostics, globals);

  if (json.wanted()) {
    nlohmann::json document = report(options, baked, imported.statistics, import_s, bake_s, globals.verbosity > 0);
    if (!target.is_null()) document["target"] = target;
    json.write(document);
  }
  const std::string promise = precision_warning(baked, config.precision_kind != PrecisionKind::kPicture);
  if (json.to_stdout() || globals.quiet) {
    print_printable(promise, stderr);
    return 0;
  }
  std::FILE* const text = output ? output->text_stream() : stdout;
  print_printable(fmt::format("{}: import {:.3f} s, bake {:.3f} s, peak memory {:.0f} MiB\n",
                              output ? output->name() : "dry run", import_s, bake_s,
                              static_cast<double>(peak_rss_bytes()) / (1 << 20)),
                  text);
  fmt::print(text, "{}", size_text(baked.file));
  fmt::print(text, "maximum position error {:.3g} (object units), {}\n", baked.max_position_error,
             baked.file.normals.empty()
                 ? std::string("no normals stored")
                 : fmt::format("maximum normal error {:.4f} degrees", baked.max_normal_error_degrees));
  fmt::print(text, "{}", collapsed_text(baked.file));
  if (const LodTable& lod = baked.file.lod.all; !lod.levels.empty())
    fmt::print(
        text, "{}",
        fmt::format(grouped(),
                    "{} coarser LOD levels for {:L} geometries: all levels take {:.3f} bytes per triangle of level 0 "
                    "({:L} triangles)\n",
                    lod.levels.size() - 1, baked.lod_geometries, lod.bytes_per_triangle(), lod.base_triangles()));
  else if (baked.lod_candidates > 0)
    fmt::print(
        text,
        "no coarser LOD levels: none of the {} geometries can be simplified, because their vertices lie on borders "
        "that other geometries share or their triangles are too few\n",
        baked.lod_candidates);
  if (baked.resumed_geometries > 0)
    fmt::print(text, "{}",
               fmt::format(grouped(), "resumed: the LOD levels of {:L} geometries were already finished\n",
                           baked.resumed_geometries));
  if (baked.instanced_shapes > 0)
    fmt::print(text, "{}",
               fmt::format(grouped(), "{:L} shapes outside objects share geometry, which has its own grid\n",
                           baked.instanced_shapes));
  if (baked.nested_geometries > 0)
    fmt::print(text, "{}",
               fmt::format(grouped(),
                           "{:L} geometries have a finer grid, because they are small compared with the scene\n",
                           baked.nested_geometries));
  if (baked.finer_geometries > 0)
    fmt::print(text, "{}",
               fmt::format(
                   grouped(),
                   "{:L} geometries have a finer grid, because their triangles or gaps are thin or close to a camera\n",
                   baked.finer_geometries));
  if (baked.left_out > 0)
    fmt::print(text, "{}",
               fmt::format(grouped(),
                           "{:L} shapes and instances are dropped, because they exceed the range of floats\n",
                           baked.left_out));
  fmt::print(text, "{}", dropped_streams_text(baked.file));
  fmt::print(text, "{}", left_out_cameras_text(imported));
  if (globals.verbosity > 0) print_printable("\n" + to_text(baked.file, true), text);
  std::fflush(text);
  print_printable(promise, stderr);
  return 0;
}

} // namespace

void add_bake_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<BakeOptions>();
  CLI::App& verb = add_verb(app, globals, "bake", "Convert a pbrt-v3 scene into a compact .ptk file",
                            [options, &globals] { return run(*options, globals); });
  verb.add_option("SCENE", options->input, "pbrt-v3 scene file")->required();
  add_output_option(verb, options->output,
                    "Output file (.ptk), or - for standard output. Required unless --dry-run is given");
  const auto add_precision = [&](const char* name, auto& value, const char* type, const char* description) {
    return verb.add_option(name, value, description)
        ->type_name(type)
        ->group("Precision of positions (at most one of these)");
  };
  const std::array<CLI::Option*, 4> precisions{
      add_precision(
          "--grid-step-edge,--precision-edge", options->precision_edge, "F",
          "Grid step as a fraction of the median edge length, 1e-9..1 (default 1/128, and finer where thin triangles, "
          "contacts or close views need it). Smaller steps give larger files"),
      add_precision("--grid-step,--precision", options->precision, "REL",
                    "Grid step as a fraction of the bounding box diagonal, 1e-12..0.1"),
      add_precision("--grid-step-abs,--precision-abs", options->precision_abs, "UNITS",
                    "Grid step in world units; positions move by at most half of it per axis"),
      add_precision("--position-bits", options->position_bits, "N",
                    "Bits per coordinate along the longest side of the bounding box, 1..40")};
  for (CLI::Option* option : precisions)
    for (CLI::Option* other : precisions)
      if (option != other) option->excludes(other);
  std::vector<std::string> encodings{kAuto};
  for (const NormalFormat& format : kNormalFormats) encodings.emplace_back(format.name);
  verb.add_option("--normals", options->normals,
                  "Normal encoding. auto picks for each geometry the smallest of axis16, oct20, axis24 and axis32 that "
                  "meets --normal-error (default auto)")
      ->check(one_of(encodings))
      ->default_str(kAuto)
      ->group("Normals");
  verb.add_option("--normal-error", options->normal_error,
                  "Maximum angle between source and decoded normals with --normals auto, 0.0025..10 degrees (default "
                  "0.04, and more in geometries whose grid is coarser than the default grid)")
      ->type_name("DEGREES")
      ->group("Normals");
  verb.add_option("--for", options->purpose,
                  "Purpose of the file; data it does not need is dropped. ao suffices for ambient occlusion; shading "
                  "also keeps material textures, and the texture coordinates used by textures and normal maps (default "
                  "ao)")
      ->check(one_of(std::vector<std::string>(kPurposes.begin(), kPurposes.end())))
      ->default_str(options->purpose)
      ->group("What is kept");
  verb.add_option("--keep", options->keep, "Streams to store even where --for does not need them, separated by commas")
      ->delimiter(',')
      ->check(one_of({kKeepUvs, kKeepNormals}))
      ->type_name("STREAMS")
      ->group("What is kept");
  verb.add_option(
          "--uvs", options->uvs,
          "Encoding of texture coordinates. auto is accurate to 1/32 texel; unorm16 (steps of 1/65535) and fp16 exist "
          "for compatibility (default auto)")
      ->check(one_of(std::vector<std::string>{kAuto,
                                              std::string(kUvEncodingNames[static_cast<size_t>(UvEncoding::kUnorm16)]),
                                              std::string(kUvEncodingNames[static_cast<size_t>(UvEncoding::kFp16)])}))
      ->default_str(kAuto)
      ->group("Texture coordinates");
  std::vector<std::string> texture_codecs{kNoTextures, kAuto};
  texture_codecs.insert(texture_codecs.end(), kTextureCodecNames.begin(), kTextureCodecNames.end());
  verb.add_option("--textures", options->textures,
                  "Encoding of material textures. none stores their average colour only; auto picks for each the "
                  "smallest encoding that meets --texture-psnr (default: auto with --for shading, else none)")
      ->check(one_of(texture_codecs))
      ->group("Textures");
  verb.add_option("--texture-psnr", options->texture_psnr,
                  "Minimum PSNR with --textures auto, 10..100 dB of sRGB values (default 34)")
      ->type_name("DB")
      ->group("Textures");
  verb.add_option(
          "--lod", options->lod,
          "Store LOD levels, which render --lod-error needs. all adds them to every geometry; instanced only to "
          "geometries with several instances; --lod without a value means all (default off). Each level has less than "
          "half the triangles of the next finer one")
      ->check(one_of(std::vector<std::string>(kLodUses.begin(), kLodUses.end())))
      ->expected(0, 1)
      ->default_str(kLodDefaultValue)
      ->group("Levels of detail");
  verb.add_option("--lod-min-triangles", options->lod_min_triangles,
                  "Minimum number of triangles for a geometry to get LOD levels (default 128)")
      ->type_name("N")
      ->group("Levels of detail");
  verb.add_option("--lod-levels", options->lod_levels,
                  "Maximum number of levels coarser than level 0, 1..31 (default 31)")
      ->type_name("N")
      ->group("Levels of detail");
  verb.add_option(
          "--resume", options->resume,
          "Folder that collects finished LOD levels. If bake is interrupted, run it again with the same folder to "
          "continue; its contents are removed after the file was written")
      ->type_name("DIR")
      ->group("Levels of detail");
  verb.add_option("--trees", options->trees,
                  "Store BVH trees for the packed tracer, 1 to 2.5 bytes per triangle (default on). Without them files "
                  "are smaller, but every render builds the trees first")
      ->check(one_of({"on", "off"}))
      ->default_str("on");
  verb.add_option(
          "--codec", options->codec,
          "Compression on disk. none is memory-mapped and traced as it is; fast and small are decoded into memory when "
          "the file is opened. small gives the smallest file; fast opens four to five times as fast as small (default "
          "none)")
      ->check(one_of({std::string(name_of(PageCodec::kNone)), std::string(name_of(PageCodec::kFast)),
                      std::string(name_of(PageCodec::kSmall))}))
      ->default_str(std::string(name_of(PageCodec::kNone)));
  verb.add_option("--preset", options->preset,
                  "Options to start from; others override them. smallest: 16 bits, coarse normals, codec small, no "
                  "trees. balanced: default precision, codec fast. exact: 24 bits, the finest normals")
      ->check(one_of(std::vector<std::string>(kPresets.begin(), kPresets.end())))
      ->group("Choosing by result");
  verb.add_option("--target", options->targets,
                  "Search for the smallest file that keeps a measured limit: ao-error=X (mean absolute error), "
                  "position-error=UNITS, normal-error=DEGREES or size=3MB. Repeat it for several limits. Options that "
                  "are given are not changed; exit code 5 if no file keeps the limits")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false)
      ->take_all()
      ->group("Choosing by result");
  verb.add_flag("--dry-run", options->dry_run, "Import and bake without writing a file, to see sizes and errors");
  add_scene_options(verb, options->scene);
  verb.footer("Positions are rounded to an integer grid. Shapes outside objects share one grid, so\n"
              "meshes that touch stay closed; a mesh used by several shapes is stored once, on its\n"
              "own grid. The position error measured against the source is printed and stored in\n"
              "the file; per axis it is at most half a grid step plus the rounding to floats.\n"
              "Without a precision option the grid is fine enough for pictures from the scene's\n"
              "cameras; a warning at the end says where it is not. Dropped data is listed with the\n"
              "reason; -v lists it per geometry.\n"
              "Examples:\n"
              "  packtrace bake house.pbrt -o house.ptk\n"
              "  packtrace bake forest.pbrt -o forest.ptk --lod --codec small\n"
              "  packtrace bake house.pbrt -o - | ssh host 'cat > house.ptk'\n"
              "  packtrace bake house.pbrt -o small.ptk --grid-step 1e-4 --json report.json\n"
              "  packtrace bake house.pbrt -o small.ptk --target ao-error=0.002");
}

} // namespace packtrace
