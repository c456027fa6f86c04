#pragma once

#include <cstdint>

namespace packtrace {

/// A point of a surface whose edges collapse. Plain, as what works on it is compiled for several processors.
struct alignas(32) CollapsePoint {
  double quadric[10]; ///< xx, xy, xz, yy, yz, zz, bx, by, bz, c
  double unused[2];
  double at[3];
  double held; ///< the sum of what there is of kOnBorder, kLocked
};
inline constexpr double kOnBorder = 1.0; ///< does not leave the border for a point that is not on it
inline constexpr double kLocked = 2.0;   ///< must not move

/// Two points by number.
struct EdgeEnds {
  uint32_t a, b;
};

/// Which point an edge becomes.
struct EdgePlacement {
  double at[3]; ///< whole numbers
  double cost;  ///< not negative
  double along; ///< how far it is along the edge, 0 at a to 1 at b
};

/// What holds for all edges.
struct PlacementRules {
  double lo[3], hi[3]; ///< new points stay in this box
  bool ends_only;      ///< new points are one of the ends
};

/// For each edge, where the sum of its ends' quadrics is least.
using PlacementKernel = void (*)(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges,
                                 uint64_t count, EdgePlacement* out);
void place_edges(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges, uint64_t count,
                 EdgePlacement* out);
namespace avx2 {
void place_edges(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges, uint64_t count,
                 EdgePlacement* out);
}

} // namespace packtrace
