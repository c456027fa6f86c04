// One ray, one thread, through the tree over placements and the placed trees. CLOSEST: nearest hits, else any hits.
#define WEIGHTS
#include "scene.glsl"
#include "unit_ray.glsl"
#include "rays.glsl"
#include "triangles.glsl"
#include "masks.glsl"

// Entries are groups of nodes that are still to be visited: their first number, and which. For any hits a bit mask, of
// which the lowest is next; for nearest hits nibbles 8 | slot, nearest first.
uvec2 stack[kStack];

#ifdef CLOSEST
void order(inout uint a, inout uint b) {
  uint lo = min(a, b);
  b = max(a, b);
  a = lo;
}
// Nibbles of the children in the bit mask, nearest first.
uint nearest_first(uint mask, float t[8]) {
  uint k[8];
  [[unroll]] for (uint i = 0u; i < 8u; ++i)
    k[i] = (mask & (1u << i)) != 0u ? (floatBitsToUint(max(t[i], 0.0)) & ~7u) | i : 0xffffffffu;
  order(k[0], k[1]); order(k[2], k[3]); order(k[4], k[5]); order(k[6], k[7]);
  order(k[0], k[2]); order(k[1], k[3]); order(k[4], k[6]); order(k[5], k[7]);
  order(k[1], k[2]); order(k[5], k[6]); order(k[0], k[4]); order(k[3], k[7]);
  order(k[1], k[5]); order(k[2], k[6]);
  order(k[1], k[4]); order(k[3], k[6]);
  order(k[2], k[4]); order(k[3], k[5]);
  order(k[3], k[4]);
  uint nibbles = 0u;
  [[unroll]] for (int i = 7; i >= 0; --i)
    if (k[i] != 0xffffffffu) nibbles = (nibbles << 4) | 8u | (k[i] & 7u);
  return nibbles;
}
uint group_of(uint mask, float t[8]) { return nearest_first(mask, t); }
uint take_slot(inout uint group) {
  uint slot = group & 7u;
  group >>= 4;
  return slot;
}
const uint kRootGroup = 8u;
#else
uint group_of(uint mask, float t[8]) { return mask; }
uint take_slot(inout uint group) {
  uint slot = uint(findLSB(group));
  group &= group - 1u;
  return slot;
}
const uint kRootGroup = 1u;
#endif

struct Node { uvec4 n0, n1, n2, n3, n4; };
Node read_node(uint number) {
  uint at = 5u * number;
  return Node(nodes[at], nodes[at + 1u], nodes[at + 2u], nodes[at + 3u], nodes[at + 4u]);
}
// A node of the tree over placements.
Node read_top_node(uint number) {
  uint at = 7u * number;
  return Node(top_nodes[at], top_nodes[at + 1u], top_nodes[at + 2u], top_nodes[at + 3u], top_nodes[at + 4u]);
}
// The number of its child, or kTopLeaf + a placement.
uint top_child(uint number, uint slot) { return top_words[28u * number + 20u + slot]; }

// Bytes 0 and 2 of a word, in units of 2^-24 with kHalfBytes.
vec2 even_bytes(uint word) {
  if (kHalfBytes) return unpackHalf2x16(word & 0x00ff00ffu);
  return vec2(float(word & 255u), float((word >> 16) & 255u));
}

