#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "compress/format/deformation/deformation_format.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/motion/motion_fault.h"

namespace packtrace {

/// One animation of a deformation section. Valid as long as the section, which must have been validated.
class DeformationView {
public:
  /// @param clusters number of clusters of the geometry
  DeformationView(std::span<const uint8_t> section, const baked::DeformationRecord& record, uint32_t clusters);

  const baked::DeformationRecord& record() const { return *record_; }
  uint32_t group_count() const { return group_count_; }
  uint32_t group_of(uint32_t frame) const { return frame / record_->group_frames; }
  /// Frames [first, first + count) of a group.
  uint32_t first_frame(uint32_t group) const { return group * record_->group_frames; }

  /// The block of a cluster: its frames of one group. 8 more bytes are readable.
  std::span<const uint8_t> block(uint32_t group, uint32_t cluster) const;

private:
  const baked::DeformationRecord* record_;
  uint32_t clusters_, group_count_;
  const uint64_t* group_begins_;
  const uint32_t* offsets_;
  const uint8_t* data_;
};

/// Number of groups of an animation.
inline uint32_t deformation_groups(const baked::DeformationRecord& record) {
  return record.frame_count / record.group_frames + (record.frame_count % record.group_frames != 0 ? 1 : 0);
}

/// Records of a section; none if it is empty.
std::span<const baked::DeformationRecord> deformation_records(std::span<const uint8_t> section);

/// Level chains of a section; none if it is empty.
std::span<const baked::LevelChainRecord> level_chains(std::span<const uint8_t> section);

/// Checks header and level chains, but not the material slots of their geometries.
/// @param section,geometries,base_geometries as below
std::optional<MotionFault> find_chain_fault(std::span<const uint8_t> section,
                                            std::span<const baked::GeometryRecord> geometries,
                                            uint32_t base_geometries);

/// Checks a section: all that DeformationView and decode_frame() rely on. Reads the sizes of all fields but not the
/// fields: vertices of a damaged file may lie outside the record's box (DeformedTree::update() rejects them).
/// @param section 8-byte aligned
/// @param geometries,clusters of the file, already checked
/// @param base_geometries number of geometries that are not LOD levels
std::optional<MotionFault> find_deformation_fault(std::span<const uint8_t> section,
                                                  std::span<const baked::GeometryRecord> geometries,
                                                  std::span<const baked::ClusterRecord> clusters,
                                                  uint32_t base_geometries);

} // namespace packtrace
