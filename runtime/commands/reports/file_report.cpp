#include "runtime/commands/reports/file_report.h"
#include "runtime/commands/reports/proxy_report.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/commands/reports/lod_report.h"
#include "runtime/commands/reports/requirement_report.h"

namespace packtrace {
namespace {

using Row = std::pair<const char*, uint64_t>;

std::array<Row, 24> stream_rows(const StreamBytes& bytes) {
  return {{{"indices", bytes.indices},
           {"positions", bytes.positions},
           {"normals", bytes.normals},
           {"uvs", bytes.uvs},
           {"payload_padding", bytes.payload_padding},
           {"cluster_records", bytes.cluster_records},
           {"geometry_records", bytes.geometry_records},
           {"instance_records", bytes.instance_records},
           {"material_records", bytes.material_records},
           {"masks", bytes.masks},
           {"textures", bytes.textures},
           {"cameras", bytes.cameras},
           {"strings", bytes.strings},
           {"requirement_records", bytes.requirement_records},
           {"lod_records", bytes.lod_records},
           {"trees", bytes.trees},
           {"rigid_motion", bytes.rigid_motion},
           {"deformation", bytes.deformation},
           {"shading_materials", bytes.shading_materials},
           {"lights", bytes.lights},
           {"environment_maps", bytes.environment_maps},
           {"proxies", bytes.proxies},
           {"header_and_alignment", bytes.header_and_alignment},
           {"total", bytes.total}}};
}

std::array<std::pair<const char*, uint64_t>, kPageStreams + 2> disk_rows(const DiskForm& disk) {
  const auto& bytes = disk.stream_bytes;
  const auto of = [&](PageStream stream) { return bytes[static_cast<size_t>(stream)]; };
  return {{{"topology", of(PageStream::kTopology)},
           {"positions", of(PageStream::kPositions)},
           {"normals", of(PageStream::kNormals)},
           {"uvs", of(PageStream::kUvs)},
           {"cluster_records", of(PageStream::kRecords)},
           {"trees", disk.node_bytes},
           {"tables", disk.table_bytes}}};
}

nlohmann::json disk_json(const DiskForm& disk) {
  nlohmann::json json = {{"codec", name_of(disk.codec)}, {"bytes", disk.file_bytes}};
  if (disk.codec == PageCodec::kNone) return json;
  json["pages"] = disk.page_count;
  for (const auto& [name, bytes] : disk_rows(disk)) json["streams"][name] = bytes;
  return json;
}

const char* precision_name(uint32_t kind) {
  constexpr std::array<const char*, 4> kNames{"edge_fraction", "diagonal_fraction", "absolute", "position_bits"};
  return kind < kNames.size() ? kNames[kind] : "unknown";
}

nlohmann::json grids_json(const FileSummary& s) {
  nlohmann::json grids = nlohmann::json::array();
  for (const GridUse& use : s.grids)
    grids.push_back({{"step", use.grid.step()}, {"world_space", use.world_space}, {"geometries", use.geometries}});
  return grids;
}

nlohmann::json normals_json(const FileSummary& s) {
  nlohmann::json normals = nlohmann::json::array();
  for (const NormalUse& use : s.normals)
    normals.push_back({{"encoding", format_of(use.encoding).name},
                       {"geometries", use.geometries},
                       {"vertices", use.vertices},
                       {"max_error_degrees", use.max_error_degrees}});
  return normals;
}

nlohmann::json uvs_json(const FileSummary& s) {
  nlohmann::json uvs = nlohmann::json::array();
  for (const UvUse& use : s.uvs)
    uvs.push_back({{"encoding", kUvEncodingNames[static_cast<size_t>(use.encoding)]},
                   {"geometries", use.geometries},
                   {"vertices", use.vertices},
                   {"max_error", use.max_error},
                   {"max_error_texels", use.max_error_texels}});
  return uvs;
}

nlohmann::json textures_json(const FileSummary& s) {
  nlohmann::json textures = nlohmann::json::array();
  for (const TextureUse& use : s.textures)
    textures.push_back({{"name", use.name},
                        {"width", use.width},
                        {"height", use.height},
                        {"codec", kTextureCodecNames[static_cast<size_t>(use.codec)]},
                        {"bytes", use.bytes},
                        {"psnr_db", use.psnr_db}});
  return textures;
}

nlohmann::json motion_json(const MotionSummary& motion) {
  nlohmann::json geometries = nlohmann::json::array();
  for (const MovingGeometry& moving : motion.geometries)
    geometries.push_back({{"name", moving.name}, {"instances", moving.instances}});
  const bool moves = motion.time.begin_s <= motion.time.end_s;
  return {{"instances", motion.instances},
          {"cameras", motion.cameras},
          {"tracks", motion.tracks},
          {"keys", motion.keys},
          {"begin_s", moves ? nlohmann::json(motion.time.begin_s) : nullptr},
          {"end_s", moves ? nlohmann::json(motion.time.end_s) : nullptr},
          {"max_error", motion.max_error_world},
          {"max_camera_error", motion.max_camera_error},
          {"geometries", geometries}};
}

std::array<double, 3> array_of(DVec3 v) { return {v.x, v.y, v.z}; }

nlohmann::json level_chains_json(const FileSummary& s) {
  nlohmann::json chains = nlohmann::json::array();
  for (const LevelChainUse& use : s.level_chains)
    chains.push_back({{"geometries", use.names}, {"distances", use.distances}, {"instances", use.instances}});
  return chains;
}

nlohmann::json sequences_json(const FileSummary& s) {
  nlohmann::json json = nlohmann::json::array();
  for (const SequenceUse& use : s.sequences)
    json.push_back({{"name", use.name},
                    {"frames", use.frames},
                    {"group_frames", use.group_frames},
                    {"frames_per_second", use.frames_per_second},
                    {"first_number", use.first_number},
                    {"source_vertices", use.source_vertices},
                    {"bytes", use.bytes},
                    {"bytes_per_vertex", use.bytes_per_vertex()},
                    {"max_position_error", use.max_position_error}});
  return json;
}

} // namespace

std::vector<std::pair<std::string, uint64_t>> stream_bytes(const StreamBytes& bytes) {
  std::vector<std::pair<std::string, uint64_t>> streams;
  for (const auto& [name, count] : stream_rows(bytes))
    if (count > 0) streams.emplace_back(name, count);
  return streams;
}

const std::locale& grouped() {
  struct Thousands : std::numpunct<char> {
    char do_thousands_sep() const override { return ','; }
    std::string do_grouping() const override { return "\3"; }
  };
  static const std::locale kLocale(std::locale::classic(), new Thousands); // the locale deletes it
  return kLocale;
}

nlohmann::json to_json(const FileSummary& s, bool by_geometry) {
  nlohmann::json bytes;
  for (const auto& [name, count] : stream_rows(s.bytes)) bytes[name] = count;
  return {
      {"triangles", s.triangles},
      {"placed_triangles", s.placed_triangles},
      {"vertices", s.vertices},
      {"clusters", s.clusters},
      {"triangles_per_cluster", s.triangles_per_cluster},
      {"geometries", s.geometries},
      {"shared_geometries", s.shared_geometries},
      {"instances", s.instances},
      {"materials", s.materials},
      {"masks", s.masks},
      {"cameras", s.cameras},
      {"bytes", bytes},
      {"bytes_per_triangle", s.bytes_per_triangle},
      {"bytes_per_placed_triangle", s.bytes_per_placed_triangle},
      {"disk", disk_json(s.disk)},
      {"grids", grids_json(s)},
      {"normals", normals_json(s)},
      {"uvs", uvs_json(s)},
      {"textures", textures_json(s)},
      {"proxies", proxies_json(s)},
      {"max_position_error", s.max_position_error},
      {"max_position_error_bound", s.max_position_error_bound},
      {"max_normal_error_degrees", s.max_normal_error_degrees},
      {"max_uv_error", s.max_uv_error},
      {"bounds", {{"lo", array_of(s.bounds.lo)}, {"hi", array_of(s.bounds.hi)}}},
      {"precision", {{"kind", precision_name(s.bake.precision_kind)}, {"value", s.bake.precision_value}}},
      {"source_triangles", s.bake.source_triangles},
      {"dropped_triangles", s.bake.dropped_triangles},
      {"unused_triangles", s.bake.unused_triangles},
      {"collapsed_triangles", s.bake.collapsed_triangles},
      {"coinciding_triangles", s.bake.coinciding_triangles},
      {"source_area", s.bake.source_area},
      {"collapsed_area", s.bake.collapsed_area},
      {"merged_vertices", s.bake.merged_vertices},
      {"requirements", requirements_json(s, by_geometry)},
      {"lod", lod_json(s, by_geometry)},
      {"sequences", sequences_json(s)},
      {"distance_levels", level_chains_json(s)},
      {"trees", {{"trees", s.trees}, {"nodes", s.nodes}, {"depth", s.tree_depth}}},
      {"motion", motion_json(s.motion)},
  };
}

std::string sequences_text(const FileSummary& s) {
  std::string text;
  for (const SequenceUse& use : s.sequences)
    text += fmt::format(grouped(),
                        "{} deforms: {:L} frames from number {} at {:g} per second, {:L} vertices, {:L} bytes ({:.3f} "
                        "per vertex and frame), position error {:.3g}\n",
                        use.name, use.frames, use.first_number, use.frames_per_second, use.source_vertices, use.bytes,
                        use.bytes_per_vertex(), use.max_position_error);
  for (const LevelChainUse& use : s.level_chains)
    text += fmt::format(grouped(), "{:L} instances show {} from distances 0, {:g} on\n", use.instances,
                        fmt::join(use.names, ", "), fmt::join(use.distances, ", "));
  return text;
}

std::string size_text(const FileSummary& s) {
  const auto bytes_each = [&](uint64_t bytes) {
    return s.triangles > 0 ? static_cast<double>(bytes) / static_cast<double>(s.triangles) : 0.0;
  };
  const uint64_t on_disk = s.disk.file_bytes, resident = s.bytes.total;
  if (s.disk.codec == PageCodec::kNone)
    return fmt::format(grouped(), "{:L} triangles; {:L} bytes on disk and in memory, {:.3f} per triangle\n",
                       s.triangles, resident, bytes_each(resident));
  return fmt::format(grouped(),
                     "{:L} triangles; {:L} bytes on disk, {:.3f} per triangle (codec {}); {:L} bytes in memory, {:.3f} "
                     "per triangle\n",
                     s.triangles, on_disk, bytes_each(on_disk), name_of(s.disk.codec), resident, bytes_each(resident));
}

std::string collapsed_text(const FileSummary& s) {
  if (s.bake.collapsed_triangles + s.bake.coinciding_triangles == 0) return {};
  const double share = s.bake.source_area > 0.0 ? s.bake.collapsed_area / s.bake.source_area : 0.0;
  return fmt::format(
      grouped(),
      "dropped because the grid is too coarse for them: {:L} degenerate triangles ({:.3g} % of the source "
      "area), {:L} duplicates\n",
      s.bake.collapsed_triangles, 100.0 * share, s.bake.coinciding_triangles);
}

std::string motion_text(const MotionSummary& motion) {
  constexpr size_t kMaxNames = 4;
  if (motion.instances + motion.cameras == 0) return {};
  std::string text =
      fmt::format(grouped(),
                  "moving   instances {:L}   cameras {:L}   from {:g} s to {:g} s   ({:L} tracks, {:L} keys, "
                  "error at most {:.3g})\n",
                  motion.instances, motion.cameras, motion.time.begin_s, motion.time.end_s, motion.tracks, motion.keys,
                  motion.max_error_world);
  for (size_t i = 0; i < std::min(motion.geometries.size(), kMaxNames); ++i)
    text += fmt::format(grouped(), "  {} ({:L})\n", motion.geometries[i].name, motion.geometries[i].instances);
  if (motion.geometries.size() > kMaxNames)
    text += fmt::format("  and {} more geometries; --json lists them\n", motion.geometries.size() - kMaxNames);
  return text;
}

std::string disk_text(const FileSummary& s) {
  if (s.disk.codec == PageCodec::kNone) return {};
  return fmt::format(grouped(), "on disk with codec {}: {:L} bytes, {:.3f} per triangle, in {:L} pages\n",
                     name_of(s.disk.codec), s.disk.file_bytes,
                     s.triangles > 0 ? static_cast<double>(s.disk.file_bytes) / static_cast<double>(s.triangles) : 0.0,
                     s.disk.page_count);
}

std::string to_text(const FileSummary& s, bool by_geometry) {
  const auto triangles = static_cast<double>(s.triangles);
  std::string text =
      fmt::format(grouped(),
                  "triangles {:L} stored, {:L} placed   vertices {:L}   clusters {:L} ({:.1f} triangles each)\n"
                  "geometries {:L} ({:L} shared)   instances {:L}   materials {:L}   masks {:L}   cameras {:L}\n",
                  s.triangles, s.placed_triangles, s.vertices, s.clusters, s.triangles_per_cluster, s.geometries,
                  s.shared_geometries, s.instances, s.materials, s.masks, s.cameras);
  const DVec3 extent = s.bounds.extent();
  text += fmt::format("bounds {:.6g} x {:.6g} x {:.6g}", extent.x, extent.y, extent.z);
  if (!s.grids.empty())
    text += fmt::format("   grid step {:.4g}{}{}", s.grids.front().grid.step(),
                        s.grids.front().world_space ? " (world)" : "",
                        s.grids.size() > 1 ? fmt::format(" and {} more", s.grids.size() - 1) : std::string());
  text += "\n" + collapsed_text(s) + motion_text(s.motion);
  text += fmt::format("measured error: position {:.4g} (bound {:.4g})   normal {:.4f} degrees\n\n",
                      s.max_position_error, s.max_position_error_bound, s.max_normal_error_degrees);
  for (const NormalUse& use : s.normals)
    text += fmt::format(grouped(), "normals {}: {:L} geometries, {:L} vertices, error {:.4f} degrees\n",
                        format_of(use.encoding).name, use.geometries, use.vertices, use.max_error_degrees);
  for (const UvUse& use : s.uvs)
    text += fmt::format(grouped(), "uvs {}: {:L} geometries, {:L} vertices, error {:.3g} (at most {:.3g} texels)\n",
                        kUvEncodingNames[static_cast<size_t>(use.encoding)], use.geometries, use.vertices,
                        use.max_error, use.max_error_texels);
  if (!s.normals.empty() || !s.uvs.empty()) text += "\n";
  for (const TextureUse& use : s.textures)
    text += fmt::format(grouped(), "texture {}: {:L} x {:L}, {}, {:L} bytes, PSNR {:.2f} dB\n", use.name, use.width,
                        use.height, kTextureCodecNames[static_cast<size_t>(use.codec)], use.bytes, use.psnr_db);
  if (!s.textures.empty()) text += "\n";
  text += fmt::format("{:<22}{:>14}{:>16}\n", "stream", "bytes", "per triangle");
  for (const auto& [name, bytes] : stream_rows(s.bytes))
    if (bytes > 0)
      text += fmt::format(grouped(), "{:<22}{:>14L}{:>16.3f}\n", name, bytes,
                          triangles > 0 ? static_cast<double>(bytes) / triangles : 0.0);
  if (s.trees > 0)
    text +=
        fmt::format(grouped(), "{:L} BVH trees with {:L} nodes, maximum depth {}\n", s.trees, s.nodes, s.tree_depth);
  else
    text += "no BVH trees: render builds them\n";
  if (s.disk.codec != PageCodec::kNone) {
    text += "\n" + disk_text(s);
    for (const auto& [name, bytes] : disk_rows(s.disk))
      if (bytes > 0)
        text += fmt::format(grouped(), "{:<22}{:>14L}{:>16.3f}\n", name, bytes,
                            triangles > 0 ? static_cast<double>(bytes) / triangles : 0.0);
  }
  if (s.placed_triangles != s.triangles)
    text +=
        fmt::format(grouped(), "{:<22}{:>14L}{:>16.3f}\n", "total, placed", s.bytes.total, s.bytes_per_placed_triangle);
  text += sequences_text(s);
  return text + "\n" + proxies_text(s, by_geometry) + lod_text(s, by_geometry) + requirements_text(s, by_geometry);
}

} // namespace packtrace
