#pragma once

#include <span>
#include <string_view>

#include "assets/generator/model.h"
#include "assets/generator/placement.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

enum class OpeningKind { kWindow, kShutteredWindow, kBalconyDoor, kDoor, kArch, kRecess };

/// A rectangular hole in a wall, in metres in the wall's plane. Openings of one wall must not overlap.
struct Opening {
  OpeningKind kind = OpeningKind::kWindow;
  double x0 = 0.0, y0 = 0.0, x1 = 1.0, y1 = 1.0;
  bool lit = false; ///< warm light behind the panes
};

/// Adds a wall over the frame's rectangle [0,width] x [0,height] at z = 0, facing -z. Cuts out the openings and
/// furnishes them with reveals, panes, frames and bars, sills, shutters, doors with steps, and arches.
/// Materials: "wall", "trim", "glass", "lamp", "shutter", "door", "stone", "iron".
void add_facade(Model& model, const DAffine& frame, double width, double height, std::span<const Opening> openings);

/// Adds half-round tiles on the frame's rectangle [0,width] x [0,length]: x along the eave, y up the slope, -z out of
/// the roof. Materials: "tile_a", "tile_b", "tile_c".
/// @param inset distance by which the rectangle narrows on each side from eave to top (hipped roofs)
void add_tiles(Model& model, const DAffine& frame, double width, double length, double inset, Random& random);

/// Adds a railing of posts and two rails along the frame's +x axis at y = 0.
void add_railing(Model& model, std::string_view material, const DAffine& frame, double length, double height,
                 double spacing);

} // namespace packtrace::scenegen
