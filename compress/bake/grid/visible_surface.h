#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/grid/placed_parts.h"
#include "pbrt_import/scene/camera_rays.h"

namespace packtrace {

/// The nearest surface that a camera sees through the centre of a pixel.
struct VisiblePoint {
  uint32_t geometry = baked::kNone; ///< kNone if the pixel shows nothing
  uint32_t triangle = 0;            ///< number among the placed triangles
  double depth = 0.0;               ///< PrimaryCamera::view_z()
  DVec3 position{0.0};              ///< world space
  DVec3 normal{0.0};                ///< geometric unit normal towards the camera, world space
};

/// What a camera sees per pixel, in rows from the top.
struct VisiblePoints {
  std::vector<VisiblePoint> source;  ///< with source positions, as floats
  std::vector<VisiblePoint> rounded; ///< with positions on the lattices
};

/// Finds the nearest surface per pixel by scan conversion into a depth buffer.
/// Camera-invisible materials are left out; alpha masks count as opaque. Takes linear time, because at most about 2^28
/// pixels are tested. Triangles beyond this limit, which only thousands of overlapping large triangles exceed, are left
/// out. Depends on its arguments only, not on the thread count. Source: Olano, Greer, "Triangle scan conversion using
/// 2D homogeneous coordinates" (1997).
/// @param camera perspective or orthographic
VisiblePoints find_visible_points(const PrimaryCamera& camera, const PlacedParts& parts);

} // namespace packtrace
