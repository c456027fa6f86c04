#include "compress/format/deformation/deformation_view.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/deformation/frame_codec.h"

namespace packtrace {
namespace {

using Fault = std::optional<const char*>;

/// Bytes of an animation's tables. Does not overflow: at most 2^20 groups of 2^32 clusters.
uint64_t table_bytes(uint64_t groups, uint64_t clusters) {
  return (groups + 1) * sizeof(uint64_t) + groups * (clusters + 1) * sizeof(uint32_t);
}

bool frames_fit_lattice(const baked::DeformationRecord& record, const baked::GeometryRecord& geometry) {
  const double step = PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step();
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!tree_origin_of_frames(record.lo[axis], record.extent[axis])) return false;
    if (!std::isfinite(from_lattice(record.lo[axis], step))) return false;
    if (!std::isfinite(from_lattice(record.lo[axis] + record.extent[axis], step))) return false;
  }
  return true;
}

Fault find_record_fault(const baked::DeformationRecord& record, const baked::GeometryRecord& geometry) {
  if (geometry.cluster_count == 0 || (geometry.flags & baked::kWorldSpace) != 0) return "geometry";
  if (record.frame_count < 2 || record.frame_count > baked::kMaxFrames) return "number of frames";
  if (record.group_frames < 1 || record.group_frames > baked::kMaxGroupFrames) return "frames per group";
  if (record.reserved != 0) return "reserved field";
  if (!frames_fit_lattice(record, geometry)) return "box of all frames";
  if (record.vertex_count != geometry.vertex_count) return "number of vertices";
  if (!(record.frames_per_second > 0.0) || !std::isfinite(record.frames_per_second)) return "frames per second";
  if (!(record.max_position_error >= 0.0) || !std::isfinite(record.max_position_error)) return "position error";
  return std::nullopt;
}

Fault find_block_fault(std::span<const uint8_t> block, uint32_t vertex_count, uint32_t frames) {
  uint64_t bit = 0;
  for (uint32_t frame = 0; frame < frames; ++frame) {
    bit = skip_frame(block.data(), bit, 8 * block.size(), vertex_count, frame);
    if (bit == 0) return "frame";
  }
  return (bit + 7) / 8 == block.size() ? std::nullopt : Fault("bytes behind a frame");
}

/// Checks tables and blocks. Their extents within the section have been checked.
Fault find_blocks_fault(std::span<const uint8_t> section, const baked::DeformationRecord& record,
                        std::span<const baked::ClusterRecord> clusters) {
  const uint32_t groups = deformation_groups(record);
  const uint64_t count = clusters.size();
  const auto* begins = reinterpret_cast<const uint64_t*>(section.data() + record.table_offset);
  const auto* offsets = reinterpret_cast<const uint32_t*>(begins + groups + 1);
  if (begins[0] != 0 || begins[groups] != record.data_bytes) return "table of groups";
  for (uint32_t g = 0; g < groups; ++g) {
    if (begins[g] > begins[g + 1] || begins[g + 1] > record.data_bytes) return "table of groups";
    const uint32_t* of_group = offsets + g * (count + 1);
    if (of_group[0] != 0 || of_group[count] != begins[g + 1] - begins[g]) return "table of blocks";
    for (uint64_t c = 0; c < count; ++c)
      if (of_group[c] > of_group[c + 1]) return "table of blocks";
  }
  const DeformationView view(section, record, static_cast<uint32_t>(count));
  std::atomic<bool> good{true};
  tbb::parallel_for(uint32_t{0}, groups, [&](uint32_t g) {
    const uint32_t frames = std::min(record.group_frames, record.frame_count - view.first_frame(g));
    tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(count), [&](uint32_t c) {
      if (find_block_fault(view.block(g, c), clusters[c].vertex_count, frames)) good = false;
    });
  });
  return good ? std::nullopt : Fault("block of a cluster");
}

/// @param used by geometry that is no LOD level: whether it belongs to a chain; marks those of this one
Fault find_level_fault(const baked::LevelChainRecord& chain, std::span<const baked::GeometryRecord> geometries,
                       std::span<uint8_t> used) {
  if (chain.level_count < 2 || chain.level_count > baked::kMaxChainLevels) return "number of levels";
  if (chain.reserved != 0) return "reserved field";
  double nearer = 0.0;
  for (uint32_t level = 0; level < baked::kMaxChainLevels; ++level) {
    const uint32_t geometry = chain.geometry[level];
    const double distance = level + 1 < baked::kMaxChainLevels ? chain.distance[level] : 0.0;
    if (level + 1 >= chain.level_count && distance != 0.0) return "distances";
    if (level >= chain.level_count) {
      if (geometry != 0) return "geometry of a level";
      continue;
    }
    if (geometry >= used.size() || used[geometry] != 0) return "geometry of a level";
    used[geometry] = 1;
    if (geometries[geometry].cluster_count == 0 || (geometries[geometry].flags & baked::kWorldSpace) != 0)
      return "geometry of a level";
    if (level + 1 == chain.level_count) continue;
    if (!(distance > nearer) || !std::isfinite(distance)) return "distances";
    nearer = distance;
  }
  return std::nullopt;
}

} // namespace

