#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

enum class CurveType { kFlat, kRibbon, kCylinder };
enum class CurveBasis { kBezier, kBspline };

/// pbrt-v3's curve with its defaults.
struct CurveParameters {
  CurveType type = CurveType::kFlat;
  CurveBasis basis = CurveBasis::kBezier;
  uint32_t degree = 3; ///< 2 or 3
  float width0 = 1.0f; ///< at the start; widths vary linearly over the segments
  float width1 = 1.0f;
  std::span<const Vec3> points;  ///< Bezier: 1 + degree x segments; B-spline: degree + segments
  std::span<const Vec3> normals; ///< ribbons: segments + 1, any length; others: unused
};

/// Ribbons become strips that face their normals, everything else tubes of eight sides without caps: a flat curve
/// turns to each ray, so a round one is what it looks like from everywhere. Chords are within width / 20 of the centre
/// line, the rule of pbrt's own refinement (width: the larger of width0 and width1), or within the rounding of the
/// control points to float where that is coarser; the flats of the eight sides are another 7.6% of the radius inside.
/// No piece turns by more than 37 degrees except at a cusp; at corners between segments each side has its own
/// cross-section, joined. uvs: u from 0 to 1 along the whole curve, where pbrt starts anew with each segment; v across
/// a ribbon or once around a tube. Triangles that a width of zero, or below what floats can tell, collapses are left
/// out. Throws Error(kInput) if counts do not fit, a value is not finite, a width is negative or there is nothing to
/// draw, Error(kLimitExceeded) if the width asks for more than 2^24 vertices. Source for the frames: Wenping Wang, Bert
/// Juettler, Dayue Zheng and Yang Liu, Computation of Rotation Minimizing Frames, 2008.
/// @param memory grows by what this takes, before it is taken; null: nobody counts. Throws MemoryError.
Mesh tessellate_curve(const CurveParameters& curve, MemoryReservation* memory = nullptr);

} // namespace packtrace
