#version 460
#extension GL_GOOGLE_include_directive : require
// Sums the visibility and the distance of occlusion rays up, sample by sample: VisibilityCurve and add_samples(), the
// same bits. Rays are made here; a thread has a point.
#define CLOSEST
#include "trace.glsl"
#include "points.glsl"

layout(std430, binding = 10) restrict buffer Sums { double sums[]; }; // visibility, distance

// e^x for x in [-80, 0]
float exp_of_negative(float x) {
  precise float y = x * 1.44269504;
  int whole = int(y); // rounds up
  precise float f = (y - float(whole)) * 0.693147181;
  precise float power =
      1.0 +
      f * (1.0 + f * (1.0 / 2.0 +
                      f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0 + f * (1.0 / 5040.0)))))));
  precise float result = power * intBitsToFloat((whole + 127) << 23);
  return result;
}

// x: hit distance in radii
float visibility(float x) {
  precise float square = x * x, limit = push.end * push.end;
  float x2 = limit < square ? limit : square, occlusion;
  if (push.parabola > 0.0) {
    precise float share = x2 * push.parabola, left = 1.0 - share;
    occlusion = left;
  } else {
    precise float exponent = -push.lambda * x2;
    precise float above = exp_of_negative(exponent) - push.floor_, scaled = above * push.scale;
    occlusion = scaled;
  }
  float within = occlusion < 0.0 ? 0.0 : occlusion;
  within = 1.0 < within ? 1.0 : within;
  precise float dark = push.darkening * within, k = 1.0 - dark;
  return k;
}

void main() {
  uint i = THREAD;
  if (i >= push.point_count) return;
  i += push.first_point;
  Point p = read_point(i);
  if (p.pixel == kNoPoint) return;
  precise double seen = sums[2u * i], distance = sums[2u * i + 1u];
  for (uint s = 0u; s < push.sample_count; ++s) {
    UnitRay u = unit_ray(p.origin, sample_direction(p, push.first_sample + s), 0.0, push.tfar);
    Best best = Best(0.0, 0.0, 0xffffffffu, 0u, 0u);
    if (push.tfar > 0.0) trace(u, best, kOcclusionClass);
    float k = 1.0, way = 1.0;
    if (best.placement != 0xffffffffu) {
      precise float x = u.tmax * push.inverse_radius;
      k = visibility(x);
      way = 1.0 < x ? 1.0 : x;
    }
    seen = seen + double(k);
    distance = distance + double(way);
  }
  sums[2u * i] = seen;
  sums[2u * i + 1u] = distance;
}
