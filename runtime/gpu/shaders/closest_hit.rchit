#version 460
#extension GL_GOOGLE_include_directive : require
// Says which triangle of which cluster the nearest hit lies on.
#define RAY_PIPELINE
#include "hit.glsl"

void main() {
  uvec3 place = place_of_hit();
  found.t = gl_HitTEXT;
  found.best = Best(weights.x, weights.y, place.x, place.y, place.z);
}
