#version 450
#extension GL_GOOGLE_include_directive : require
// Decodes vertices to 12 floats each: position, normal, uv, tangent with its sign.
#include "compress/exchange/vertex16/vertex16.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Vertices { uvec4 vertices[]; };
layout(std430, binding = 1) readonly buffer Frames { Vertex16Frame frame; };
layout(std430, binding = 2) writeonly buffer Decoded { float decoded[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= vertices.length()) return;
  uvec4 v = vertices[i];
  vec3 position = vertex16_position(v, frame);
  vec3 normal = vertex16_decode_normal(v);
  vec2 uv = vertex16_uv(v, frame);
  vec4 tangent = vertex16_tangent(v, normal);
  uint at = 12u * i;
  decoded[at] = position.x, decoded[at + 1u] = position.y, decoded[at + 2u] = position.z;
  decoded[at + 3u] = normal.x, decoded[at + 4u] = normal.y, decoded[at + 5u] = normal.z;
  decoded[at + 6u] = uv.x, decoded[at + 7u] = uv.y;
  decoded[at + 8u] = tangent.x, decoded[at + 9u] = tangent.y, decoded[at + 10u] = tangent.z, decoded[at + 11u] = tangent.w;
}
