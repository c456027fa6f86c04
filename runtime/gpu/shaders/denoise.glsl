// What all passes of the denoiser share. The formulas are those of runtime/denoise/kernels/, in the same order.
// Branches and thresholds decide as on the CPU, because all that leads to them is `precise`, quotient() or rooted().
#include "arithmetic.glsl"
#include "records.glsl"

layout(push_constant) uniform Push { DenoiseRecord terms; };

const float kSmallest = 1.17549435e-38, kLargest = 3.40282347e38; // normal floats
const float kSquaredNormalUnit = kNormalUnit * kNormalUnit;

// Unlike min() and max(), these define what NaN gives: `a`.
float lesser(float a, float b) { return b < a ? b : a; }
float greater(float a, float b) { return a < b ? b : a; }

bool has(uint flag) { return (terms.flags & flag) != 0u; }
ivec2 image_size() { return ivec2(terms.width, terms.height); }
bool inside(ivec2 p) { return all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, image_size())); }
uint index_of(ivec2 p) { return uint(p.y) * terms.width + uint(p.x); }
uint pixel_count() { return terms.width * terms.height; }

// Division by a positive number as on the CPU. Refining needs a normal divisor and a finite quotient.
float quotient(float a, float b) {
  float plain = a / b;
  return kExactFloats || (b >= kSmallest && abs(plain) <= kLargest) ? divided(a, b) : plain;
}

// --- guides: disparity, normal x | y << 16, normal z, instance ---
float disparity_of(float z) { return z >= kNearestDepth && z <= kFarthestDepth ? quotient(1.0, z) : 0.0; }
int low_half(uint word) { return bitfieldExtract(int(word), 0, 16); }
ivec3 normal_of(uint xy, uint z) { return ivec3(low_half(xy), int(xy) >> 16, low_half(z)); }
int dot_of(ivec3 a, ivec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// A component in kNormalUnit, rounded to nearest.
int component(float c) {
  precise float scaled = lesser(greater(c, -1.0), 1.0) * (1.0 / kNormalUnit) + 16384.5;
  return int(scaled) - 16384;
}
uvec4 guide_of(float z, vec3 normal, uint instance) {
  // False for NaN: such normals become 0.
  bool good = all(greaterThanEqual(normal, vec3(-2.0))) && all(lessThanEqual(normal, vec3(2.0)));
  ivec3 n = good ? ivec3(component(normal.x), component(normal.y), component(normal.z)) : ivec3(0);
  return uvec4(floatBitsToUint(disparity_of(z)), uint(n.x & 0xffff) | (uint(n.y) << 16), uint(n.z & 0xffff), instance);
}

// --- histories: mean and length; moments (mean square | fast mean << 16) and trend ---
float moment_of(uint units) {
  precise float moment = float(units) * (1.0 / kMomentUnits);
  return moment;
}
// To units of 1 / kMomentUnits, 16 bits. NaN becomes 0.
uint in_moment_units(float moment) {
  precise float scaled = lesser(greater(0.0, moment), 1.0) * kMomentUnits + 0.5;
  return uint(scaled);
}

bool is_still(vec2 motion) { return abs(motion.x) <= kStillMotion && abs(motion.y) <= kStillMotion; }

// --- integers of 16 bits in words ---
// Of two values, rounded up.
uint mean_up(uint a, uint b) { return (a + b + 1u) >> 1; }
// Of fractions in units of 2^-16.
uint product(uint a, uint b) { return (a * b) >> 16; }
uint in_ao_units(float ao) {
  precise float scaled = (ao > 0.0 ? (ao < 1.0 ? ao : 1.0) : 0.0) * kAoUnits + 0.5;
  return uint(scaled);
}
// 1 / sqrt(x) with a relative error below 0.2 %.
float reciprocal_root(float x) {
  precise float r = intBitsToFloat(0x5f375a86 - (floatBitsToInt(x) >> 1));
  precise float root = r * (1.5 - 0.5 * x * r * r);
  return root;
}
