#pragma once

#include <string>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// What the geometry of a stability case implies for occlusion rays.
enum class StabilityShape {
  kAny,
  kConvex, ///< seen from outside: no occlusion ray may hit anything
  kClosed  ///< seen from inside: every occlusion ray must hit something
};

/// A scene at an extreme of size, place or shape, with one camera.
struct StabilityCase {
  std::string name;
  Scene scene;
  double ao_radius = 1.0; ///< world units
  StabilityShape shape = StabilityShape::kAny;
};

/// Scenes of a few hundred triangles: scaled by 1e-40 (denormal floats) to 1e12, moved by up to 1e7 extents, flat and
/// needle-shaped, of one triangle, with a mesh without extent, scaled 1 : 1e6 on one axis, with a thousand coinciding
/// surfaces, with vertex normals around the equator of the Z-sign encoding, with |uv| of 1e30, seen from inside, and
/// from 1e9 units away. The same on every machine.
std::vector<StabilityCase> stability_cases();

} // namespace packtrace
