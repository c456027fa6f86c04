// Directions of occlusion rays: runtime/ao/sampler.cpp, hemisphere.h and shading_points.cpp, the same bits.

uint hash32(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}
uint hash_combine(uint seed, uint value) { return hash32(seed + 0x9e3779b9u + hash32(value)); }
float unit_float(uint bits) { return float(bits >> 8) * (1.0 / 16777216.0); }

float exact_sqrt(float x) {
  precise double root = sqrt(double(x));
  return float(root);
}

// --- SamplerKind::kSpaceTimeNet ---
const uvec2 kPixelColumns[6] = uvec2[](uvec2(0xb7ffu, 0x854fu), uvec2(0x7e66u, 0xef59u), uvec2(0x9c2du, 0x9ef5u),
                                       uvec2(0xad83u, 0xf7c1u), uvec2(0xe44fu, 0xbc30u), uvec2(0xc8fdu, 0x1e43u));
uint scramble(uint digits, uint seed) {
  digits ^= digits * 0x3d20adeau;
  digits += seed;
  digits *= (seed >> 16) | 1u;
  digits ^= digits * 0x05526c56u;
  digits ^= digits * 0x53a22864u;
  return digits;
}
float scrambled(uint digits, uint seed, uint epoch) {
  return unit_float(bitfieldReverse(scramble(digits, hash32(seed ^ epoch))));
}
uint sobol_y(uint number) {
  number ^= (number >> 1) & 0x5555u;
  number ^= (number >> 2) & 0x3333u;
  number ^= (number >> 4) & 0x0f0fu;
  return number ^ ((number >> 8) & 0x00ffu);
}
vec2 net_point(uint base, uint x_px, uint y_px, uint s) {
  uint seed = hash_combine(hash_combine(base, x_px >> 3), y_px >> 3);
  uint code = 0u;
  [[unroll]] for (uint i = 0u; i < 3u; ++i)
    code |= (((x_px >> i) & 1u) << (2u * i)) | (((y_px >> i) & 1u) << (2u * i + 1u));
  code ^= hash_combine(seed, 3u) >> 26;
  uvec2 digits = uvec2(0u);
  [[unroll]] for (uint i = 0u; i < 6u; ++i)
    if (((code >> i) & 1u) != 0u) digits ^= kPixelColumns[i];
  uint number = s & 0xffffu, epoch = (s >> 16) != 0u ? hash32(s >> 16) : 0u;
  return vec2(scrambled(digits.x ^ number, hash_combine(seed, 1u), epoch),
              scrambled(digits.y ^ sobol_y(number), hash_combine(seed, 2u), epoch));
}

// --- 256 strata in squares of 16 x 16, for benchmarks of orders ---
vec2 stratum_point(uint order, uint pixel, uint s) {
  uint stratum = s & 255u;
  if (order == kRandomOrder) {
    uint h = hash32(pixel * 2u + 1u);
    stratum = (stratum * ((h >> 8) | 1u) + h) & 255u;
  } else { // along a Morton curve, so that what follows is near
    stratum = (stratum & 1u) | ((stratum & 4u) >> 1) | ((stratum & 16u) >> 2) | ((stratum & 64u) >> 3) |
              ((stratum & 2u) << 3) | ((stratum & 8u) << 2) | ((stratum & 32u) << 1) | (stratum & 128u);
  }
  uint h = hash32(pixel + 0x9e3779b9u * (stratum + 1u)), g = hash32(h ^ 0x85ebca6bu);
  precise vec2 p = (vec2(stratum & 15u, stratum >> 4) + vec2(unit_float(h), unit_float(g))) * (1.0 / 16.0);
  return p;
}

// --- hemisphere ---
vec3 cosine_direction(vec2 point) {
  precise float a = 2.0 * point.x - 1.0, b = 2.0 * point.y - 1.0;
  bool wide = abs(a) > abs(b);
  float radius = wide ? a : b;
  precise float scaled = 0.785398163 * (wide ? b : a);
  float angle = divided(scaled, radius != 0.0 ? radius : 1.0);
  precise float s = angle * angle;
  precise float sine = angle * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0))));
  precise float cosine = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s * (1.0 / 40320.0))));
  precise float rest = 1.0 - radius * radius;
  precise vec2 disk = vec2(radius * (wide ? cosine : sine), radius * (wide ? sine : cosine));
  return vec3(disk, exact_sqrt(max(0.0, rest)));
}
vec3 turned_to(vec3 n, vec3 local) {
  float sign = n.z < -0.4 ? -1.0 : 1.0;
  precise float sum = sign + n.z;
  float a = divided(-1.0, sum);
  precise float xy = n.x * n.y, b = xy * a;
  precise float xx = sign * n.x * n.x * a, yy = n.y * n.y * a;
  precise vec3 tangent = vec3(1.0 + xx, sign * b, -sign * n.x), bitangent = vec3(b, sign + yy, -n.y);
  precise vec3 x = tangent * local.x, y = bitangent * local.y, z = n * local.z, v = (x + y) + z;
  return v;
}
// Mirrored to the upper side of the surface.
vec3 occlusion_direction(vec2 point, vec3 up, vec3 normal) {
  vec3 d = turned_to(normal, cosine_direction(point));
  precise float x = d.x * up.x, y = d.y * up.y, z = d.z * up.z, height = (x + y) + z;
  float below = 0.0 < height ? 0.0 : height;
  precise float twice = 2.0 * below;
  precise vec3 back = twice * up, v = d - back;
  return v;
}
