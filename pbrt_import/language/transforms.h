#pragma once

#include <optional>
#include <span>
#include <string>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// pbrt's transform directives as maps to multiply onto the current one from the right.
DAffine translation(DVec3 offset);
DAffine scaling(DVec3 factors);

/// @return none if axis has no direction
std::optional<DAffine> rotation(double degrees, DVec3 axis);

/// From 16 numbers column after column. A bottom row (0,0,0,w) is divided out. @return none if the map is not affine
std::optional<DAffine> affine_from_columns(std::span<const double, 16> columns);

bool is_finite(const DAffine& map);

/// True where the map has an inverse that doubles can hold.
bool is_invertible(const DAffine& map);

/// Takes a map apart by polar decomposition. A mirroring one gets a proper rotation and a negative definite scale.
/// @return none if the map has no inverse
/// Source: Shoemake, Duff, Matrix Animation and Polar Decomposition (1992); Higham, Computing the Polar Decomposition
/// with Applications (1986), equation 3.5.
std::optional<TransformKey> decompose(const DAffine& map);

/// A time for messages: "0.5".
std::string to_text(double time);

/// When an animated transform has reached its keys.
struct TransformTimes {
  double start = 0.0;
  double end = 1.0;
};

/// @return none if one of the maps has no inverse
std::optional<AnimatedTransform> animate(const DAffine& start, const DAffine& end, TransformTimes times);

} // namespace packtrace
