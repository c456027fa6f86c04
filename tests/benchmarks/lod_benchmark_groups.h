#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/lod/cluster_lod.h"

namespace packtrace {

/// Appends the triangles of a cluster, with the numbers of their positions.
void append_points(const ClusterLod& lod, const LodCluster& cluster, std::vector<Triangle>& out);

/// Measures the error of each group, from below: each distance found is one that the group must state.
class GroupSurfaces {
public:
  /// @param points of lod.positions; both must outlive this object
  GroupSurfaces(const ClusterLod& lod, const std::vector<DVec3>& points);
  ~GroupSurfaces();

  /// Returns the ratio of stated to measured error of each group that made clusters of this level and whose measured
  /// error is not only rounding. Call for the levels in order. Measured are
  /// - the distance of its clusters from the level 0 clusters that it may represent
  /// - the distance of points of these from its clusters, where no other group can represent the point. A
  ///   group can only represent what a group below it can, and what is as near as it states.
  std::vector<double> ratios(uint32_t level);
  /// Largest amount by which a group's measured error exceeds its stated error, or by which a point of level 0 is
  /// further from each group that may represent it than that group states; lattice steps.
  double excess() const { return excess_; }

  /// Like ratios(), against the largest measured error of a group and all groups below it; the stated error must not be
  /// below that. Call for the levels in order, after ratios().
  std::vector<double> ratios_to_largest(uint32_t level);

private:
  struct Sample;
  struct Holder;
  void add_samples(uint32_t cluster);
  std::vector<Triangle> triangles_of(const std::vector<uint32_t>& clusters) const;
  std::vector<Holder> find_holders(uint32_t level) const;
  void measure_samples(uint32_t level);

  template <typename Visit>
  void for_each_group(uint32_t level, const Visit& visit) const {
    for (uint32_t i = 0; i < lod_.groups.size(); ++i)
      if (lod_.groups[i].level + 1 == level && !lod_.groups[i].terminal) visit(i);
  }

  const ClusterLod& lod_;
  const std::vector<DVec3>& points_;
  std::vector<std::vector<uint32_t>> made_, base_; ///< cluster numbers, per group
  std::vector<std::vector<uint32_t>> below_;       ///< group numbers, per group
  std::vector<std::vector<uint32_t>> above_;       ///< group numbers, per group; of a terminal one: itself
  std::vector<Sample> samples_;                    ///< points of level 0
  std::vector<double> measured_;                   ///< per group
  double excess_ = 0.0;
};

} // namespace packtrace
