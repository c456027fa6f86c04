// The watertight triangle test: packed/kernels/triangle_test.h, the same operations in the same order.

// Corners along Woop's axes, as decoded, and in the ray's sheared plane.
struct Corner {
  vec3 v;
  float x, y;
};
struct TriangleHit { float t, u, v; };

Corner make_corner(GridRay r, vec3 along) {
  Corner c;
  c.v = along;
  precise vec3 p = along - r.origin;
  c.x = fused(-r.shear.x, p.z, p.x);
  c.y = fused(-r.shear.y, p.z, p.y);
  return c;
}

float difference_of_products(float a, float b, float c, float d) {
  precise float cd = c * d;
  precise float sum = fused(a, b, -cd) + fused(-c, d, cd);
  return sum;
}

// The plane's normal along Woop's axes, not of unit length.
vec3 plane_normal(Corner a, Corner b, Corner c, uint tree_flags) {
  if (kAnyFine && (tree_flags & kInexactDifferences) != 0u) {
    precise dvec3 e = dvec3(b.v) - dvec3(a.v), f = dvec3(c.v) - dvec3(a.v);
    precise dvec3 m = e.yzx * f.zxy, n = e.zxy * f.yzx, normal = m - n;
    return vec3(normal);
  }
  precise vec3 e = b.v - a.v, f = c.v - a.v;
  return vec3(difference_of_products(e.y, f.z, e.z, f.y), difference_of_products(e.z, f.x, e.x, f.z),
              difference_of_products(e.x, f.y, e.y, f.x));
}

double exact_shear(float shear, double p, double z) {
  precise double product = double(shear) * z;
  precise double sheared = p - product;
  return sheared;
}

bool test_exactly(GridRay r, Corner a, Corner b, Corner c, vec3 normal, float depth, float along, bool fine,
                  out TriangleHit hit) {
  dvec3 x = dvec3(a.x, b.x, c.x), y = dvec3(a.y, b.y, c.y);
  precise vec3 float_z = vec3(a.v.z, b.v.z, c.v.z) - r.origin.z;
  dvec3 z = dvec3(float_z);
  double height = double(depth);
  hit = TriangleHit(0.0, 0.0, 0.0);
  if (fine) {
    precise dvec3 p = dvec3(a.v.x, b.v.x, c.v.x) - double(r.origin.x), q = dvec3(a.v.y, b.v.y, c.v.y) - double(r.origin.y);
    precise dvec3 zz = dvec3(a.v.z, b.v.z, c.v.z) - double(r.origin.z);
    z = zz;
    for (int i = 0; i < 3; ++i) {
      x[i] = exact_shear(r.shear.x, p[i], z[i]);
      y[i] = exact_shear(r.shear.y, q[i], z[i]);
    }
    precise double h = (p.x - double(r.rest.x)) * double(normal.x);
    h = h + (q.x - double(r.rest.y)) * double(normal.y);
    h = h + (z.x - double(r.rest.z)) * double(normal.z);
    height = h;
  }
  double u = double_difference(x.z, y.y, y.z, x.y), v = double_difference(x.x, y.z, y.x, x.z),
         w = double_difference(x.y, y.x, y.y, x.x);
  if ((u < 0.0lf || v < 0.0lf || w < 0.0lf) && (u > 0.0lf || v > 0.0lf || w > 0.0lf)) return false;
  precise double sum = u + v + w;
  if (sum == 0.0lf) return false;
  double least = min(z.x, min(z.y, z.z)), most = max(z.x, max(z.y, z.z));
  precise double at = along != 0.0 ? height / double(along) : (u * z.x + v * z.y + w * z.z) / sum;
  at = at < least ? least : at > most ? most : at;
  precise double t = at * double(r.shear.z), hit_u = v / sum, hit_v = w / sum;
  hit = TriangleHit(float(t), float(hit_u), float(hit_v));
  return true;
}

float largest(float a, float b) { return max(abs(a), abs(b)); }

// Bound of the error of edge functions that comes from rounding the sheared corners.
float shear_error(GridRay r, Corner a, Corner b, Corner c) {
  precise vec3 p = abs(a.v - r.origin), q = abs(b.v - r.origin), s = abs(c.v - r.origin);
  vec3 most = max(max(p, q), s);
  float reach = max(max(most.x, most.y), most.z);
  float sheared = max(max(largest(a.x, a.y), largest(b.x, b.y)), largest(c.x, c.y));
  precise float product = reach * (1.0 / 1099511627776.0);
  precise float error = reach * fused(sheared, 1.0 / 524288.0, product);
  return error;
}

// Whether rounding may decide on which side of the plane a ray starts.
bool starts_near_plane(GridRay r, Corner a, vec3 normal, float depth) {
  precise vec3 p = a.v - r.origin;
  precise float size = abs(p.x * normal.x);
  size = size + abs(p.y * normal.y);
  size = size + abs(p.z * normal.z);
  return abs(depth) <= size * (1.0 / 1048576.0);
}

// Whether the ray hits the triangle within (begin, end].
bool test_triangle(GridRay r, Corner a, Corner b, Corner c, uint tree_flags, out TriangleHit hit) {
  precise float u2 = c.y * b.x, v2 = a.y * c.x, w2 = b.y * a.x;
  float u = fused(c.x, b.y, -u2), v = fused(a.x, c.y, -v2), w = fused(b.x, a.y, -w2);
  float least = min(min(u, v), w), most = max(max(u, v), w);
  precise float error = fused(max(largest(u2, v2), abs(w2)), kEdgeError, kSmallestEdge);
  bool fine = kAnyFine && (tree_flags & kFineTree) != 0u;
  if (fine) error = error + shear_error(r, a, b, c);
  bool inside = error < least || most < -error;
  bool unsure = !inside && (-error <= least || most <= error);
  hit = TriangleHit(0.0, 0.0, 0.0);
  if (!inside && !unsure) return false;
  vec3 normal = plane_normal(a, b, c, tree_flags);
  precise vec3 p = a.v - r.origin;
  precise float across = p.z * normal.z;
  precise float depth = fused(p.x, normal.x, fused(p.y, normal.y, across));
#ifdef CLOSEST
  precise float nearer = r.rest.z * normal.z;
  depth = depth - fused(r.rest.x, normal.x, fused(r.rest.y, normal.y, nearer));
#endif
  float along = fused(r.shear.x, normal.x, fused(r.shear.y, normal.y, normal.z));
  if (inside && along == 0.0) unsure = true;
  if (fine && inside && starts_near_plane(r, a, normal, depth)) unsure = true;
  if (unsure) {
    if (!test_exactly(r, a, b, c, normal, depth, along, fine, hit)) return false;
  } else {
    precise float t = divided(depth, along) * r.shear.z;
    hit.t = t;
#ifdef WEIGHTS
    precise float sum = (u + v) + w;
    float over = divided(1.0, sum);
    precise float hit_u = v * over, hit_v = w * over;
    hit.u = hit_u;
    hit.v = hit_v;
#endif
  }
  return r.begin < hit.t && hit.t <= r.end;
}
