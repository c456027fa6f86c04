#version 460
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
// Asks a device how it rounds. Counts the operations whose result is not the right one.
#include "arithmetic.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Counts { uint counts[]; };

uint hash32(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}
float between_1_and_2(uint x) { return uintBitsToFloat((hash32(x) & 0x007fffffu) | 0x3f800000u); }

void main() {
  uint i = gl_GlobalInvocationID.x;
  float a = between_1_and_2(i * 3u), b = between_1_and_2(i * 3u + 1u), c = -between_1_and_2(i * 3u + 2u);
  // fma: the right result from doubles
  precise double product = double(a) * double(b);
  if (fma(a, b, c) != float(odd_sum(product, double(c)))) atomicAdd(counts[0], 1u);
  // division as divided() makes it where kExactFloats is false
  precise double quotient = double(a) / double(b);
  if (divided(a, b) != float(quotient)) atomicAdd(counts[1], 1u);
  // contraction in spite of `precise`
  precise float m = a * b + c, p = a * b;
  precise float s = p + c;
  if (m != s) atomicAdd(counts[2], 1u);
  // double fma: rest of a product, by Dekker's method
  double da = double(a) * (1.0lf + 1.1102230246251565e-14lf * double(b)), db = double(b) * (1.0lf + 3.3e-13lf * double(a));
  const double kSplit = 134217729.0lf;
  precise double ta = kSplit * da, tb = kSplit * db, ah = ta - (ta - da), bh = tb - (tb - db), al = da - ah, bl = db - bh;
  precise double ab = da * db, rest = ((ah * bh - ab) + ah * bl + al * bh) + al * bl;
  precise double fused_rest = fma(da, db, -ab);
  if (fused_rest != rest) atomicAdd(counts[3], 1u);
  // bytes through denormal halves
  vec2 halves = unpackHalf2x16((i & 255u) | ((hash32(i) & 255u) << 16)) * 16777216.0;
  if (halves.x != float(i & 255u) || halves.y != float(hash32(i) & 255u)) atomicAdd(counts[4], 1u);
}
