#pragma once

#include <cstdint>
#include <span>

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
/// turns to each ray, so a round one is what it looks like from everywhere. The centre line is followed to within
/// width / 20, as pbrt does, with at most 1024 pieces per segment. uvs: u from 0 to 1 along the whole curve, v across a
/// ribbon or once around a tube.
/// Throws Error(kInput) if counts do not fit, a value is not finite, a width is negative or there is nothing to draw.
/// Source for the frames: Wenping Wang, Bert Juettler, Dayue Zheng and Yang Liu, Computation of Rotation Minimizing
/// Frames, 2008.
Mesh tessellate_curve(const CurveParameters& curve);

} // namespace packtrace
