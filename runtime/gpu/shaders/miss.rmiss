#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#include "unit_ray.glsl"
#include "found.glsl"

layout(location = 0) rayPayloadInEXT Found found;

void main() { found.best.placement = 0xffffffffu; }
