#include "runtime/commands/export_command.h"

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
#include "runtime/commands/process_usage.h"
#include "runtime/commands/progress_display.h"

namespace packtrace {
namespace {

constexpr const char *kVertex16 = "vertex16", *kGltf = "gltf", *kDraco = "draco", *kNone = "none";

struct ExportOptions {
  std::string input, output;
  std::string layout; ///< empty: by the output's extension
  std::string codec = kDraco;
  GltfConfig gltf;
  bool for_gltf = false; ///< an option was given that only glTF has
};

/// Bytes to be written and what is said about them.
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
      "{}: {:L} vertices, {:L} triangles in {:L} draws of {:L} geometries; {:L} bytes, {:.2f} a triangle "
      "({:.2f} vertices, {:.2f} indices)\n"
      "error against the .ptk file: position {:.3g}   normal {:.4f} degrees   uv {:.3g}   tangent {:.3f} degrees\n",
      options.output, r.vertices, r.triangles, r.draws, r.geometries, r.file_bytes,
      static_cast<double>(r.file_bytes) * per, static_cast<double>(r.vertex_bytes) * per,
      static_cast<double>(r.index_bytes) * per, r.max_position_error, r.max_normal_error_degrees, r.max_uv_error,
      r.max_tangent_error_degrees);
  if (r.coarser_geometries > 0)
    text += fmt::format(grouped(), "{:L} geometries span more than 2^21 steps of their grid and got a coarser one\n",
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
      "{:L} cameras\n{:L} bytes: geometry {:L} ({:.2f} a triangle), images {:L}\n",
      options.output, r.vertices, r.triangles, r.primitives, r.meshes, r.nodes, r.materials, r.images, r.cameras,
      r.file_bytes, r.geometry_bytes, static_cast<double>(r.geometry_bytes) * per, r.image_bytes);
  const auto note = [&](uint64_t count, const char* what) {
    if (count > 0) text += fmt::format(grouped(), "{:L} {}\n", count, what);
  };
  note(r.collapsed_triangles, "triangles without area, two corners in one place, were left out by Draco");
  note(r.plain_primitives, "primitives need more than Draco's 30 bits, or it refused them: stored as floats");
  note(r.simplified_materials, "materials have a mask and a texture that lie differently: the texture was left out");
  note(r.skipped_cameras, "cameras have a projection that glTF does not know");
  return text;
}

/// The layout asked for, or that of the output's extension.
std::string layout_of(const ExportOptions& options) {
  const std::string ending = ending_of(options.output);
  if (ending == ".gltf") throw FileError(ErrorKind::kUsage, options.output, "glTF is written as one binary file, .glb");
  const std::string layout = !options.layout.empty() ? options.layout
                             : ending == ".glb"      ? kGltf
                             : ending == ".v16"      ? kVertex16
                                                     : "";
  refuse_foreign_ending(options.output, {".glb", ".v16"}, "export", {});
  if (layout.empty() && options.output == "-")
    throw Error(ErrorKind::kUsage, "-o - has no ending to tell the layout; say --layout gltf or --layout vertex16");
  if (layout.empty())
    throw FileError(ErrorKind::kUsage, options.output, "give it the ending .glb or .v16, or say --layout");
  if ((ending == ".glb" && layout != kGltf) || (ending == ".v16" && layout != kVertex16))
    throw FileError(ErrorKind::kUsage, options.output, "the ending is not that of --layout " + layout);
  return layout;
}

Exported export_file(const ExportOptions& options, const std::string& layout, const MemoryBudget& budget,
                     Progress& progress) {
  if (!is_baked_file(options.input))
    throw FileError(ErrorKind::kInput, options.input,
                    "not a packtrace baked file; make one with packtrace bake SCENE.pbrt -o FILE.ptk");
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
  if (layout == kVertex16 && options.for_gltf)
    throw Error(ErrorKind::kUsage, "--codec, --level, --normal-bits and --uv-bits are for --layout gltf");
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
  CLI::App& verb = add_verb(app, globals, "export", "Write a .ptk file in a form that other programs read",
                            [options, &globals] { return run(*options, globals); });
  const auto of_gltf = [options](const std::string&) { options->for_gltf = true; };
  verb.add_option("FILE", options->input, "A .ptk file")->required();
  add_output_option(verb, options->output, "The file to write, or - for standard output with --layout (required)");
  verb.add_option("--layout", options->layout,
                  "vertex16: 16 bytes a vertex, 16- or 32-bit indices; gltf: one binary glTF 2.0 file with materials,\n"
                  "instances, textures and cameras. Default: gltf for .glb, vertex16 for .v16")
      ->check(one_of({kVertex16, kGltf}));
  verb.add_option("--codec", options->codec, "gltf: draco compresses (KHR_draco_mesh_compression), none stores floats")
      ->check(one_of({kDraco, kNone}))
      ->each(of_gltf)
      ->capture_default_str();
  verb.add_option("--level", options->gltf.codec.level, "draco: 0 fastest to 10 smallest")
      ->check(CLI::Range(0, 10))
      ->each(of_gltf)
      ->capture_default_str();
  verb.add_option("--normal-bits", options->gltf.codec.normal_bits, "draco: bits of normals, 2 to 30")
      ->check(CLI::Range(2, 30))
      ->each(of_gltf)
      ->capture_default_str();
  verb.add_option("--uv-bits", options->gltf.codec.uv_bits, "draco: bits of texture coordinates, 1 to 30")
      ->check(CLI::Range(1, 30))
      ->each(of_gltf)
      ->capture_default_str();
  verb.footer(
      "vertex16 packs position 3x21, normal 24, tangent 1+8 and uv 2x16 bits. docs/vertex16.md lays out the file,\n"
      "compress/exchange/vertex16/vertex16.glsl and vertex16_decode.h decode it. glTF positions stay on the file's "
      "lattice.\n"
      "Examples:\n"
      "  packtrace export house.ptk -o house.v16\n"
      "  packtrace export house.ptk -o house.glb --level 10\n"
      "  packtrace export house.ptk -o - --layout gltf | gltf_viewer /dev/stdin");
}

} // namespace packtrace
