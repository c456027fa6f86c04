#include "compress/format/file/lod_validation.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace packtrace {
namespace {

bool is_level(const baked::GeometryRecord& g) { return (g.flags & baked::kLodLevel) != 0; }

/// Whether a level's clusters share the base's lattice, encoding of texture coordinates, and slots.
bool alike(const baked::GeometryRecord& level, const baked::GeometryRecord& base) {
  return level.flags == (base.flags | baked::kLodLevel) && level.origin == base.origin &&
         level.step_mantissa == base.step_mantissa && level.step_exponent == base.step_exponent &&
         level.anchor_shift == base.anchor_shift && level.uv_encoding == base.uv_encoding &&
         level.uv_exponent == base.uv_exponent && level.slot_count == base.slot_count &&
         level.position_error_bound == base.position_error_bound;
}

/// Checks the groups and links of one geometry.
class GroupChecker {
public:
  GroupChecker(const BakedSections& sections, std::span<const baked::LodLevelRecord> levels)
      : s_(sections), levels_(levels) {
    uint64_t count = 0;
    for (const baked::LodLevelRecord& level : levels) count += level.group_count;
    groups_ = s_.lod_groups.subspan(static_cast<size_t>(levels.front().first_group), static_cast<size_t>(count));
    has_members_.assign(groups_.size(), 0), has_coarser_clusters_.assign(groups_.size(), 0);
  }

  std::optional<LodFault> run() {
    uint64_t first = 0, below = 0; // first group of this level and of the level below
    for (const baked::LodLevelRecord& level : levels_) {
      if (auto fault = check_groups(level, first)) return fault;
      if (auto fault = check_links(level, first, below)) return fault;
      below = first, first += level.group_count;
    }
    for (size_t i = 0; i < groups_.size(); ++i) {
      if (has_members_[i] == 0) return of_group(i, "no clusters");
      if (std::isfinite(groups_[i].error) != (has_coarser_clusters_[i] != 0)) return of_group(i, "coarser clusters");
    }
    return std::nullopt;
  }

private:
  LodFault of_group(uint64_t i, const char* what) const { return {"lod group", levels_.front().first_group + i, what}; }

  std::optional<LodFault> check_groups(const baked::LodLevelRecord& level, uint64_t first) const {
    for (uint64_t i = first; i < first + level.group_count; ++i) {
      const baked::LodGroupRecord& g = groups_[static_cast<size_t>(i)];
      if (g.level != level.level) return of_group(i, "level");
      if (!(g.error >= 0.0f)) return of_group(i, "error");
      bool finite = g.radius >= 0.0f && std::isfinite(g.radius);
      for (const float c : g.center) finite &= std::isfinite(c);
      if (!finite) return of_group(i, "sphere");
    }
    return std::nullopt;
  }

  /// Also checks the triangle count and the error in the level record.
  std::optional<LodFault> check_links(const baked::LodLevelRecord& level, uint64_t first, uint64_t below) {
    const baked::GeometryRecord& g = s_.geometries[level.geometry];
    uint64_t own = 0, terminal = 0;
    float largest = largest_error_;
    for (uint32_t c = 0; c < g.cluster_count; ++c) {
      const uint64_t number = level.first_link + c;
      const baked::LodLinkRecord& link = s_.lod_links[static_cast<size_t>(number)];
      const auto fault = [&](const char* what) { return LodFault{"lod link", number, what}; };
      if (link.group >= level.group_count) return fault("group");
      const baked::LodGroupRecord& group = groups_[static_cast<size_t>(first + link.group)];
      has_members_[static_cast<size_t>(first + link.group)] = 1;
      if (level.level == 0) {
        if (link.generating_group != 0) return fault("generating group");
      } else {
        if (link.generating_group >= first - below) return fault("generating group");
        const auto made_from = static_cast<size_t>(below + link.generating_group);
        const baked::LodGroupRecord& generating = groups_[made_from];
        if (!std::isfinite(generating.error)) return fault("generating group is terminal");
        if (group.error < generating.error) return fault("error below that of the generating group");
        if (!baked::holds_sphere(group, generating)) return fault("sphere does not hold that of the generating group");
        has_coarser_clusters_[made_from] = 1;
      }
      const uint32_t triangles = s_.clusters[static_cast<size_t>(g.first_cluster + c)].triangle_count;
      own += triangles;
      if (std::isfinite(group.error))
        largest = std::max(largest, group.error);
      else
        terminal += triangles;
    }
    const auto number = static_cast<uint64_t>(&level - s_.lod_levels.data());
    if (level.triangles != terminal_below_ + own) return LodFault{"lod level", number, "triangles"};
    if (level.error != largest_error_) return LodFault{"lod level", number, "error"};
    terminal_below_ += terminal;
    largest_error_ = largest;
    return std::nullopt;
  }

