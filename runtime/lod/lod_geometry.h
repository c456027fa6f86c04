#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/layout/lod_format.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

inline constexpr uint32_t kNoRank = ~0u;

/// A ball in object space.
struct LodBall {
  DVec3 center{0.0};
  double radius = 0.0;
};

/// What is known of one level before any view is. Errors in object units.
struct LodLevel {
  uint32_t first_group = 0, group_count = 0; ///< of the records
  uint32_t cluster_count = 0;                ///< of this level alone
  uint64_t triangles = 0;                    ///< of the discrete level: its clusters and those of terminal groups below
  double error = 0.0;           ///< of the discrete level: the largest of all groups below it that are not terminal
  double largest_error = 0.0;   ///< of this level's groups that are not terminal; 0 if there are none
  double smallest_error = 0.0;  ///< of the same; infinite if there are none
  double smallest_radius = 0.0; ///< of the same; 0 if there are none
};

/// Groups that are not terminal, sorted by error (ties: by number). A group's place here is its rank.
struct LodRanks {
  std::vector<double> center_x, center_y, center_z, radius, error;
  std::vector<double> level;
  std::vector<int64_t> saved_triangles; ///< triangles of its clusters less those of the clusters made from it
  std::vector<int32_t> saved_clusters;
  std::vector<uint32_t> group;
};

/// The levels of detail of one geometry, checked, with what the choice of detail needs.
///
/// A cut is a set of groups that pass, such that the groups below one that passes pass too: it takes the clusters whose
/// group does not pass and whose generating group does (or is none). Groups up to some error, which are the first
/// ranks, always are a cut. Memory: about 70 bytes a group and 8 a cluster.
class LodGeometry {
public:
  /// @param groups level by level @param links of each cluster, in any order of levels @param cluster_triangles of each
  /// Balls that do not quite hold those of the groups below are enlarged until they do.
  /// Throws Error(kInput) where numbers are not finite, levels have gaps, links lead nowhere or not one level down, or
  /// an error is below that of a group below.
  LodGeometry(std::span<const baked::LodGroupRecord> groups, std::span<const baked::LodLinkRecord> links,
              std::span<const uint32_t> cluster_triangles);

  std::span<const LodLevel> levels() const { return levels_; }
  uint32_t last_level() const { return static_cast<uint32_t>(levels_.size()) - 1; }
  const LodRanks& ranks() const { return ranks_; }
  uint32_t rank_count() const { return static_cast<uint32_t>(ranks_.error.size()); }
  /// kNoRank: terminal.
  uint32_t rank_of_group(uint32_t group) const { return rank_of_group_[group]; }
  std::span<const baked::LodLinkRecord> links() const { return links_; }
  std::span<const uint32_t> cluster_triangles() const { return cluster_triangles_; }

  /// Holds the balls of all groups.
  const LodBall& ball() const { return ball_; }
  /// No point of any group's ball is further from the origin of object space.
  double reach() const { return reach_; }

  /// How many ranks have an error of at most `error`.
  uint32_t ranks_up_to(double error) const;
  /// Triangles and clusters of the cut where the first `passed` ranks pass.
  uint64_t triangles_of_prefix(uint32_t passed) const { return triangles_of_prefix_[passed]; }
  uint32_t clusters_of_prefix(uint32_t passed) const { return clusters_of_prefix_[passed]; }

private:
  void check_groups(std::span<const baked::LodGroupRecord> groups);
  void check_links(std::span<const baked::LodGroupRecord> groups);
  void enlarge_balls(std::span<const baked::LodGroupRecord> groups);
  void count_levels(std::span<const baked::LodGroupRecord> groups);
  void rank_groups(std::span<const baked::LodGroupRecord> groups);

  std::vector<baked::LodLinkRecord> links_;
  std::vector<uint32_t> cluster_triangles_;
  std::vector<LodBall> balls_; ///< of groups; only while loading
  std::vector<LodLevel> levels_;
  LodRanks ranks_;
  std::vector<uint32_t> rank_of_group_;
  std::vector<uint64_t> triangles_of_prefix_;
  std::vector<uint32_t> clusters_of_prefix_;
  LodBall ball_;
  double reach_ = 0.0;
};

/// A cut that does not depend on the view, for a BLAS that many instances share: the groups up to some error pass.
struct LodStep {
  double error = 0.0;  ///< the largest of the groups that pass; object units
  uint32_t passed = 0; ///< the first ranks pass
  uint64_t triangles = 0;
  uint32_t clusters = 0;
};

/// One step for each level: what is at most as far from level 0 as the discrete level is. It holds the discrete level's
/// triangles or fewer. From fine to coarse, errors ascending; the first has error 0, the last is the coarsest there is.
std::vector<LodStep> level_steps(const LodGeometry& geometry);

/// Steps such that for any allowed error, the coarsest step within it has less than `ratio` times the triangles of the
/// coarsest cut within it. Order and ends as above. @param ratio above 1
std::vector<LodStep> ratio_steps(const LodGeometry& geometry, double ratio);

/// The coarsest step that the first `passed` ranks allow.
uint32_t coarsest_step_of_prefix(std::span<const LodStep> steps, uint32_t passed);

/// The coarsest step of at most that error. @param steps of a geometry @param error at least 0
uint32_t coarsest_step(std::span<const LodStep> steps, double error);

} // namespace packtrace
