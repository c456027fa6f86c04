#pragma once

#include <optional>
#include <span>

#include "pbrt_import/scene/math.h"

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

} // namespace packtrace
