#pragma once

#include <cstdint>

namespace packtrace {

/// A point of a surface under edge collapse. Plain data, as it is compiled for several instruction sets.
struct alignas(32) CollapsePoint {
  double quadric[10]; ///< xx, xy, xz, yy, yz, zz, bx, by, bz, c
  double area;        ///< sum of the parallelogram areas of the triangles around it, before any collapse
  double unused;
  double at[3];
  double held; ///< sum of the flags that apply: kOnBorder, kLocked
};
inline constexpr double kOnBorder = 1.0; ///< must not move to a point that is not on a border
inline constexpr double kLocked = 2.0;   ///< must not move

/// Point numbers of an edge's ends.
struct EdgeEnds {
  uint32_t a, b;
};

/// Where an edge collapses to.
struct EdgePlacement {
  double at[3]; ///< integers
  double cost;  ///< not negative
  double along; ///< parameter along the edge, 0 at a to 1 at b
};

/// Constraints for all edges.
struct PlacementRules {
  double lo[3], hi[3]; ///< bounds of new points
  bool ends_only;      ///< new points are placed at one of the ends only
};

/// Places each edge where the sum of its ends' quadrics is minimal.
using PlacementKernel = void (*)(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges,
                                 uint64_t count, EdgePlacement* out);
void place_edges(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges, uint64_t count,
                 EdgePlacement* out);
namespace avx2 {
void place_edges(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges, uint64_t count,
                 EdgePlacement* out);
}

} // namespace packtrace
