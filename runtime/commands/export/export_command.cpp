#include "runtime/commands/commands.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compress/exchange/gltf/gltf_export.h"
#include "compress/exchange/scene/obj_export.h"
#include "compress/exchange/scene/pbrt_export.h"
#include "compress/exchange/scene/stream_export.h"
#include "compress/exchange/vertex16/vertex16_export.h"
#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/output_file.h"
#include "pbrt_import/base/printable.h"
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/export/companion_files.h"
#include "runtime/commands/export/export_reports.h"
#include "runtime/commands/export/gltf_options.h"
#include "runtime/commands/export/shader_export.h"
#include "runtime/commands/reports/file_report.h"

namespace packtrace {
namespace {

constexpr const char *kShader = "glsl", *kVertex16 = "vertex16", *kGltf = "gltf", *kPbrt = "pbrt", *kObj = "obj",
                     *kStreams = "streams";

struct ExportOptions {
  std::string input, output;
  std::string streams; ///< raw: arrays; empty: none
  std::string layout;  ///< empty: chosen by the output's extension
  GltfOptions gltf;
  ShaderOptions shader;
};

/// The exported file and its reports.
struct Exported {
  std::vector<std::byte> bytes;
  std::vector<ExportedFile> others; ///< beside the main file
  nlohmann::json json;
  std::string text;
  std::vector<std::string> warnings{}; ///< about the input
};

/// Returns the layout from --layout or --streams, or else the one that the output's extension implies. Throws
/// Error(kUsage) if they contradict each other or none is known.
std::string layout_of(const ExportOptions& options) {
  struct Ending {
    std::string_view ending;
    const char* layout;
  };
  constexpr std::array<Ending, 7> kEndings = {{{".glb", kGltf},
                                               {".gltf", kGltf},
                                               {".v16", kVertex16},
                                               {".glsl", kShader},
                                               {".pbrt", kPbrt},
                                               {".obj", kObj},
                                               {".json", kStreams}}};
  const std::string ending = ending_of(options.output);
  const auto known = std::ranges::find(kEndings, ending, &Ending::ending);
  refuse_foreign_ending(options.output, {".glb", ".gltf", ".v16", ".glsl", ".pbrt", ".obj", ".json"}, "export", {});
  std::string asked = options.streams.empty() ? options.layout : kStreams;
  if (!options.streams.empty() && !options.layout.empty())
    throw Error(ErrorKind::kUsage, "--streams and --layout exclude each other");
  if (asked.empty() && known != kEndings.end() && known->layout != std::string_view(kStreams)) return known->layout;
  if (asked.empty() && options.output == "-")
    throw Error(ErrorKind::kUsage, "-o - has no extension to choose a layout by; add --layout gltf or vertex16");
  if (asked.empty())
    throw FileError(
        ErrorKind::kUsage, options.output,
        "use the extension .glb, .gltf, .v16, .glsl, .pbrt or .obj, or .json with --streams raw, or add --layout");
  if (known != kEndings.end() ? asked != known->layout : asked == kStreams)
    throw FileError(ErrorKind::kUsage, options.output,
                    asked == kStreams ? "--streams needs an output with the extension .json"
                                      : "the extension does not match --layout " + asked);
  return asked;
}

/// Name of the output without its ending, for names of the files beside it: in JSON they must be UTF-8.
std::string stem_of(const ExportOptions& options) {
  return to_utf8(std::filesystem::path(options.output).stem().string());
}

/// @param main takes what is written of the main file while it is made
/// @param companions checks the names of files beside it that are known before the work starts
Exported export_file(const ExportOptions& options, const std::string& layout, const MemoryBudget& budget,
                     Progress& progress, const ByteSink& main, const CompanionFiles& companions) {
  if (layout == kShader) {
    ShaderExport result = export_shader(options.input, options.output, options.shader, budget, progress);
    return {std::move(result.bytes), {}, std::move(result.json), std::move(result.text), std::move(result.warnings)};
  }
  if (!is_baked_file(options.input))
    throw FileError(ErrorKind::kInput, options.input,
                    "not a packtrace baked file; create one with packtrace bake SCENE.pbrt -o FILE.ptk");
  const MemoryReservation memory = reserve_decoded(options.input, budget);
  const BakedFile file = BakedFile::open(options.input);
  ExportNames names{options.input, options.output, {}, {}, {}};
  if (layout == kGltf) {
    GltfConfig config = options.gltf.config();
    if (ending_of(options.output) == ".gltf") config.buffer_name = stem_of(options) + ".bin";
    if (!config.buffer_name.empty()) companions.check(config.buffer_name);
    names.profile = options.gltf.profile_name(), names.codec = name_of(config.codec);
    GltfExport result = export_gltf(file, config, progress);
    std::vector<ExportedFile> others;
    if (!config.buffer_name.empty()) others.push_back({config.buffer_name, std::move(result.buffer)});
    std::vector<std::string> warnings;
    if (config.levels && result.report.levels == 0)
      warnings.emplace_back("--levels: no instance has levels of detail; bake --lod makes them");
    return {std::move(result.bytes), std::move(others), to_json(names, result.report), to_text(names, result.report),
            std::move(warnings)};
  }
  if (layout != kVertex16) {
    names.layout = layout;
    const std::string stem = stem_of(options);
    if (layout == kObj)
      for (const std::string& name : obj_companions(file, stem)) companions.check(name);
    SceneExport result = layout == kPbrt  ? export_pbrt(file, stem, progress)
                         : layout == kObj ? export_obj(file, stem, progress, main)
                                          : export_streams(file, stem, progress);
    std::vector<std::byte> bytes;
    if (layout != kObj) {
      bytes = std::move(result.files.back().bytes);
      result.files.pop_back();
    }
    return {std::move(bytes), std::move(result.files), to_json(names, result.report), to_text(names, result.report)};
  }
  Vertex16Export result = export_vertex16(file, progress);
  return {std::move(result.bytes), {}, to_json(names, result.report), to_text(names, result.report)};
}

/// Throws Error(kUsage) for options that have no effect on the format or on what other options choose.
void refuse_other_options(const ExportOptions& options, const std::string& layout) {
  const std::string format = "the format " + layout + ", only on ";
  if (layout != kShader) refuse_without_effect(options.shader.names(), format + "shaders (.glsl)");
  if (layout != kGltf)
    refuse_without_effect(options.gltf.names(), format + "glTF (.glb, .gltf)");
  else
    options.gltf.config();
}

int run(const ExportOptions& options, const GlobalOptions& globals) {
  if (options.output.empty()) fail_without_output("export", options.input, ".glb");
  const std::string layout = layout_of(options);
  refuse_other_options(options, layout);
  JsonOutput json(globals.json, globals.force);
  BinaryOutput output(options.output, globals.force, json);
  refuse_to_replace({options.input});
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  CompanionFiles companions(options.output, options.input, globals.force);
  const Exported result = export_file(
      options, layout, globals.memory, progress, [&output](std::span<const std::byte> bytes) { output.append(bytes); },
      companions);
  companions.write(result.others, progress);
  output.write(result.bytes);
  companions.keep();
  display.finish();
  for (const std::string& warning : result.warnings)
    if (!globals.quiet) print_printable(fmt::format("{}: warning: {}\n", options.input, warning), stderr);
  if (json.wanted()) json.write(result.json);
  if (json.to_stdout() || globals.quiet) return 0;
  print_printable(result.text, output.text_stream());
  return 0;
}

} // namespace

void add_export_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App& verb = add_verb(app, globals, "export",
                            "Convert a .ptk file to glTF, pbrt-v3, OBJ, arrays, a GPU vertex layout or a shader",
                            [options, &globals] { return run(*options, globals); });
  verb.add_option("FILE", options->input, ".ptk file to convert; or an image, for .glsl")->required();
  add_output_option(verb, options->output,
                    "Output file (required): .glb, .gltf, .v16, .glsl, .pbrt, .obj, or .json with --streams; or - for "
                    "standard output "
                    "together with --layout. Files that belong to it are beside it, in NAME_files, or NAME.bin");
  verb.add_option(
          "--layout", options->layout,
          "Output format. gltf is a glTF 2.0 file with materials, instances, textures and cameras; "
          "vertex16 has 16 bytes per vertex and 16- or 32-bit indices, for direct upload to a GPU (default: "
          "gltf for .glb and .gltf, vertex16 for .v16). glsl is one fragment shader that holds and traces voxels")
      ->check(one_of({kVertex16, kGltf, kShader}));
  verb.add_option("--streams", options->streams,
                  "Write what the file stores as arrays: raw makes NumPy files (.npy), which the output, a .json file, "
                  "describes")
      ->check(one_of({"raw"}));
  add_gltf_options(verb, options->gltf);
  add_shader_options(verb, options->shader);
  verb.footer("vertex16 packs position (3 x 21 bits), normal (24), tangent (1 + 8) and uv\n"
              "(2 x 16) of a vertex. docs/vertex16.md describes the file;\n"
              "compress/exchange/vertex16/vertex16.glsl and vertex16_decode.h decode it. Positions in glTF\n"
              "files lie on the grid of the .ptk file.\n"
              "Examples:\n"
              "  packtrace export house.ptk -o house.v16\n"
              "  packtrace export house.ptk -o house.glb --profile web\n"
              "  packtrace export house.ptk -o house.gltf --profile portable\n"
              "  packtrace export house.ptk -o unpacked/house.pbrt\n"
              "  packtrace export house.ptk -o house.json --streams raw\n"
              "  packtrace export bunny.ptk -o bunny.glsl --proxy-voxels 40\n"
              "  packtrace export picture.png -o picture.glsl --image-format bit --image-size 300\n"
              "  packtrace export house.ptk -o - --layout gltf | gltf_viewer /dev/stdin");
}

} // namespace packtrace
