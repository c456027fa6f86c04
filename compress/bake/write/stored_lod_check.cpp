#include "compress/bake/write/stored_lod_check.h"

#include "compress/bake/write/file_sections.h"
#include "compress/format/cluster/cluster_validation.h"
#include "compress/format/file/lod_validation.h"

namespace packtrace {
namespace {

std::optional<std::string_view> find_level_fault(const EncodedLod& lod) {
  for (size_t level = 0; level < lod.levels.size(); ++level) {
    const EncodedGeometry& e = lod.levels[level].encoded;
    if (level == 0 && !(e.clusters.empty() && e.payload.empty())) return "clusters of level 0";
    if (lod.levels[level].group_count > baked::kMaxLodGroups) return "number of groups";
    if (lod.levels[level].triangles > ~0u) return "number of triangles";
    if (e.payload.size() % 4 != 0) return "size of the payload";
    const uint64_t bits = 8 * uint64_t{e.payload.size()};
    for (const uint64_t stream :
         {e.stream_bits.indices, e.stream_bits.positions, e.stream_bits.normals, e.stream_bits.uvs})
      if (stream > bits) return "bits of a stream";
  }
  return std::nullopt;
}

} // namespace

std::optional<std::string_view> find_stored_lod_fault(const EncodedLod& lod, const LodBase& base) {
  if (lod.levels.size() > base.max_levels) return "number of levels";
  if (const auto fault = find_level_fault(lod)) return fault;
  // The file checks need a file, so they get one with this geometry only.
  FileSections file(Scene{}, {});
  file.add_geometry(base.record, base.encoded, {});
  file.add_lod(0, lod);
  const BakedSections sections = file.without_trees();
  if (const auto fault = find_lod_level_fault(sections)) return fault->what;
  for (const baked::GeometryRecord& g : sections.geometries.subspan(1)) {
    const auto clusters = sections.clusters.subspan(static_cast<size_t>(g.first_cluster), g.cluster_count);
    if (const auto fault = find_cluster_list_fault(g, clusters, sections.payload.data() + g.payload_offset,
                                                   [&](uint32_t slot) { return base.slot_class[slot]; }))
      return fault->what;
  }
  if (const auto fault = find_lod_group_fault(sections)) return fault->what;
  return std::nullopt;
}

} // namespace packtrace
