// Rays in unit space, and their nearest hits.
struct UnitRay {
  vec3 origin, direction;
  float tnear, tmax; // tmax: inclusive end, the float below tfar, or the t of the nearest hit so far
};
struct Best {
  float u, v;
  uint placement, cluster, triangle; // placement 0xffffffff: none
};

UnitRay unit_ray(vec3 origin, vec3 direction, float tnear, float tfar) {
  return UnitRay(origin, direction, tnear, uintBitsToFloat(floatBitsToUint(tfar) - 1u));
}
