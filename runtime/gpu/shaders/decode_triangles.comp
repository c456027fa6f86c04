#version 460
#extension GL_GOOGLE_include_directive : require
// Decodes the triangles of clusters into floats of their tree's grid, which the driver builds structures from. A group
// has a cluster.
#include "scene.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 9) readonly restrict buffer Ranges { RangeRecord ranges[]; };
layout(std430, binding = 10) writeonly restrict buffer Vertices { float vertices[]; }; // 9 a triangle
layout(push_constant) uniform Push { SpanRecord span; }; // of ranges; reserved: number of their geometry's first triangle in `vertices`

void main() {
  RangeRecord range = ranges[span.first + gl_WorkGroupID.x];
  Cluster c = read_cluster(range.cluster);
  for (uint t = gl_LocalInvocationID.x; t < c.triangle_count; t += 64u) {
    uvec3 numbers = triangle_vertices(c, t);
    uint at = 9u * (span.reserved + range.first_triangle + t);
    for (uint corner = 0u; corner < 3u; ++corner) {
      vec3 p = position(c, numbers[corner]);
      for (uint axis = 0u; axis < 3u; ++axis) vertices[at + 3u * corner + axis] = p[axis];
    }
  }
}
