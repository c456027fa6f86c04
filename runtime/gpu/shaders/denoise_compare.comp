#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
// Sets changes[0] and changes[1] unless the guides are those of the frame before and nothing moves.
#include "denoise.glsl"

layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly restrict buffer Depths { float view_z[]; };
layout(std430, binding = 1) readonly restrict buffer Normals { float normals[]; };
layout(std430, binding = 2) readonly restrict buffer Instances { uint instances[]; };
layout(std430, binding = 3) readonly restrict buffer Motions { vec2 motions[]; };
layout(std430, binding = 4) readonly restrict buffer Before { uvec4 guides_before[]; };
layout(std430, binding = 5) coherent restrict buffer Changes { uint changes[]; };

void main() {
  // Groups loop over the image until one has found a change, so they end early if much moves.
  uint stride = gl_NumWorkGroups.x * 256u;
  for (uint i = gl_GlobalInvocationID.x; i < pixel_count() && changes[0] == 0u; i += stride) {
    vec3 normal = vec3(normals[3u * i], normals[3u * i + 1u], normals[3u * i + 2u]);
    if (is_still(motions[i]) && guide_of(view_z[i], normal, instances[i]) == guides_before[i]) continue;
    // One thread per subgroup, because writes to the same word are serialised.
    if (subgroupElect()) changes[0] = changes[1] = 1u;
  }
}
