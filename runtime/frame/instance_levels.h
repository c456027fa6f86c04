#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/deformation/deformation_format.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The levels of instances that a file chains by distance (baked::LevelChainRecord), frame by frame. A level begins
/// where the distance from the eye to the instance, the centre of the box of its chain's level 0, reaches the chain's.
class InstanceLevels {
public:
  explicit InstanceLevels(const BakedFile& file);

  bool empty() const { return members_.empty(); }

  /// Moves an instance before the next choose(). Has no effect on instances without levels.
  void move_instance(uint32_t instance, const Affine& world_from_object);

  /// An instance that changed its level.
  struct Change {
    uint32_t instance = 0, geometry = 0;
  };
  /// Chooses levels for a frame. A level changes by at most one per frame, so that successive frames show similar
  /// surfaces; the first frame after reset() has the right levels at once.
  void choose(DVec3 eye);
  /// Forgets the frame before.
  void reset() { first_ = true; }

  /// By geometry of the file: 1 if an instance shows it, or may without a chain.
  std::span<const uint8_t> used() const { return used_; }

  /// Levels of all instances with a chain, in order: what the next choose() depends on.
  std::vector<uint8_t> levels() const;
  /// Sets the levels of a frame, from which the next choose() continues. Returns false, without a change, if these are
  /// not levels of the file's instances.
  bool set_levels(std::span<const uint8_t> levels);
  /// Changes of the last choose() or set_levels().
  std::span<const Change> changes() const { return changes_; }

private:
  struct Member {
    uint32_t instance = 0, chain = 0;
    uint8_t level = 0;
    DVec3 centre{0.0}; ///< world space
  };
  const baked::LevelChainRecord& chain_of(const Member& member) const { return chains_[member.chain]; }
  void set_level(Member& member, uint8_t level);
  DVec3 centre(uint32_t chain, const Affine& world_from_object) const;

  std::span<const baked::LevelChainRecord> chains_;
  std::vector<DVec3> centres_;      ///< by chain: of the box of level 0, object space
  std::vector<Member> members_;     ///< by instance number
  std::vector<uint32_t> member_of_; ///< by instance; baked::kNone
  std::vector<uint32_t> shown_by_;  ///< by geometry: number of members
  std::vector<uint8_t> used_;
  std::vector<Change> changes_;
  bool first_ = true;
};

} // namespace packtrace