  const BakedSections& s_;
  std::span<const baked::LodLevelRecord> levels_;
  std::span<const baked::LodGroupRecord> groups_;
  std::vector<uint8_t> has_members_, has_coarser_clusters_; // by group
  uint64_t terminal_below_ = 0;
  float largest_error_ = 0.0f; // largest finite group error of the levels below
};

} // namespace

std::optional<LodFault> find_lod_level_fault(const BakedSections& s) {
  const auto first_level = std::find_if(s.geometries.begin(), s.geometries.end(), is_level);
  for (auto g = first_level; g != s.geometries.end(); ++g)
    if (!is_level(*g))
      return LodFault{"geometry", static_cast<uint64_t>(g - s.geometries.begin()), "behind levels of detail"};
  const auto bases = static_cast<uint64_t>(first_level - s.geometries.begin());
  uint64_t next_geometry = bases, next_group = 0, next_link = 0;
  for (size_t i = 0; i < s.lod_levels.size(); ++i) {
    const baked::LodLevelRecord& l = s.lod_levels[i];
    const auto fault = [&](const char* what) { return LodFault{"lod level", i, what}; };
    if (l.base >= bases) return fault("geometry");
    const bool first = i == 0 || l.base != s.lod_levels[i - 1].base;
    if (first && i > 0 && (l.base < s.lod_levels[i - 1].base || s.lod_levels[i - 1].level == 0)) return fault("order");
    const uint64_t level = first ? 0 : uint64_t{s.lod_levels[i - 1].level} + 1;
    if (l.level != level || level >= baked::kMaxLodLevels) return fault("level");
    if (first ? l.geometry != l.base : l.geometry != next_geometry || next_geometry >= s.geometries.size())
      return fault("geometry");
    const baked::GeometryRecord& g = s.geometries[l.geometry];
    if (!first && !alike(g, s.geometries[l.base])) return fault("geometry is not like its base");
    if (l.group_count == 0 || l.group_count > g.cluster_count) return fault("number of groups");
    if (l.first_group != next_group || l.group_count > s.lod_groups.size() - next_group) return fault("groups");
    if (l.first_link != next_link || g.cluster_count > s.lod_links.size() - next_link) return fault("links");
    next_geometry += !first;
    next_group += l.group_count, next_link += g.cluster_count;
  }
  const auto last = s.lod_levels.empty() ? 0 : s.lod_levels.size() - 1;
  if (!s.lod_levels.empty() && s.lod_levels.back().level == 0) return LodFault{"lod level", last, "is the only one"};
  if (next_geometry != s.geometries.size()) return LodFault{"geometry", next_geometry, "a level of no geometry"};
  if (next_group != s.lod_groups.size()) return LodFault{"lod group", next_group, "of no level"};
  if (next_link != s.lod_links.size()) return LodFault{"lod link", next_link, "of no level"};
  return std::nullopt;
}

std::optional<LodFault> find_lod_group_fault(const BakedSections& s) {
  for (size_t begin = 0, end; begin < s.lod_levels.size(); begin = end) {
    for (end = begin + 1; end < s.lod_levels.size() && s.lod_levels[end].base == s.lod_levels[begin].base;) ++end;
    if (auto fault = GroupChecker(s, s.lod_levels.subspan(begin, end - begin)).run()) return fault;
  }
  return std::nullopt;
}

} // namespace packtrace
