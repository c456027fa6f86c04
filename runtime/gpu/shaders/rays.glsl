// Rays in the grid of a placed tree: packed/kernels/enter.h.
struct GridRay {
  vec3 inverse;             // reciprocals of the direction, always finite
  vec3 near_bias, far_bias; // the ray crosses a plane p at p inverse + bias
  float begin, end;         // hits lie in (begin, end]
  vec3 origin, shear;       // along Woop's axes
  vec3 rest;                // nearest hits: the origin's rounding error along Woop's axes
  uint major;               // 0: z, 1: x, 2: y is the direction's largest component; Woop's kx is then x, y, z
  double t_begin, t_scale;  // nearest hits: unit-space t = (t + t_begin) t_scale
};

// Box tests of nodes multiply inverses by 2^31 and 2^24, so directions are at least this. It moves a ray by at most
// 6 M 2^-40, which kBoxPad covers, and kGradedPad for graded trees.
const float kMinDirection = 1.0 / 1099511627776.0;
const float kGradedPad = 1.0 / 65536.0;

vec3 along_k(vec3 v, uint major) { return major == 0u ? v : major == 1u ? v.yzx : v.zxy; }

// Whether rays may start far away from a placed tree. Those from the surface of the only one do not.
#ifdef FROM_SURFACES
#define kMayBeFar kManyPlacements
#else
#define kMayBeFar true
#endif

// The value of the larger magnitude; NaN stays.
double larger_magnitude(double most, double x) {
  double size = abs(x);
  return most > size ? most : size;
}

// Moves the origin of a ray that starts far away to the tree's box. Returns false if the ray misses it.
bool approach(uint number, double margin, inout dvec3 origin, dvec3 direction, out double moved_by) {
  double begin = 0.0lf, end = 1e300lf;
  moved_by = 0.0lf;
  [[unroll]] for (int i = 0; i < 3; ++i) {
    precise double lo = placements[number].box_lo[i] - margin - origin[i];
    precise double hi = placements[number].box_hi[i] + margin - origin[i];
    if (direction[i] == 0.0lf) {
      if (lo > 0.0lf || hi < 0.0lf) return false;
      continue;
    }
    precise double a = lo / direction[i], b = hi / direction[i];
    double first = a < b ? a : b, last = a < b ? b : a;
    begin = begin > first ? begin : first;
    end = end < last ? end : last;
  }
  if (begin > end) return false;
  precise dvec3 moved = origin + begin * direction;
  origin = moved;
  moved_by = begin;
  return true;
}

void set_boxes(vec3 origin, vec3 direction, float pad_coordinate, float least, inout GridRay r) {
  float reach = max(max(pad_coordinate, abs(origin.x)), max(abs(origin.y), abs(origin.z)));
  [[unroll]] for (int i = 0; i < 3; ++i) {
    float over = divided(1.0, max(abs(direction[i]), least));
    float inverse = uintBitsToFloat(floatBitsToUint(over) | (floatBitsToUint(direction[i]) & 0x80000000u));
    precise float back = origin[i] * inverse, away = kBoxPad * reach * over;
    r.inverse[i] = inverse;
    r.near_bias[i] = -back - away;
    r.far_bias[i] = away - back;
  }
}

// Transforms a ray into the grid of a placement. Returns false if it can hit nothing there.
// least: smallest direction component of box tests
bool enter(UnitRay u, uint number, float max_coordinate, float pad_coordinate, float least, out GridRay r) {
  dvec3 from = dvec3(u.origin), way = dvec3(u.direction), origin, direction;
  if ((placements[number].classes_aligned >> 16) != 0u) {
    [[unroll]] for (int i = 0; i < 3; ++i) {
      precise double d = placements[number].grid_from_unit[4 * i] * way[i];
      precise double s = placements[number].grid_from_unit[4 * i] * from[i];
      precise double o = s + placements[number].grid_from_unit[9 + i];
      direction[i] = d;
      origin[i] = o;
    }
  } else {
    [[unroll]] for (int i = 0; i < 3; ++i) {
      double x = placements[number].grid_from_unit[i], y = placements[number].grid_from_unit[3 + i],
             z = placements[number].grid_from_unit[6 + i];
      precise double dx = x * way.x, dy = y * way.y, dz = z * way.z, d = dx + dy + dz;
      precise double sx = x * from.x, sy = y * from.y, sz = z * from.z, s = sx + sy + sz;
      precise double o = s + placements[number].grid_from_unit[9 + i];
      direction[i] = d;
      origin[i] = o;
    }
  }
  double largest = larger_magnitude(larger_magnitude(larger_magnitude(0.0lf, direction.x), direction.y), direction.z);
  double away = larger_magnitude(larger_magnitude(larger_magnitude(0.0lf, origin.x), origin.y), origin.z);
  if (!(largest > 0.0lf && largest < 1e300lf && away < 1e300lf)) return false;
  // Down to a power of two in [2^-500, 2^500], whose inverse is one, too.
  uint exponent = clamp(unpackDouble2x32(largest).y & 0x7ff00000u, 523u << 20, 1523u << 20);
  double power = packDouble2x32(uvec2(0u, exponent)), scale = packDouble2x32(uvec2(0u, 0x7fe00000u - exponent));
  direction *= scale;
  double begin = 0.0lf;
  if (kMayBeFar && away > double(kFar) * double(max_coordinate) &&
      !approach(number, double(max_coordinate) / 256.0lf, origin, direction, begin))
    return false;
  vec3 rounded = vec3(origin), rounded_direction = vec3(direction);
  precise double near = double(u.tnear) * power - begin, tmax = double(u.tmax) * power;
  r.begin = float(near);
#ifdef CLOSEST
  precise double far = tmax - begin + (begin != 0.0lf ? double(kUnitRounding) * tmax : 0.0lf);
#else
  precise double far = tmax - begin;
#endif
  r.end = float(far);
  r.t_begin = begin;
  r.t_scale = scale;
  set_boxes(rounded, rounded_direction, pad_coordinate, least, r);
  vec3 size = abs(rounded_direction);
  r.major = size.z >= size.x && size.z >= size.y ? 0u : size.y >= size.x ? 2u : 1u;
  vec3 k = along_k(rounded_direction, r.major);
  r.shear = vec3(divided(k.x, k.z), divided(k.y, k.z), divided(1.0, k.z));
  r.origin = along_k(rounded, r.major);
#ifdef CLOSEST
  precise dvec3 rest = origin - dvec3(rounded);
  r.rest = along_k(vec3(rest), r.major);
#else
  r.rest = vec3(0.0);
#endif
  return true;
}

// A grid t that is not below any that maps to `unit_t`.
float grid_t(GridRay r, float unit_t) {
  precise double t = double(unit_t) / r.t_scale;
  precise double end = t - r.t_begin + (r.t_begin != 0.0lf ? double(kUnitRounding) * t : 0.0lf);
  return float(end);
}
