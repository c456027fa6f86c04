#version 460
#extension GL_GOOGLE_include_directive : require
// Makes the points from which occlusion rays start, of the planes that surfaces.comp wrote: lift_origins(), the same
// bits. Points lie in blocks of 8 x 4 pixels.
#include "records.glsl"

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
  uint block = i >> 5, in_block = i & 31u, per_row = (push.width + 7u) / 8u;
  uvec2 p = uvec2((block % per_row) * 8u + (in_block & 7u), (block / per_row) * 4u + (in_block >> 3));
  uint n = push.width * push.height, pixel = p.y * push.width + p.x;
  if (p.x >= push.width || p.y >= push.height || planes[kInstancePlane * n + pixel] == kNoInstance ||
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