// The children whose boxes the ray passes, as a bit mask, and where it enters them.
// top: of the tree over placements, whose nodes have float origins
uint pass_boxes(GridRay r, Node n, bool top, bool graded, inout float t[8]) {
  uvec3 exponents = top ? uvec3(n.n1.y, n.n1.y >> 8, n.n1.y >> 16) & 255u
                        : (uvec3(n.n0.w, n.n0.w >> 5, n.n0.w >> 10) & 31u) + 127u;
  vec3 unit = uintBitsToFloat(exponents << 23), a = unit * r.inverse;
  vec3 o = top ? uintBitsToFloat(n.n0.xyz) : vec3(ivec3(n.n0.xyz));
  vec3 near_bias = fma(o, r.inverse, r.near_bias), far_bias = fma(o, r.inverse, r.far_bias);
  if (kAnyGraded && graded) { // beam.h: enlarge_boxes(); 4 u more for the sums here
    vec3 most = max(abs(o), abs(o + 255.0 * unit));
    float pad = 32.0 / 16777216.0 * max(max(most.x, most.y), most.z);
    near_bias -= pad * abs(r.inverse);
    far_bias += pad * abs(r.inverse);
  }
  if (kHalfBytes) a *= 16777216.0;
  bvec3 back = lessThan(r.inverse, vec3(0.0));
  uvec2 nx = back.x ? n.n3.zw : n.n2.xy, fx = back.x ? n.n2.xy : n.n3.zw;
  uvec2 ny = back.y ? n.n4.xy : n.n2.zw, fy = back.y ? n.n2.zw : n.n4.xy;
  uvec2 nz = back.z ? n.n4.zw : n.n3.xy, fz = back.z ? n.n3.xy : n.n4.zw;
  uint mask = 0u;
  [[unroll]] for (uint h = 0u; h < 2u; ++h)
    [[unroll]] for (uint i = 0u; i < 2u; ++i) {
      vec2 x0 = even_bytes(nx[h] >> (8u * i)), y0 = even_bytes(ny[h] >> (8u * i)), z0 = even_bytes(nz[h] >> (8u * i));
      vec2 x1 = even_bytes(fx[h] >> (8u * i)), y1 = even_bytes(fy[h] >> (8u * i)), z1 = even_bytes(fz[h] >> (8u * i));
      [[unroll]] for (uint j = 0u; j < 2u; ++j) {
        float t0 = max(max(fma(x0[j], a.x, near_bias.x), fma(y0[j], a.y, near_bias.y)),
                       max(fma(z0[j], a.z, near_bias.z), r.begin));
        float t1 = min(min(fma(x1[j], a.x, far_bias.x), fma(y1[j], a.y, far_bias.y)),
                       min(fma(z1[j], a.z, far_bias.z), r.end));
        if (t0 <= t1) mask |= 1u << (4u * h + i + 2u * j);
#ifdef CLOSEST
        t[4u * h + i + 2u * j] = t0;
#endif
      }
    }
  return mask;
}

#ifdef CLOSEST
// Whether a hit comes before another with the same t.
bool precedes(uint placement, uint cluster, uint triangle, Best best) {
  if (placement != best.placement) return placement < best.placement;
  if (cluster != best.cluster) return cluster < best.cluster;
  return triangle < best.triangle;
}
#endif

// Records a hit. Returns whether the ray is done.
bool take_hit(inout UnitRay u, inout GridRay r, inout Best best, uint placement, uint number, Cluster c, uint triangle,
              TriangleHit hit, uvec3 vertices, uint ray_class) {
#ifdef CLOSEST
  precise double unit = (double(hit.t) + r.t_begin) * r.t_scale;
  float unit_t = float(unit);
  if (unit_t > u.tmax || (unit_t == u.tmax && !precedes(placement, number, triangle, best))) return false;
#endif
  if (kAnyMasked && (c.flags & kMaskedCluster) != 0u &&
      !present(c, vertices, vec2(hit.u, hit.v), mask_words[scene.material_word + placement], ray_class))
    return false;
#ifdef CLOSEST
  u.tmax = unit_t;
  r.end = grid_t(r, unit_t);
  best = Best(hit.u, hit.v, placement, number, triangle);
  return false;
#else
  return true;
#endif
}

bool trace_leaf(inout UnitRay u, inout GridRay r, inout Best best, uint placement, uint number, Cluster c, uint first,
                uint count, uint tree_flags, uint ray_class) {
  uvec2 lead;
  Walk w = begin_walk(c, first, lead);
  bool leading = (w.restarts & 1u) == 0u;
  Corner A, B, C;
  uvec3 vertices = uvec3(0u);
  for (uint i = 0u; i < count; ++i) {
    if (i == 0u || (w.restarts & 1u) != 0u) {
      if (!leading || i > 0u) {
        lead.x = next_number(c, w);
        lead.y = next_number(c, w);
      }
      vertices.xy = lead;
      A = make_corner(r, along_k(position(c, lead.x), r.major));
      B = make_corner(r, along_k(position(c, lead.y), r.major));
    } else if ((w.lefts & 1u) != 0u) {
      B = C;
      vertices.y = vertices.z;
    } else {
      A = C;
      vertices.x = vertices.z;
    }
    vertices.z = next_number(c, w);
    C = make_corner(r, along_k(position(c, vertices.z), r.major));
    w.restarts >>= 1;
    w.lefts >>= 1;
    TriangleHit hit;
    if (test_triangle(r, A, B, C, tree_flags, hit) &&
        take_hit(u, r, best, placement, number, c, first + i, hit, vertices, ray_class))
      return true;
  }
  return false;
}

