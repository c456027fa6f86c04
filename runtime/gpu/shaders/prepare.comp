#version 460
#extension GL_GOOGLE_include_directive : require
// Once after the upload: first_child of a node with leaves, 0 in the file, becomes the rank of its first leaf's first
// corner | the strips that begin before it << 16. Counting in the queue kernel begins there.
#define NODES_WRITABLE
#include "scene.glsl"

layout(local_size_x = 64) in;
layout(push_constant) uniform Push { SpanRecord span; }; // of nodes

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= span.count) return;
  i += span.first;
  uvec4 n0 = nodes[5u * i], n1 = nodes[5u * i + 1u];
  if ((n1.z & 255u) == kInnerChild || (n1.z & 255u) == 0u) return;
  Cluster c = read_cluster(n1.y);
  if (c.triangle_count == 0u) return; // of a level of detail that is not traced
  uint first = n0.w >> 24, strips = count_ones(c.base, 0u, first);
  nodes[5u * i + 1u].x = count_ones(c.base, 2u * c.triangle_count, first + 2u * strips) | (strips << 16);
}
