#include "runtime/commands/export_command.h"

#include <filesystem>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compress/bake/vertex16_export.h"
#include "pbrt_import/scene/error.h"
#include "pbrt_import/scene/file_bytes.h"
#include "pbrt_import/scene/output_file.h"
#include "runtime/commands/cli_support.h"
#include "runtime/commands/file_report.h"
#include "runtime/commands/json_output.h"
#include "runtime/commands/process_usage.h"
#include "runtime/commands/progress_display.h"

namespace packtrace {
namespace {

constexpr const char* kVertex16 = "vertex16";

struct ExportOptions {
  std::string input, output;
  std::string layout = kVertex16;
};

nlohmann::json to_json(const ExportOptions& options, const Vertex16Report& r) {
  return {{"verb", "export"},
          {"input", options.input},
          {"output", options.output},
          {"layout", options.layout},
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

int run(const ExportOptions& options, const GlobalOptions& globals) {
  std::error_code not_there;
  if (std::filesystem::equivalent(options.input, options.output, not_there))
    throw Error(ErrorKind::kUsage, options.output + ": the output is the input");
  JsonOutput json(globals.json, globals.force);
  OutputFile output(options.output, globals.force);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  const Vertex16Export result = export_vertex16(BakedFile::open(options.input), progress);
  write_file_bytes(output.path(), result.bytes);
  output.commit();
  display.finish();
  if (json.wanted()) json.write(to_json(options, result.report));
  if (json.to_stdout() || globals.quiet) return 0;
  fmt::print("{}", to_text(options, result.report));
  return 0;
}

} // namespace

void add_export_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App& verb = add_verb(app, globals, "export", "Write a .ptk file as plain vertex and index buffers",
                            [options, &globals] { return run(*options, globals); });
  verb.add_option("FILE", options->input, "A .ptk file")->required();
  verb.add_option("-o,--output", options->output, "The file to write")->type_name("FILE")->required();
  verb.add_option("--layout", options->layout, "vertex16: 16 bytes a vertex, 16- or 32-bit indices")
      ->check(CLI::IsMember({kVertex16}))
      ->default_str(kVertex16);
  verb.footer(
      "vertex16 packs position 3x21, normal 24, tangent 1+8 and uv 2x16 bits. docs/vertex16.md lays out the file,\n"
      "compress/format/vertex16.glsl and vertex16_decode.h decode it.\n"
      "Example:\n"
      "  packtrace export house.ptk -o house.v16 --layout vertex16");
}

} // namespace packtrace
