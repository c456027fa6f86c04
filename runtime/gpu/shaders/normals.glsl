// Shading normals of clusters: ClusterView::normal() and TriangleNormals::at(), the same bits.

// By placement: its instance, or kNoInstance for the tree of the world; then by cluster: a NormalRecord.
layout(std430, binding = 13) readonly restrict buffer Lookup { uint lookup[]; };

NormalRecord normal_record(uint cluster) {
  uint at = scene.placement_count + 4u * cluster;
  return NormalRecord(lookup[at], lookup[at + 1u], lookup[at + 2u], lookup[at + 3u]);
}

uint field_at(uint base, uint bit, uint width) { return bitfieldExtract(bits_at(base, bit), 0, int(width)); }

// Moves coordinates beyond a face of the cube to its neighbour: fold_normal().
void fold_normal(uint encoding, inout uint chart, inout ivec2 at) {
  int last_x = int(kNormalXCodes[encoding]) - 1, last_y = int(kNormalYCodes[encoding]) - 1;
  chart = min(chart, kNormalCharts[encoding] - 1u);
  ivec2 inside = clamp(at, ivec2(0), ivec2(last_x, last_y)), beyond = max(at - last_x, -at);
  if (kNormalFamily[encoding] != kAxisNormals || max(beyond.x, beyond.y) <= 0) {
    at = inside;
    return;
  }
  bool along_x = beyond.x > 0;
  int sunk = min((along_x ? beyond.x : beyond.y) - 1, last_x), height = (chart & 1u) != 0u ? sunk : last_x - sunk;
  chart = 2u * ((chart / 2u + (along_x ? 1u : 2u)) % 3u) + ((along_x ? at.x : at.y) < 0 ? 1u : 0u);
  at = along_x ? ivec2(inside.y, height) : ivec2(height, inside.x);
}

vec3 decode_zsign(uint chart, ivec2 at) {
  precise float x = float(at.x) * kZsignXStep - 1.0, y = float(at.y) * kZsignYStep - 1.0;
  precise float planar = x * x + y * y;
  if (planar >= 1.0) {
    float shortened = divided(1.0, rooted(planar));
    precise vec2 on_circle = vec2(x * shortened, y * shortened);
    return vec3(on_circle, 0.0);
  }
  precise float rest = 1.0 - planar;
  float z = rooted(rest);
  return vec3(x, y, chart != 0u ? -z : z);
}

float warp(float t) {
  precise float square = t * t;
  precise float warped = t * (kAxisSlope + kAxisCubic * square);
  return warped;
}

vec3 decode_axis(uint encoding, uint chart, ivec2 at) {
  int last = int(kNormalXCodes[encoding]) - 1;
  float unit = divided(1.0, float(last));
  precise float t = float(2 * at.x - last) * unit, s = float(2 * at.y - last) * unit;
  float u = warp(t), v = warp(s);
  precise float planar = u * u + v * v, rest = 1.0 - planar;
  float w = rooted(max(rest, 0.0));
  if ((chart & 1u) != 0u) w = -w;
  uint axis = chart / 2u;
  return axis == 0u ? vec3(w, u, v) : axis == 1u ? vec3(v, w, u) : vec3(u, v, w);
}

vec3 decode_oct(uint encoding, ivec2 at) {
  int middle = (int(kNormalXCodes[encoding]) - 1) / 2;
  float unit = divided(1.0, float(middle));
  precise float x = float(at.x - middle) * unit, y = float(at.y - middle) * unit;
  precise float z = 1.0 - abs(x) - abs(y);
  float fold = max(-z, 0.0);
  x = x - (x < 0.0 ? -fold : fold);
  y = y - (y < 0.0 ? -fold : fold);
  precise float square = x * x + y * y + z * z;
  float size = rooted(square);
  return vec3(divided(x, size), divided(y, size), divided(z, size));
}

vec3 vertex_normal(Cluster c, NormalRecord r, uint vertex) {
  uint begin = r.place & 0xfffffu, encoding = (r.place >> 20) & 15u, chart = (r.place >> 24) & 7u;
  uint x_bits = r.widths & 31u, y_bits = (r.widths >> 5) & 31u, chart_bits = (r.widths >> 10) & 7u;
  uint index_bits = (r.widths >> 13) & 15u, palette = r.widths >> 17, stride = x_bits + y_bits + chart_bits;
  uint entry = palette == 0u ? vertex : field_at(c.base, begin + palette * stride + vertex * index_bits, index_bits);
  uint bit = begin + entry * stride;
  ivec2 anchor = ivec2(bitfieldExtract(int(r.anchors), 0, 16), bitfieldExtract(int(r.anchors), 16, 16));
  ivec2 at = 2 * anchor + ivec2(field_at(c.base, bit + y_bits, x_bits), field_at(c.base, bit, y_bits));
  chart += field_at(c.base, bit + y_bits + x_bits, chart_bits); // one of them is 0
  fold_normal(encoding, chart, at);
  uint family = kNormalFamily[encoding];
  return family == kZsignNormals  ? decode_zsign(chart, at)
         : family == kAxisNormals ? decode_axis(encoding, chart, at)
                                  : decode_oct(encoding, at);
}

// The unit normal at a place on a triangle, in object space. Returns false if the cluster has no normals, or those of
// the corners cancel out.
// weights: of the second and third corner
bool interpolated_normal(Cluster c, NormalRecord r, uvec3 corners, vec2 weights, out vec3 normal) {
  normal = vec3(0.0);
  if ((r.place & kHasNormals) == 0u) return false;
  precise float first = 1.0 - weights.x - weights.y;
  vec3 v0 = vertex_normal(c, r, corners.x), v1 = vertex_normal(c, r, corners.y), v2 = vertex_normal(c, r, corners.z);
  precise vec3 sum = v0 * first + v1 * weights.x + v2 * weights.y;
  precise float square = sum.x * sum.x + sum.y * sum.y + sum.z * sum.z;
  float size = rooted(square);
  if (!(size > 0.0)) return false;
  normal = vec3(divided(sum.x, size), divided(sum.y, size), divided(sum.z, size));
  return true;
}
