#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/layout/lod_format.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

inline constexpr uint32_t kNoRank = ~0u;

/// A sphere in object space.
struct LodBall {
  DVec3 center{0.0};
  double radius = 0.0;
};

/// View-independent data of one level. Errors are in object units.
struct LodLevel {
  uint32_t first_group = 0, group_count = 0; ///< index range of the records
  uint32_t cluster_count = 0;                ///< in this level only
  uint64_t triangles = 0;                    ///< of the discrete level: its clusters and those of terminal groups below
  double error = 0.0;                        ///< of the discrete level: the largest of all non-terminal groups below it
  double largest_error = 0.0;                ///< of this level's non-terminal groups; 0 if there are none
  double smallest_error = 0.0;               ///< same groups; infinite if there are none
  double smallest_radius = 0.0;              ///< same groups; 0 if there are none
};

/// Non-terminal groups, sorted by error (ties: by number). A group's index here is its rank.
struct LodRanks {
  std::vector<double> center_x, center_y, center_z, radius, error;
  std::vector<double> level;
  std::vector<int64_t> saved_triangles; ///< triangles of its clusters minus those of the clusters made from it
  std::vector<int32_t> saved_clusters;
  std::vector<uint32_t> group;
};

/// The LOD levels of one geometry, validated, with data for choosing detail.
///
/// A group passes for a view if its coarser version is accurate enough. A cut is given by its passing groups, which
/// include all groups below each of them. Its clusters are those whose group does not pass and whose generating group
/// passes or does not exist. All groups up to some error, which are the first ranks, always form a cut. Memory: about
/// 70 bytes per group and 8 per cluster.
class LodGeometry {
public:
  /// Validates the records. Enlarges spheres that do not fully contain those of the groups below.
  /// @param groups level by level
  /// @param links per cluster, in any order of levels
  /// @param cluster_triangles per cluster
  /// Throws Error(kInput) if numbers are not finite, levels have gaps, links are invalid or do not go down one level,
  /// or a group's error is smaller than that of a group below.
  LodGeometry(std::span<const baked::LodGroupRecord> groups, std::span<const LodLink> links,
              std::span<const uint32_t> cluster_triangles);

  std::span<const LodLevel> levels() const { return levels_; }
  uint32_t last_level() const { return static_cast<uint32_t>(levels_.size()) - 1; }
  const LodRanks& ranks() const { return ranks_; }
  uint32_t rank_count() const { return static_cast<uint32_t>(ranks_.error.size()); }
  /// kNoRank for terminal groups.
  uint32_t rank_of_group(uint32_t group) const { return rank_of_group_[group]; }
  std::span<const LodLink> links() const { return links_; }
  std::span<const uint32_t> cluster_triangles() const { return cluster_triangles_; }

  /// Contains the spheres of all groups.
  const LodBall& ball() const { return ball_; }
  /// Maximum distance of any group's sphere from the origin of object space.
  double reach() const { return reach_; }

  /// Number of ranks with an error of at most `error`.
  uint32_t ranks_up_to(double error) const;
  /// Triangles and clusters of the cut in which the first `passed` ranks pass.
  uint64_t triangles_of_prefix(uint32_t passed) const { return triangles_of_prefix_[passed]; }
  uint32_t clusters_of_prefix(uint32_t passed) const { return clusters_of_prefix_[passed]; }

private:
  void check_groups(std::span<const baked::LodGroupRecord> groups);
  void check_links(std::span<const baked::LodGroupRecord> groups);
  void enlarge_balls(std::span<const baked::LodGroupRecord> groups);
  void count_levels(std::span<const baked::LodGroupRecord> groups);
  void rank_groups(std::span<const baked::LodGroupRecord> groups);

  std::vector<LodLink> links_;
  std::vector<uint32_t> cluster_triangles_;
  std::vector<LodBall> balls_; ///< per group; used only while loading
  std::vector<LodLevel> levels_;
  LodRanks ranks_;
  std::vector<uint32_t> rank_of_group_;
  std::vector<uint64_t> triangles_of_prefix_;
  std::vector<uint32_t> clusters_of_prefix_;
  LodBall ball_;
  double reach_ = 0.0;
};

/// A view-independent cut, for a BLAS that many instances share: all groups up to some error pass.
struct LodStep {
  double error = 0.0;  ///< largest error of the passing groups; object units
  uint32_t passed = 0; ///< number of leading ranks that pass
  uint64_t triangles = 0;
  uint32_t clusters = 0;
};

/// Returns steps such that for any allowed error, the coarsest step within it has less than `ratio` times the triangles
/// of the coarsest cut within it. Sorted from fine to coarse; the first step has error 0, the last is the coarsest cut.
/// @param ratio above 1
std::vector<LodStep> ratio_steps(const LodGeometry& geometry, double ratio);

/// The index of the coarsest step for which the first `passed` ranks are enough.
uint32_t coarsest_step_of_prefix(std::span<const LodStep> steps, uint32_t passed);

/// The index of the coarsest step with an error of at most `error`.
/// @param steps of a geometry
/// @param error at least 0
uint32_t coarsest_step(std::span<const LodStep> steps, double error);

} // namespace packtrace
