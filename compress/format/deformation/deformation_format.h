#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

/// Layout of the deformation section of a .ptk file; docs/baked_format.md describes it. The section is empty if no
/// geometry deforms or changes with the distance, else it holds
///   DeformationHeader
///   DeformationRecord[animation_count], by ascending geometry
///   LevelChainRecord[chain_count]
///   per animation, at table_offset: uint64_t[groups + 1], where the blocks of each group of frames begin, from
///     data_offset; then uint32_t[groups][clusters + 1], where the block of each cluster begins, from its group's begin
///   per animation, at data_offset: the blocks
///   8 zero bytes
namespace packtrace::baked {

struct DeformationHeader {
  uint32_t animation_count;
  uint32_t chain_count;
};

/// All frames of one geometry. Its clusters hold frame 0.
struct DeformationRecord {
  uint32_t geometry;
  uint32_t frame_count;  ///< 2..kMaxFrames
  uint32_t group_frames; ///< frames per group, 1..kMaxGroupFrames; the last group may have fewer
  uint32_t reserved;
  std::array<int64_t, 3> lo;      ///< low corner of the box of all frames, in lattice steps
  std::array<uint32_t, 3> extent; ///< size of the box in lattice steps, at most kMaxFrameExtent
  uint32_t vertex_count;          ///< of the geometry, as stored: the sum over its clusters
  double frames_per_second;       ///< finite, positive
  double max_position_error;      ///< of all frames, measured against the source; largest axis, object units
  int64_t first_number;           ///< number of frame 0 in the names of the source's files
  uint64_t table_offset;          ///< bytes into the section, multiple of 8
  uint64_t data_offset;           ///< bytes into the section
  uint64_t data_bytes;
  uint64_t source_vertices; ///< per frame
};

inline constexpr uint32_t kMaxChainLevels = 8;

/// Geometries that replace each other by distance, fine to coarse. All instances of each of them take
/// part. A geometry belongs to one chain at most.
struct LevelChainRecord {
  uint32_t level_count; ///< 2..kMaxChainLevels
  uint32_t reserved;
  std::array<uint32_t, kMaxChainLevels> geometry;   ///< with as many material slots of the same classes; unused ones 0
  std::array<double, kMaxChainLevels - 1> distance; ///< world units, ascending: where the next level begins; unused 0
};

inline constexpr uint32_t kMaxFrames = 1u << 20;
inline constexpr uint32_t kMaxGroupFrames = 64;

static_assert(sizeof(DeformationHeader) == 8 && std::is_trivially_copyable_v<DeformationHeader>);
static_assert(sizeof(LevelChainRecord) == 96 && std::is_trivially_copyable_v<LevelChainRecord> &&
              offsetof(LevelChainRecord, distance) == 40);
static_assert(sizeof(DeformationRecord) == 112 && std::is_trivially_copyable_v<DeformationRecord> &&
              offsetof(DeformationRecord, lo) == 16 && offsetof(DeformationRecord, frames_per_second) == 56 &&
              offsetof(DeformationRecord, table_offset) == 80);

} // namespace packtrace::baked
