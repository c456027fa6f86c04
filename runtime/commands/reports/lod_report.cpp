#include "runtime/commands/reports/lod_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/commands/reports/file_report.h"

namespace packtrace {
namespace {

double ratio(uint64_t a, uint64_t b) { return b > 0 ? static_cast<double>(a) / static_cast<double>(b) : 0.0; }

uint64_t whole_bytes(uint64_t bits) { return (bits + 7) / 8; }

nlohmann::json table_json(const LodTable& table) {
  nlohmann::json levels = nlohmann::json::array();
  for (const LodLevelUse& use : table.levels)
    levels.push_back({{"geometries", use.geometries},
                      {"clusters", use.clusters},
                      {"groups", use.groups},
                      {"terminal_groups", use.terminal_groups},
                      {"own_triangles", use.own_triangles},
                      {"triangles", use.triangles},
                      {"max_error", use.max_error},
                      {"max_error_diagonals", use.max_error_diagonals},
                      {"bytes",
                       {{"indices", whole_bytes(use.stream_bits.indices)},
                        {"positions", whole_bytes(use.stream_bits.positions)},
                        {"normals", whole_bytes(use.stream_bits.normals)},
                        {"uvs", whole_bytes(use.stream_bits.uvs)},
                        {"total", use.bytes}}}});
  return {{"triangles", table.base_triangles()},
          {"bytes", table.bytes()},
          {"bytes_per_triangle", table.bytes_per_triangle()},
          {"levels", std::move(levels)}};
}

std::string table_text(const LodTable& table) {
  std::string text = fmt::format("{:<6}{:>10}{:>13}{:>9}{:>12}{:>9}{:>13}{:>13}{:>13}{:>13}\n", "level", "clusters",
                                 "triangles", "of all", "error", "% diag", "topology", "positions", "normals", "total");
  for (size_t level = 0; level < table.levels.size(); ++level) {
    const LodLevelUse& use = table.levels[level];
    text += fmt::format(grouped(), "{:<6}{:>10L}{:>13L}{:>8.2f}%{:>12.4g}{:>9.4f}{:>13L}{:>13L}{:>13L}{:>13L}\n", level,
                        use.clusters, use.triangles, 100.0 * ratio(use.triangles, table.base_triangles()),
                        use.max_error, 100.0 * use.max_error_diagonals, whole_bytes(use.stream_bits.indices),
                        whole_bytes(use.stream_bits.positions), whole_bytes(use.stream_bits.normals), use.bytes);
  }
  return text + fmt::format(grouped(), "all levels: {:L} bytes, {:.3f} per triangle of level 0 ({:L} triangles)\n",
                            table.bytes(), table.bytes_per_triangle(), table.base_triangles());
}

} // namespace

nlohmann::json lod_json(const FileSummary& summary, bool by_geometry) {
  const LodSummary& lod = summary.lod;
  if (lod.by_geometry.empty()) return nullptr;
  nlohmann::json json = table_json(lod.all);
  json["geometries"] = lod.by_geometry.size();
  if (!by_geometry) return json;
  for (const LodSummary::OfGeometry& one : lod.by_geometry) {
    nlohmann::json of_one = table_json(one.table);
    of_one["name"] = summary.by_geometry[one.geometry].name;
    of_one["geometry"] = one.geometry;
    json["by_geometry"].push_back(std::move(of_one));
  }
  return json;
}

std::string lod_text(const FileSummary& summary, bool by_geometry) {
  const LodSummary& lod = summary.lod;
  if (lod.by_geometry.empty()) return {};
  std::string text = fmt::format(grouped(), "LOD levels of {:L} geometries\n", lod.by_geometry.size());
  text += table_text(lod.all) + "\n";
  if (!by_geometry || lod.by_geometry.size() == 1) return text;
  for (const LodSummary::OfGeometry& one : lod.by_geometry)
    text += fmt::format("geometry {} {}\n{}\n", one.geometry, summary.by_geometry[one.geometry].name,
                        table_text(one.table));
  return text;
}

} // namespace packtrace
