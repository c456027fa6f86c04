#pragma once

#include <string_view>

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

/// Floating boats: water at y = 0, bow towards +z, keel below. Materials: "hull", "hull_low", "wood", "white", "glass",
/// "rope", "sail", "iron", "red".
Model make_rowing_boat(Random& random);  ///< 4.2 m
Model make_fishing_boat(Random& random); ///< 9 m, wheelhouse and mast
Model make_sailing_boat(Random& random); ///< 10 m, sails set

} // namespace packtrace::scenegen
