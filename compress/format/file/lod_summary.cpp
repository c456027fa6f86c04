#include "compress/format/file/lod_summary.h"

#include <algorithm>
#include <cmath>

#include "compress/format/file/baked_file.h"

namespace packtrace {
namespace {

double diagonal(const baked::GeometryRecord& g) {
  double squared = 0.0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double extent = double{g.bounds_hi[axis]} - double{g.bounds_lo[axis]};
    squared += extent * extent;
  }
  return std::sqrt(squared);
}

void add(ClusterView::StreamBits& total, const ClusterView::StreamBits& bits) {
  total.indices += bits.indices, total.positions += bits.positions;
  total.normals += bits.normals, total.uvs += bits.uvs;
}

LodLevelUse use_of(const BakedFile& file, const LodView& lod, size_t number) {
  const baked::LodLevelRecord& level = lod.levels[number];
  const baked::GeometryRecord& g = file.geometries()[level.geometry];
  LodLevelUse use;
  use.geometries = 1;
  use.clusters = g.cluster_count, use.groups = level.group_count;
  for (const baked::LodGroupRecord& group : lod.groups_of(number)) use.terminal_groups += std::isinf(group.error);
  use.own_triangles = g.triangle_count, use.triangles = level.triangles;
  use.max_error = level.error;
  const double size = diagonal(file.geometries()[level.base]);
  use.max_error_diagonals = size > 0.0 ? use.max_error / size : 0.0;
  for (uint32_t c = 0; c < g.cluster_count; ++c) add(use.stream_bits, file.cluster(level.geometry, c).stream_bits());
  use.bytes = g.payload_bytes + g.cluster_count * (sizeof(baked::ClusterRecord) + sizeof(baked::LodLinkRecord)) +
              level.group_count * sizeof(baked::LodGroupRecord) + sizeof level + sizeof g;
  return use;
}

/// Adds the levels of one geometry to the totals.
void add(LodTable& all, const LodTable& one) {
  LodLevelUse above; // initial values of a new level: the sum over the last levels of the geometries before
  if (!all.levels.empty()) {
    const LodLevelUse& last = all.levels.back();
    above.triangles = last.triangles;
    above.max_error = last.max_error, above.max_error_diagonals = last.max_error_diagonals;
  }
  if (all.levels.size() < one.levels.size()) all.levels.resize(one.levels.size(), above);
  for (size_t i = 0; i < all.levels.size(); ++i) {
    LodLevelUse& to = all.levels[i];
    const LodLevelUse& from = one.levels[std::min(i, one.levels.size() - 1)];
    to.triangles += from.triangles;
    to.max_error = std::max(to.max_error, from.max_error);
    to.max_error_diagonals = std::max(to.max_error_diagonals, from.max_error_diagonals);
    if (i >= one.levels.size()) continue;
    to.geometries += from.geometries, to.clusters += from.clusters;
    to.groups += from.groups, to.terminal_groups += from.terminal_groups;
    to.own_triangles += from.own_triangles, to.bytes += from.bytes;
    add(to.stream_bits, from.stream_bits);
  }
}

} // namespace

uint64_t LodTable::bytes() const {
  uint64_t sum = 0;
  for (const LodLevelUse& level : levels) sum += level.bytes;
  return sum;
}

double LodTable::bytes_per_triangle() const {
  return base_triangles() > 0 ? static_cast<double>(bytes()) / static_cast<double>(base_triangles()) : 0.0;
}

LodSummary summarize_lod(const BakedFile& file) {
  LodSummary summary;
  for (const baked::LodLevelRecord& record : file.sections().lod_levels) {
    if (record.level != 0) continue;
    const LodView lod = file.lod(record.base);
    LodTable table;
    for (size_t level = 0; level < lod.levels.size(); ++level) table.levels.push_back(use_of(file, lod, level));
    add(summary.all, table);
    summary.by_geometry.push_back({record.base, std::move(table)});
  }
  return summary;
}

} // namespace packtrace
