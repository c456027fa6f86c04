#include "runtime/commands/commands.h"

#include <filesystem>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compress/exchange/gltf/gltf_export.h"
#include "compress/exchange/vertex16/vertex16_export.h"
#include "pbrt_import/base/file_error.h"
#include "runtime/commands/binary_output.h"
#include "runtime/commands/cli_support.h"
#include "runtime/commands/file_report.h"
#include "runtime/commands/json_output.h"
#include "runtime/commands/loaded_scene.h"
#include "runtime/commands/option_checks.h"
#include "runtime/commands/progress_display.h"

namespace packtrace {
namespace {

constexpr const char *kVertex16 = "vertex16", *kGltf = "gltf", *kDraco = "draco", *kNone = "none";

struct ExportOptions {
  std::string input, output;
  std::string layout; ///< empty: chosen by the output's extension
  std::string codec = kDraco;
  GltfConfig gltf;
  bool has_gltf_option = false; ///< whether an option was given that applies to glTF only
};

/// The exported file and its reports.
struct Exported {
  std::vector<std::byte> bytes;
  nlohmann::json json;
  std::string text;
};

nlohmann::json to_json(const ExportOptions& options, const Vertex16Report& r) {
  return {{"verb", "export"},
          {"input", options.input},
          {"output", options.output},
          {"layout", kVertex16},
          {"geometries", r.geometries},
          {"draws", r.draws},
          {"instances", r.instances},
          {"materials", r.materials},
          {"vertices", r.vertices},
          {"triangles", r.triangles},
          {"bytes", {{"vertices", r.vertex_bytes}, {"indices", r.index_bytes}, {"total", r.file_bytes}}},
          {"coarser_geometries", r.coarser_geometries},
          {"max_position_error", r.max_position_error},
          {"max_normal_error_degrees", r.max_normal_error_degrees},
          {"max_uv_error", r.max_uv_error},
          {"max_tangent_error_degrees", r.max_tangent_error_degrees},
          {"peak_rss_bytes", peak_rss_bytes()}};
}

std::string to_text(const ExportOptions& options, const Vertex16Report& r) {
  const double per = r.triangles > 0 ? 1.0 / static_cast<double>(r.triangles) : 0.0;
  std::string text = fmt::format(
      grouped(),
      "{}: {:L} vertices, {:L} triangles in {:L} draws of {:L} geometries; {:L} bytes, {:.2f} per triangle "
      "({:.2f} vertices, {:.2f} indices)\n"
      "maximum error against the .ptk file: position {:.3g}   normal {:.4f} degrees   uv {:.3g}   tangent {:.3f} "
      "degrees\n",
      options.output, r.vertices, r.triangles, r.draws, r.geometries, r.file_bytes,
      static_cast<double>(r.file_bytes) * per, static_cast<double>(r.vertex_bytes) * per,
      static_cast<double>(r.index_bytes) * per, r.max_position_error, r.max_normal_error_degrees, r.max_uv_error,
      r.max_tangent_error_degrees);
  if (r.coarser_geometries > 0)
    text +=
        fmt::format(grouped(), "{:L} geometries span more than 2^21 grid steps and were rounded to a coarser grid\n",
                    r.coarser_geometries);
  return text;
}

nlohmann::json to_json(const ExportOptions& options, const GltfReport& r) {
  return {{"verb", "export"},
          {"input", options.input},
          {"output", options.output},
          {"layout", kGltf},
          {"codec", options.codec},
          {"meshes", r.meshes},
          {"primitives", r.primitives},
          {"nodes", r.nodes},
          {"grouped_instances", r.grouped_instances},
          {"materials", r.materials},
          {"images", r.images},
          {"cameras", r.cameras},
          {"vertices", r.vertices},
          {"triangles", r.triangles},
          {"bytes", {{"geometry", r.geometry_bytes}, {"images", r.image_bytes}, {"total", r.file_bytes}}},
          {"collapsed_triangles", r.collapsed_triangles},
          {"plain_primitives", r.plain_primitives},
          {"simplified_materials", r.simplified_materials},
          {"skipped_cameras", r.skipped_cameras},
          {"peak_rss_bytes", peak_rss_bytes()}};
}

std::string to_text(const ExportOptions& options, const GltfReport& r) {
  const double per = r.triangles > 0 ? 1.0 / static_cast<double>(r.triangles) : 0.0;
  std::string text = fmt::format(
      grouped(),
      "{}: {:L} vertices, {:L} triangles in {:L} primitives; {:L} meshes, {:L} nodes, {:L} materials, {:L} images, "
      "{:L} cameras\n{:L} bytes: geometry {:L} ({:.2f} per triangle), images {:L}\n",
      options.output, r.vertices, r.triangles, r.primitives, r.meshes, r.nodes, r.materials, r.images, r.cameras,
      r.file_bytes, r.geometry_bytes, static_cast<double>(r.geometry_bytes) * per, r.image_bytes);
  const auto note = [&](uint64_t count, const char* what) {
    if (count > 0) text += fmt::format(grouped(), "{:L} {}\n", count, what);
  };
  note(r.collapsed_triangles, "degenerate triangles (with two equal corners) were dropped by Draco");
  note(r.plain_primitives, "primitives are stored as floats: they need more than 30 bits, or Draco cannot encode them");
  note(r.simplified_materials, "materials lost their texture, because it is mapped differently from their alpha mask");
  note(r.skipped_cameras, "cameras were skipped, because glTF has no environment cameras");
  return text;
}

/// Returns the layout from --layout, or else the one that the output's extension implies. Throws Error(kUsage) if they
/// contradict each other or neither is known.
std::string layout_of(const ExportOptions& options) {
  const std::string ending = ending_of(options.output);
  if (ending == ".gltf")
    throw FileError(ErrorKind::kUsage, options.output,
                    "glTF is written as a single binary file; use the extension .glb");
  const std::string layout = !options.layout.empty() ? options.layout
                             : ending == ".glb"      ? kGltf
                             : ending == ".v16"      ? kVertex16
                                                     : "";
  refuse_foreign_ending(options.output, {".glb", ".v16"}, "export", {});
  if (layout.empty() && options.output == "-")
    throw Error(ErrorKind::kUsage, "-o - has no extension to choose a layout by; add --layout gltf or vertex16");
  if (layout.empty())
    throw FileError(ErrorKind::kUsage, options.output, "use the extension .glb or .v16, or add --layout");
  if ((ending == ".glb" && layout != kGltf) || (ending == ".v16" && layout != kVertex16))
    throw FileError(ErrorKind::kUsage, options.output, "the extension does not match --layout " + layout);
  return layout;
}

Exported export_file(const ExportOptions& options, const std::string& layout, const MemoryBudget& budget,
                     Progress& progress) {
  if (!is_baked_file(options.input))
    throw FileError(ErrorKind::kInput, options.input,
                    "not a packtrace baked file; create one with packtrace bake SCENE.pbrt -o FILE.ptk");
  const MemoryReservation memory = reserve_decoded(options.input, budget);
  const BakedFile file = BakedFile::open(options.input);
  if (layout == kGltf) {
    GltfConfig config = options.gltf;
    config.draco = options.codec == kDraco;
    GltfExport result = export_gltf(file, config, progress);
    return {std::move(result.bytes), to_json(options, result.report), to_text(options, result.report)};
  }
  Vertex16Export result = export_vertex16(file, progress);
  return {std::move(result.bytes), to_json(options, result.report), to_text(options, result.report)};
}

int run(const ExportOptions& options, const GlobalOptions& globals) {
  if (options.output.empty()) fail_without_output("export", options.input, ".glb");
  const std::string layout = layout_of(options);
  if (layout == kVertex16 && options.has_gltf_option)
    throw Error(ErrorKind::kUsage,
                "--codec, --level, --normal-bits, --uv-bits and --instancing only apply to --layout gltf");
  JsonOutput json(globals.json, globals.force);
  BinaryOutput output(options.output, globals.force, json);
  refuse_to_replace({options.input});
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  const Exported result = export_file(options, layout, globals.memory, progress);
  output.write(result.bytes);
  display.finish();
  if (json.wanted()) json.write(result.json);
  if (json.to_stdout() || globals.quiet) return 0;
  print_printable(result.text, output.text_stream());
  return 0;
}

} // namespace

void add_export_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App& verb = add_verb(app, globals, "export", "Convert a .ptk file to glTF or to a GPU vertex layout",
                            [options, &globals] { return run(*options, globals); });
  const auto of_gltf = [options](const std::string&) { options->has_gltf_option = true; };
  verb.add_option("FILE", options->input, ".ptk file to convert")->required();
  add_output_option(verb, options->output,
                    "Output file (required), .glb or .v16, or - for standard output together with --layout");
  verb.add_option("--layout", options->layout,
                  "Output format. gltf is a binary glTF 2.0 file with materials, instances, textures and cameras; "
                  "vertex16 has 16 bytes per vertex and 16- or 32-bit indices, for direct upload to a GPU (default: "
                  "gltf for .glb, vertex16 for .v16)")
      ->check(one_of({kVertex16, kGltf}));
  verb.add_option(
          "--codec", options->codec,
          "Geometry compression for gltf. draco uses KHR_draco_mesh_compression; none stores floats, which every "
          "glTF viewer can read (default draco)")
      ->check(one_of({kDraco, kNone}))
      ->each(of_gltf)
      ->capture_default_str();
  verb.add_option("--level", options->gltf.codec.level,
                  "Draco compression level, 0 (fastest) to 10 (smallest file) (default 7)")
      ->check(CLI::Range(0, 10))
      ->each(of_gltf)
      ->capture_default_str();
  verb.add_option("--normal-bits", options->gltf.codec.normal_bits,
                  "Draco quantisation bits of octahedral normals, 2..30 (default 12)")
      ->check(CLI::Range(2, 30))
      ->each(of_gltf)
      ->capture_default_str();
  verb.add_option("--uv-bits", options->gltf.codec.uv_bits,
                  "Draco quantisation bits of texture coordinates over their range, 1..30 (default 14). Raise it if "
                  "textures shift")
      ->check(CLI::Range(1, 30))
      ->each(of_gltf)
      ->capture_default_str();
  verb.add_flag("--instancing", options->gltf.instancing,
                "Store the instances of a mesh in one node with EXT_mesh_gpu_instancing: much smaller files of many "
                "instances, for viewers that know the extension")
      ->each(of_gltf);
  verb.footer("vertex16 packs position (3 x 21 bits), normal (24), tangent (1 + 8) and uv\n"
              "(2 x 16) of a vertex. docs/vertex16.md describes the file;\n"
              "compress/exchange/vertex16/vertex16.glsl and vertex16_decode.h decode it. Positions in glTF\n"
              "files lie on the grid of the .ptk file.\n"
              "Examples:\n"
              "  packtrace export house.ptk -o house.v16\n"
              "  packtrace export house.ptk -o house.glb --level 10\n"
              "  packtrace export house.ptk -o - --layout gltf | gltf_viewer /dev/stdin");
}

} // namespace packtrace