DeformationView::DeformationView(std::span<const uint8_t> section, const baked::DeformationRecord& record,
                                 uint32_t clusters)
    : record_(&record), clusters_(clusters), group_count_(deformation_groups(record)),
      group_begins_(reinterpret_cast<const uint64_t*>(section.data() + record.table_offset)),
      offsets_(reinterpret_cast<const uint32_t*>(group_begins_ + group_count_ + 1)),
      data_(section.data() + record.data_offset) {}

std::span<const uint8_t> DeformationView::block(uint32_t group, uint32_t cluster) const {
  const uint32_t* offsets = offsets_ + uint64_t{group} * (uint64_t{clusters_} + 1);
  const uint8_t* begin = data_ + group_begins_[group];
  return {begin + offsets[cluster], begin + offsets[cluster + 1]};
}

std::span<const baked::DeformationRecord> deformation_records(std::span<const uint8_t> section) {
  if (section.empty()) return {};
  const auto* header = reinterpret_cast<const baked::DeformationHeader*>(section.data());
  return {reinterpret_cast<const baked::DeformationRecord*>(header + 1), header->animation_count};
}

std::span<const baked::LevelChainRecord> level_chains(std::span<const uint8_t> section) {
  if (section.empty()) return {};
  const auto* header = reinterpret_cast<const baked::DeformationHeader*>(section.data());
  const std::span<const baked::DeformationRecord> records = deformation_records(section);
  return {reinterpret_cast<const baked::LevelChainRecord*>(records.data() + records.size()), header->chain_count};
}

std::optional<MotionFault> find_chain_fault(std::span<const uint8_t> section,
                                            std::span<const baked::GeometryRecord> geometries,
                                            uint32_t base_geometries) {
  if (section.empty()) return std::nullopt;
  if (section.size() < sizeof(baked::DeformationHeader) + kReadSlackBytes) return MotionFault{0, "section size"};
  const auto* header = reinterpret_cast<const baked::DeformationHeader*>(section.data());
  const uint64_t room = section.size() - kReadSlackBytes - sizeof *header;
  if (header->animation_count == 0 && header->chain_count == 0) return MotionFault{0, "number of animations"};
  if (header->animation_count > room / sizeof(baked::DeformationRecord)) return MotionFault{0, "number of animations"};
  const uint64_t left = room - header->animation_count * sizeof(baked::DeformationRecord);
  if (header->chain_count > left / sizeof(baked::LevelChainRecord)) return MotionFault{0, "number of level chains"};
  std::vector<uint8_t> used(base_geometries, 0);
  const std::span<const baked::LevelChainRecord> chains = level_chains(section);
  for (size_t i = 0; i < chains.size(); ++i)
    if (const Fault fault = find_level_fault(chains[i], geometries, used)) return MotionFault{i, *fault};
  return std::nullopt;
}

std::optional<MotionFault> find_deformation_fault(std::span<const uint8_t> section,
                                                  std::span<const baked::GeometryRecord> geometries,
                                                  std::span<const baked::ClusterRecord> clusters,
                                                  uint32_t base_geometries) {
  if (section.empty()) return std::nullopt;
  if (const auto fault = find_chain_fault(section, geometries, base_geometries)) return fault;
  const uint64_t end = section.size() - kReadSlackBytes;
  const std::span<const baked::DeformationRecord> records = deformation_records(section);
  // Tables and data follow in order, at multiples of 8 bytes.
  uint64_t at = sizeof(baked::DeformationHeader) + records.size_bytes() + level_chains(section).size_bytes();
  for (size_t i = 0; i < records.size(); ++i) {
    const baked::DeformationRecord& record = records[i];
    if (record.geometry >= base_geometries || (i > 0 && record.geometry <= records[i - 1].geometry))
      return MotionFault{i, "geometry"};
    const baked::GeometryRecord& geometry = geometries[record.geometry];
    if (const Fault fault = find_record_fault(record, geometry)) return MotionFault{i, *fault};
    const uint64_t table = table_bytes(deformation_groups(record), geometry.cluster_count);
    if (record.table_offset != at || table > end - at) return MotionFault{i, "place of its tables"};
    if (record.data_offset != at + table || record.data_bytes > end - record.data_offset)
      return MotionFault{i, "place of its blocks"};
    at = (record.data_offset + record.data_bytes + 7) / 8 * 8;
    if (at > end) return MotionFault{i, "place of its blocks"};
    const auto own = clusters.subspan(static_cast<size_t>(geometry.first_cluster), geometry.cluster_count);
    if (const Fault fault = find_blocks_fault(section, record, own)) return MotionFault{i, *fault};
  }
  if (at != end) return MotionFault{records.empty() ? 0 : records.size() - 1, "bytes behind it"};
  return std::nullopt;
}

} // namespace packtrace
