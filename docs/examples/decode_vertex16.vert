#version 450
#extension GL_GOOGLE_include_directive : require
// Vertex shader of an instanced, indexed draw of buffers that decode_vertex16.cpp prepares. No vertex attributes are
// bound: gl_VertexIndex, which includes the draw's vertex offset, is the place in the buffer.
#include "compress/exchange/vertex16/vertex16.glsl"

struct Instance {
  vec4 world_from_object[3]; // rows
  uint geometry;
  uint first_slot;
  uint reserved[2];
};

layout(std430, binding = 0) readonly buffer Vertices { uvec4 vertices[]; };
layout(std430, binding = 1) readonly buffer Instances { Instance instances[]; };
layout(push_constant) uniform Draw {
  mat4 clip_from_world;
  Vertex16Frame frame;
};

layout(location = 0) out vec3 normal_world; // (0, 0, 0): flat, the fragment shader uses cross(dFdx, dFdy)
layout(location = 1) out vec2 uv;

void main() {
  uvec4 v = vertices[gl_VertexIndex];
  Instance instance = instances[gl_InstanceIndex];
  vec4 position = vec4(vertex16_position(v, frame), 1.0);
  vec3 rows[3] = vec3[](instance.world_from_object[0].xyz, instance.world_from_object[1].xyz,
                        instance.world_from_object[2].xyz);
  vec3 world = vec3(dot(instance.world_from_object[0], position), dot(instance.world_from_object[1], position),
                    dot(instance.world_from_object[2], position));
  // Normals move with the cofactors of the linear part, and with the sign of its determinant.
  vec3 n = vertex16_decode_normal(v);
  mat3 linear = transpose(mat3(rows[0], rows[1], rows[2]));
  normal_world = mat3(cross(linear[1], linear[2]), cross(linear[2], linear[0]), cross(linear[0], linear[1])) * n *
                 sign(determinant(linear));
  uv = vertex16_uv(v, frame);
  gl_Position = clip_from_world * vec4(world, 1.0);
}