bool trace_leaves(inout UnitRay u, inout GridRay r, inout Best best, uint placement, Node n, uint mask, uint tree_flags,
                  uint ray_class) {
  uint number = n.n1.y;
  Cluster c = read_cluster(number);
  if ((c.flags & ray_class) == 0u) return false;
  uint before0 = n.n1.z * 0x01010101u, before1 = n.n1.w * 0x01010101u, first = n.n0.w >> 24;
  for (; mask != 0u; mask &= mask - 1u) {
    uint slot = uint(findLSB(mask)), shift = 8u * (slot & 3u);
    bool low = slot < 4u;
    uint count = ((low ? n.n1.z : n.n1.w) >> shift) & 255u;
    uint through = (((low ? before0 : before1) >> shift) & 255u) + (low ? 0u : before0 >> 24);
    if (count != 0u && trace_leaf(u, r, best, placement, number, c, first + through - count, count, tree_flags, ray_class))
      return true;
  }
  return false;
}

// Traces a ray through a placed tree. Returns whether it is done.
// base: stack entries in use
bool trace_placement(inout UnitRay u, inout Best best, uint placement, uint base, uint ray_class) {
  if ((placements[placement].classes_aligned & ray_class) == 0u) return false;
  TreeRecord tree = trees[placements[placement].tree];
  bool graded = kAnyGraded && (tree.flags & kGraded) != 0u;
  GridRay r;
  if (!enter(u, placement, tree.max_coordinate, (graded ? kGradedPad : 1.0) * tree.max_coordinate, kMinDirection, r))
    return false;
  uint first = tree.first_node, group = kRootGroup, size = base;
  for (;;) {
    if (group == 0u) {
      if (size == base) return false;
      --size;
      first = stack[size].x;
      group = stack[size].y;
    }
    Node n = read_node(first + take_slot(group));
    if (((n.n0.w >> 16) & ray_class) == 0u) continue;
    float t[8];
    uint mask = pass_boxes(r, n, false, graded, t);
    if (mask == 0u) continue;
    if ((n.n1.z & 255u) == kInnerChild) {
      if (group != 0u) stack[size++] = uvec2(first, group);
      first = tree.first_node + n.n1.x;
      group = group_of(mask, t);
    } else if (trace_leaves(u, r, best, placement, n, mask, tree.flags, ray_class)) {
      return true;
    }
  }
}

// Traces a ray through the whole scene. Returns whether it hits; for nearest hits, u.tmax and `best` say where.
bool trace(inout UnitRay u, inout Best best, uint ray_class) {
  if (scene.placement_count == 0u) return false;
  if (!kManyPlacements) return trace_placement(u, best, 0u, 0u, ray_class);
  GridRay top;
  if (!enter(u, scene.placement_count, scene.top_max_coordinate, scene.top_pad_coordinate, kMinTopDirection, top))
    return false;
  uint node = 0u, size = 0u;
  float t[8];
  uint group = group_of(pass_boxes(top, read_top_node(0u), true, false, t), t);
  for (;;) {
    // Rays look for their next placements first, so that those of a subgroup enter them together.
    uint child = 0u;
    while ((child & kTopLeaf) == 0u) {
      if (group == 0u) {
        if (size == 0u) return false;
        --size;
        node = stack[size].x;
        group = stack[size].y;
        continue;
      }
      child = top_child(node, take_slot(group));
      if ((child & kTopLeaf) != 0u) break;
      if (group != 0u) stack[size++] = uvec2(node, group);
      node = child;
      group = group_of(pass_boxes(top, read_top_node(node), true, false, t), t);
    }
    // The group that is left waits in its variables, above the stack.
    if (trace_placement(u, best, child & ~kTopLeaf, size, ray_class)) return true;
#ifdef CLOSEST
    top.end = grid_t(top, u.tmax);
#endif
  }
}
