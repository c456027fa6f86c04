#version 460
#extension GL_GOOGLE_include_directive : require
// The result without any pass of the filter.
#include "denoise.glsl"

layout(local_size_x = 32, local_size_y = 8) in;
layout(std430, binding = 0) readonly restrict buffer Noisy { uint noisy_in[]; };
layout(std430, binding = 1) readonly restrict buffer History { vec2 history[]; };
layout(std430, binding = 2) restrict buffer Result { float result[]; };
#include "denoise_finish.glsl"

void main() {
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  if (inside(p)) finish(index_of(p), noisy_in[index_of(p)]);
}
