#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// pbrt-v3's nurbs shape. Control points are homogeneous, (wx, wy, wz, w), with u varying fastest; w = 1 for "P".
struct NurbsParameters {
  uint32_t nu = 0; ///< control points along u
  uint32_t nv = 0;
  uint32_t u_order = 0; ///< degree plus one
  uint32_t v_order = 0;
  std::span<const float> u_knots; ///< nu + u_order knots, non-decreasing
  std::span<const float> v_knots;
  std::optional<float> u0, u1, v0, v1; ///< the part to draw; unset: the whole domain
  std::span<const glm::vec4> control_points;
};

/// Tessellates a surface as a grid of triangles whose lines include the knots. It is refined along u and v until the
/// midpoints of edges are within half of relative_tolerance x size, and the midpoints of cells within
/// relative_tolerance x size, where size is half the diagonal of the surface's bounds. Refinement ends at 128 segments
/// per knot span or 2^24 vertices, with a warning that states the tolerance that was reached. Normals point along
/// cross(dp/du, dp/dv); uvs are the parameters of the surface, as in pbrt-v3. Triangles that collapse at poles are
/// omitted. Weights may be negative or zero as long as the surface stays finite.
/// @param relative_tolerance within [1e-6, 0.5]
/// @param memory grows by the memory of the mesh, before it is allocated; null: not counted
/// Throws Error(kInput) if counts, knots or ranges do not fit together, if a value or a point of the surface is not
/// finite or if the surface passes through infinity (its weight changes sign); Error(kLimitExceeded) if the knots alone
/// require more than 2^24 vertices; MemoryError; and what check_cancelled throws.
/// Source: Carl de Boor, A Practical Guide to Splines, 1978, chapter 10.
Mesh tessellate_nurbs(const NurbsParameters& nurbs, double relative_tolerance, const ReportFn& report = {},
                      const CheckCancelledFn& check_cancelled = {}, MemoryReservation* memory = nullptr);

} // namespace packtrace
