#version 460
#extension GL_GOOGLE_include_directive : require
// Makes the points from which occlusion rays start from the planes that surfaces.comp wrote, with the bits of
// lift_origins(). Threads without a surface write kNoPoint.
#include "records.glsl"
#include "blocks.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Planes { uint planes[]; };
layout(std430, binding = 1) writeonly restrict buffer Points { PointRecord points[]; };
layout(push_constant) uniform Push { PicturePointsRecord push; };

float[3] plane(uint number, uint pixel) {
  uint at = number * push.width * push.height + 3u * pixel;
  return float[3](uintBitsToFloat(planes[at]), uintBitsToFloat(planes[at + 1u]), uintBitsToFloat(planes[at + 2u]));
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  i += push.first;
  uvec2 p;
  bool inside = pixel_of_thread(i, push.width, push.height, p);
  uint n = push.width * push.height, pixel = p.y * push.width + p.x;
  if (!inside || planes[kInstancePlane * n + pixel] == kNoInstance ||
      (push.colour < 2u && ((p.x + p.y) & 1u) != push.colour)) {
    float[3] zero = float[3](0.0, 0.0, 0.0);
    points[i] = PointRecord(zero, zero, zero, kNoPoint, p.x, p.y);
    return;
  }
  float[3] origin = plane(kPositionPlane, pixel), up = plane(kGeometricPlane, pixel), normal = plane(kNormalPlane, pixel);
  precise float offset = uintBitsToFloat(planes[kOffsetPlane * n + pixel]) * push.offset_scale;
  for (uint axis = 0u; axis < 3u; ++axis) {
    precise double along = double(up[axis]) * double(offset);
    precise double lifted = (double(origin[axis]) + along) - push.centre[axis];
    precise double in_unit_space = lifted * push.scale;
    origin[axis] = float(in_unit_space);
  }
  points[i] = PointRecord(origin, up, normal, pixel, p.x, p.y);
}
