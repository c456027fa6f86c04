#include "runtime/commands/export/export_reports.h"

#include <cmath>

#include <fmt/format.h>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/reports/file_report.h"

namespace packtrace {
namespace {

constexpr const char* kMotionLeftOut = "motion is left out: everything is where it was at the time of the bake\n";

nlohmann::json to_json(const std::vector<ExportLoss>& losses) {
  nlohmann::json counts = nlohmann::json::object();
  for (const ExportLoss& loss : losses) counts[std::string(loss.key)] = loss.count;
  return counts;
}

std::string to_text(const std::vector<ExportLoss>& losses) {
  std::string text;
  for (const ExportLoss& loss : losses) text += fmt::format(grouped(), "{:L} {}\n", loss.count, loss.what);
  return text;
}

} // namespace

nlohmann::json to_json(const ExportNames& names, const Vertex16Report& r) {
  return {{"verb", "export"},
          {"input", names.input},
          {"output", names.output},
          {"layout", "vertex16"},
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

std::string to_text(const ExportNames& names, const Vertex16Report& r) {
  const double per = r.triangles > 0 ? 1.0 / static_cast<double>(r.triangles) : 0.0;
  std::string text = fmt::format(
      grouped(),
      "{}: {:L} vertices, {:L} triangles in {:L} draws of {:L} geometries; {:L} bytes, {:.2f} per triangle "
      "({:.2f} vertices, {:.2f} indices)\n"
      "maximum error against the .ptk file: position {:.3g}   normal {:.4f} degrees   uv {:.3g}   tangent {:.3f} "
      "degrees\n",
      names.output, r.vertices, r.triangles, r.draws, r.geometries, r.file_bytes,
      static_cast<double>(r.file_bytes) * per, static_cast<double>(r.vertex_bytes) * per,
      static_cast<double>(r.index_bytes) * per, r.max_position_error, r.max_normal_error_degrees, r.max_uv_error,
      r.max_tangent_error_degrees);
  if (r.coarser_geometries > 0)
    text +=
        fmt::format(grouped(), "{:L} geometries span more than 2^21 grid steps and were rounded to a coarser grid\n",
                    r.coarser_geometries);
  return text;
}

nlohmann::json to_json(const ExportNames& names, const GltfReport& r) {
  return {{"verb", "export"},
          {"input", names.input},
          {"output", names.output},
          {"layout", "gltf"},
          {"profile", names.profile},
          {"codec", names.codec},
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
          {"moving", r.moving},
          {"losses", to_json(r.losses)},
          {"levels", r.levels},
          {"max_normal_error_degrees", r.max_normal_error_degrees},
          {"max_uv_error", r.max_uv_error},
          {"max_placement_error", r.max_placement_error},
          {"min_texture_psnr", std::isfinite(r.min_texture_psnr) ? nlohmann::json(r.min_texture_psnr) : nullptr},
          {"peak_rss_bytes", peak_rss_bytes()}};
}

std::string to_text(const ExportNames& names, const GltfReport& r) {
  const double per = r.triangles > 0 ? 1.0 / static_cast<double>(r.triangles) : 0.0;
  std::string text = fmt::format(
      grouped(),
      "{}: {:L} vertices, {:L} triangles in {:L} primitives; {:L} meshes, {:L} nodes, {:L} materials, {:L} images, "
      "{:L} cameras\n{:L} bytes: geometry {:L} ({:.2f} per triangle), images {:L}\n",
      names.output, r.vertices, r.triangles, r.primitives, r.meshes, r.nodes, r.materials, r.images, r.cameras,
      r.file_bytes, r.geometry_bytes, static_cast<double>(r.geometry_bytes) * per, r.image_bytes);
  if (names.codec == "meshopt")
    text +=
        fmt::format("maximum error against the .ptk file: normal {:.2f} degrees   uv {:.3g}   placement of instances "
                    "{:.3g}   PSNR of textures {}\n",
                    r.max_normal_error_degrees, r.max_uv_error, r.max_placement_error,
                    std::isfinite(r.min_texture_psnr) ? fmt::format("{:.1f} dB", r.min_texture_psnr) : "exact");
  if (r.levels > 0) text += fmt::format(grouped(), "{:L} levels of detail of instances\n", r.levels);
  const auto note = [&](uint64_t count, const char* what) {
    if (count > 0) text += fmt::format(grouped(), "{:L} {}\n", count, what);
  };
  note(r.collapsed_triangles, "degenerate triangles (with two equal corners) were dropped");
  note(r.plain_primitives,
       "primitives are stored as floats: their lattice has too many bits for the codec, or Draco cannot encode them");
  note(r.simplified_materials, "materials lost their texture, because it is mapped differently from their alpha mask");
  note(r.skipped_cameras, "cameras were skipped, because glTF has no environment cameras");
  if (r.moving) text += kMotionLeftOut;
  text += to_text(r.losses);
  return text;
}

nlohmann::json to_json(const ExportNames& names, const SceneReport& r) {
  return {{"verb", "export"},
          {"input", names.input},
          {"output", names.output},
          {"layout", names.layout},
          {"shapes", r.shapes},
          {"objects", r.objects},
          {"instances", r.instances},
          {"materials", r.materials},
          {"images", r.images},
          {"cameras", r.cameras},
          {"vertices", r.vertices},
          {"triangles", r.triangles},
          {"moving", r.moving != 0},
          {"losses", to_json(r.losses)},
          {"bytes", {{"total", r.file_bytes}}},
          {"peak_rss_bytes", peak_rss_bytes()}};
}

std::string to_text(const ExportNames& names, const SceneReport& r) {
  std::string text =
      fmt::format(grouped(),
                  "{}: {:L} vertices, {:L} triangles; {:L} shapes, {:L} instances, {:L} materials, {:L} images; "
                  "{:L} bytes in all files\n",
                  names.output, r.vertices, r.triangles, r.shapes, r.instances, r.materials, r.images, r.file_bytes);
  if (r.moving != 0) text += kMotionLeftOut;
  text += to_text(r.losses);
  return text;
}

} // namespace packtrace
