#pragma once

#include <cstdint>

namespace packtrace {

/// Where the triangle that is laid over a surface meets one triangle of it.
struct OverlayPiece {
  uint32_t triangle;
  uint32_t inner_sides; ///< bit i: its side from corner i goes through the inside of the triangle laid over it
  double distance;      ///< every point of the one there is within this of the other, and the other way round
};

/// A point seen from a triangle: barycentric coordinates in its plane, and how far above it along the direction.
struct alignas(32) OverlayPoint {
  double l0, l1, l2, height;
};

/// What overlay kernels work on. Plain, as they are compiled for several processors.
struct OverlayTask {
  const double* points;    ///< x, y, z of the surface's points
  const uint32_t* corners; ///< three per triangle of the surface
  OverlayPoint* projected; ///< per point, where its stamp is `stamp`
  uint32_t* outside;       ///< then: bit i: coordinate i is not above 0
  uint32_t* stamps;
  uint32_t stamp;
  double enough; ///< no more is looked for once the triangle is covered that often
  double origin[3];
  OverlayPoint from_x, from_y, from_z; ///< coordinates' slopes; those of the origin are 1, 0, 0, 0
};

/// Lays the triangle over the candidates until they are enough; those that face away are as if they were not there.
/// Writes as many pieces as it returns, one per candidate at most, and how often they cover the triangle, on average.
using OverlayKernel = uint32_t (*)(const OverlayTask& task, const uint32_t* candidates, uint32_t count,
                                   OverlayPiece* pieces, double* covered);

uint32_t overlay_kernel(const OverlayTask& task, const uint32_t* candidates, uint32_t count, OverlayPiece* pieces,
                        double* covered);
namespace avx2 {
uint32_t overlay_kernel(const OverlayTask& task, const uint32_t* candidates, uint32_t count, OverlayPiece* pieces,
                        double* covered);
}

} // namespace packtrace
