#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

enum class CurveType { kFlat, kRibbon, kCylinder };
enum class CurveBasis { kBezier, kBspline };

/// pbrt-v3's curve shape with its defaults.
struct CurveParameters {
  CurveType type = CurveType::kFlat;
  CurveBasis basis = CurveBasis::kBezier;
  uint32_t degree = 3; ///< 2 or 3
  float width0 = 1.0f; ///< width at the start; interpolated linearly over all segments
  float width1 = 1.0f;
  std::span<const Vec3> points;  ///< Bezier: 1 + degree x segments; B-spline: degree + segments
  std::span<const Vec3> normals; ///< ribbons: segments + 1 normals of any length; unused otherwise
};

/// Tessellates a curve. Ribbons become strips that face their normals. Flat and cylindrical curves become tubes of
/// eight sides without caps; a flat curve turns towards every ray, so it looks like a tube from everywhere.
///
/// Chords are within width / 20 of the centre line, which is the rule of pbrt's own refinement (width: the larger of
/// width0 and width1), or within the float rounding of the control points if that is coarser. The eight flat sides lie
/// up to another 7.6% of the radius inside the round tube. No piece turns by more than 37 degrees, except at a cusp. At
/// corners between segments, both sides have their own cross-section, and the two are joined.
///
/// uvs: u from 0 to 1 along the whole curve, whereas pbrt restarts u in each segment; v across a ribbon or once around
/// a tube. Triangles that collapse because the width is zero or below float precision are omitted.
/// @param memory grows by the memory of the tessellation, before it is allocated; null: not counted
/// Throws Error(kInput) if counts do not fit, a value is not finite, a width is negative or nothing is left to draw;
/// Error(kLimitExceeded) if the width requires more than 2^24 vertices; MemoryError.
/// Source for the frames: Wenping Wang, Bert Juettler, Dayue Zheng and Yang Liu, Computation of Rotation Minimizing
/// Frames, 2008.
Mesh tessellate_curve(const CurveParameters& curve, MemoryReservation* memory = nullptr);

} // namespace packtrace
