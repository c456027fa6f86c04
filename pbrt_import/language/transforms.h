#pragma once

#include <optional>
#include <span>
#include <string>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// pbrt's transform directives as maps, to be multiplied onto the current transform from the right.
DAffine translation(DVec3 offset);
DAffine scaling(DVec3 factors);

/// @return nullopt if the axis is zero
std::optional<DAffine> rotation(double degrees, DVec3 axis);

/// Affine map from 16 numbers in column-major order. A bottom row (0, 0, 0, w) is divided out.
/// @return nullopt if the map is not affine
std::optional<DAffine> affine_from_columns(std::span<const double, 16> columns);

bool is_finite(const DAffine& map);

/// True if the map has an inverse that doubles can represent.
bool is_invertible(const DAffine& map);

/// Decomposes a map by polar decomposition. A mirroring map gets a proper rotation and a negative definite scale.
/// @return nullopt if the map has no inverse
/// Source: Shoemake, Duff, Matrix Animation and Polar Decomposition (1992); Higham, Computing the Polar Decomposition
/// with Applications (1986), equation 3.5.
std::optional<TransformKey> decompose(const DAffine& map);

/// Shortest text of a time for messages, such as "0.5".
std::string to_text(double time);

/// Times of the start and the end key of an animated transform.
struct TransformTimes {
  double start = 0.0;
  double end = 1.0;
};

/// Keys of an animation between two maps. The sign of the end rotation is chosen for the shorter way.
/// @return nullopt if one of the maps has no inverse
std::optional<AnimatedTransform> animate(const DAffine& start, const DAffine& end, TransformTimes times);

} // namespace packtrace
