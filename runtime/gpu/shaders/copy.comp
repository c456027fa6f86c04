#version 460
// Copies words: a lower bound of the time that reading and writing takes.
layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly restrict buffer From { uvec4 from[]; };
layout(std430, binding = 1) writeonly restrict buffer To { uvec4 to[]; };
layout(push_constant) uniform Push { uint count; }; // vectors of four words

void main() {
  uint stride = gl_NumWorkGroups.x * 256u;
  for (uint i = gl_GlobalInvocationID.x; i < count; i += stride) to[i] = from[i];
}
