#pragma once

#include <cstdint>

namespace packtrace {

/// The overlap of the overlaid triangle with one surface triangle.
struct OverlayPiece {
  static constexpr uint32_t kBeyondSide = 8; ///< in inner_sides: not an overlap, but what lies beyond an open side
  uint32_t triangle;
  uint32_t inner_sides; ///< bit i: the side starting at corner i crosses the overlaid triangle's interior
  double distance;      ///< maximum distance of points of either triangle there from the other
};

/// A point relative to a triangle: barycentric coordinates in its plane, and the height above it along the direction.
struct alignas(32) OverlayPoint {
  double l0, l1, l2, height;
};

/// Input of overlay kernels. Plain data, as it is compiled for several instruction sets.
struct OverlayTask {
  const double* points;    ///< x, y, z per surface point
  const uint32_t* corners; ///< three per surface triangle
  OverlayPoint* projected; ///< per point; valid where its stamp equals `stamp`
  uint32_t* outside;       ///< as above; bit i: coordinate i is <= 0
  uint32_t* stamps;
  uint32_t stamp;
  double enough; ///< stops once the triangle is covered this many times
  double origin[3];
  OverlayPoint from_x, from_y, from_z; ///< derivatives of the coordinates; the origin's are 1, 0, 0, 0
};

/// How the pieces of a task cover the triangle.
struct OverlayCover {
  double count;     ///< on average
  uint32_t largest; ///< index of the piece with the largest area
};

/// Overlays the triangle on the candidates until `enough` is reached; ignores back-facing candidates. Writes at most
/// one piece per candidate and returns the number of pieces.
using OverlayKernel = uint32_t (*)(const OverlayTask& task, const uint32_t* candidates, uint32_t count,
                                   OverlayPiece* pieces, OverlayCover* cover);

uint32_t overlay_kernel(const OverlayTask& task, const uint32_t* candidates, uint32_t count, OverlayPiece* pieces,
                        OverlayCover* cover);
namespace avx2 {
uint32_t overlay_kernel(const OverlayTask& task, const uint32_t* candidates, uint32_t count, OverlayPiece* pieces,
                        OverlayCover* cover);
}

} // namespace packtrace
