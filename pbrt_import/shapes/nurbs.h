#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// pbrt-v3's nurbs. Control points are homogeneous, (wx, wy, wz, w), u fastest; from "P" they have w = 1.
struct NurbsParameters {
  uint32_t nu = 0; ///< control points along u
  uint32_t nv = 0;
  uint32_t u_order = 0; ///< degree plus one
  uint32_t v_order = 0;
  std::span<const float> u_knots; ///< nu + u_order of them, not decreasing
  std::span<const float> v_knots;
  std::optional<float> u0, u1, v0, v1; ///< the part to draw; none: all of it
  std::span<const glm::vec4> control_points;
};

/// A grid of triangles whose lines include the knots, refined along u and v until the middles of its edges are within
/// half of, and the middles of its cells within, relative_tolerance x size of the surface, size being half the diagonal
/// of the surface's box. Refinement ends at 128 segments per knot span or 2^24 vertices, with a warning that names the
/// tolerance that was reached. Normals along cross(dp/du, dp/dv); uvs are the surface's own parameters, as in pbrt-v3.
/// Triangles that collapse at poles are left out. Weights may be negative or zero as long as the surface stays finite.
/// @param relative_tolerance within [1e-6, 0.5]
/// Throws Error(kInput) if counts, knots or ranges do not fit together, a value or a point of the surface is not finite
/// or the surface runs through infinity (its weight changes sign), Error(kLimitExceeded) if the knots alone ask for
/// more than 2^24 vertices, and whatever check_cancelled throws. Source: Carl de Boor, A Practical Guide to Splines,
/// 1978, chapter 10.
/// @param memory grows by what this takes, before it is taken; null: nobody counts. Throws MemoryError.
Mesh tessellate_nurbs(const NurbsParameters& nurbs, double relative_tolerance, const ReportFn& report = {},
                      const CheckCancelledFn& check_cancelled = {}, MemoryReservation* memory = nullptr);

} // namespace packtrace
