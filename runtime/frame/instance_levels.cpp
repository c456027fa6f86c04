#include "runtime/frame/instance_levels.h"

#include <algorithm>

#include "compress/format/deformation/deformation_view.h"

namespace packtrace {

InstanceLevels::InstanceLevels(const BakedFile& file) : chains_(level_chains(file.sections().deformation)) {
  if (chains_.empty()) return;
  struct Place {
    uint32_t chain = baked::kNone;
    uint8_t level = 0;
  };
  std::vector<Place> place_of(file.geometries().size());
  used_.assign(file.geometries().size(), 1);
  for (uint32_t c = 0; c < chains_.size(); ++c) {
    centres_.push_back(object_bounds(file.geometries()[chains_[c].geometry[0]]).centre());
    for (uint8_t level = 0; level < chains_[c].level_count; ++level)
      place_of[chains_[c].geometry[level]] = {c, level}, used_[chains_[c].geometry[level]] = 0;
  }
  shown_by_.assign(file.geometries().size(), 0);
  member_of_.assign(file.instances().size(), baked::kNone);
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    const uint32_t geometry = file.instances()[i].geometry;
    const Place place = place_of[geometry];
    if (place.chain == baked::kNone) continue;
    member_of_[i] = static_cast<uint32_t>(members_.size());
    members_.push_back({i, place.chain, place.level, centre(place.chain, file.world_from_object(i))});
    ++shown_by_[geometry], used_[geometry] = 1;
  }
}

DVec3 InstanceLevels::centre(uint32_t chain, const Affine& world_from_object) const {
  return transform_point(DAffine(world_from_object), centres_[chain]);
}

void InstanceLevels::move_instance(uint32_t instance, const Affine& world_from_object) {
  if (member_of_.empty() || member_of_[instance] == baked::kNone) return;
  Member& member = members_[member_of_[instance]];
  member.centre = centre(member.chain, world_from_object);
}

void InstanceLevels::set_level(Member& member, uint8_t level) {
  if (member.level == level) return;
  const auto& geometry = chain_of(member).geometry;
  used_[geometry[member.level]] = --shown_by_[geometry[member.level]] > 0 ? 1 : 0;
  ++shown_by_[geometry[level]], used_[geometry[level]] = 1;
  member.level = level;
  changes_.push_back({member.instance, geometry[level]});
}

void InstanceLevels::choose(DVec3 eye) {
  changes_.clear();
  for (Member& member : members_) {
    const baked::LevelChainRecord& chain = chain_of(member);
    const auto begins = std::span(chain.distance).first(chain.level_count - 1);
    const double distance = glm::length(member.centre - eye);
    const auto wanted = static_cast<uint8_t>(std::ranges::upper_bound(begins, distance) - begins.begin());
    const int step = first_ ? chain.level_count : 1;
    set_level(member, static_cast<uint8_t>(std::clamp<int>(wanted, member.level - step, member.level + step)));
  }
  first_ = false;
}

std::vector<uint8_t> InstanceLevels::levels() const {
  std::vector<uint8_t> levels;
  for (const Member& member : members_) levels.push_back(member.level);
  return levels;
}

bool InstanceLevels::set_levels(std::span<const uint8_t> levels) {
  if (levels.size() != members_.size()) return false;
  for (size_t i = 0; i < levels.size(); ++i)
    if (levels[i] >= chain_of(members_[i]).level_count) return false;
  changes_.clear();
  for (size_t i = 0; i < levels.size(); ++i) set_level(members_[i], levels[i]);
  first_ = false;
  return true;
}

} // namespace packtrace
