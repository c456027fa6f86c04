// Leaves that a subgroup decodes together: one lane sets a leaf up, and each lane finds a corner.

// What the lanes that decode a leaf's corners must know of it.
struct Leaf { uint cluster, ranks, leads, lo, hi, turns, corner_count, triangle_count; };

Leaf set_up(uint node, uint slot) {
  Leaf e;
  uint n0w = nodes[5u * node].w;
  uvec4 n1 = nodes[5u * node + 1u];
  uint shift = 8u * (slot & 3u), before0 = n1.z * 0x01010101u, before1 = n1.w * 0x01010101u;
  uint count = ((slot < 4u ? n1.z : n1.w) >> shift) & 255u;
  uint before = (((slot < 4u ? before0 : before1) >> shift) & 255u) + (slot < 4u ? 0u : before0 >> 24) - count;
  uint node_first = n0w >> 24, first = node_first + before;
  e.cluster = n1.y;
  Cluster c = read_cluster(n1.y);
  bool dead = count == 0u || (c.flags & kOcclusionClass) == 0u;
  count = max(count, 1u);
  uint tris = c.triangle_count, restarts = bits_at(c.base, first), lefts = bits_at(c.base, tris + first);
  // prepare.comp: counting begins at the node.
  uint node_strips = n1.x >> 16, node_corner = node_first + 2u * node_strips;
  uint corner = first + 2u * (node_strips + count_ones(c.base, node_first, before));
  uint rank = (n1.x & 0xffffu) + count_ones(c.base, 2u * tris + node_corner, corner - node_corner);
  bool leading = (restarts & 1u) == 0u;
  e.leads = 0u;
  if (leading) {
    uint strip = uint(last_one(c.base, 0u, first + 1u, 0u));
    bool left = (lefts & 1u) != 0u;
    int turn = last_one(c.base, tris + strip + 1u, first - strip, left ? 0xffffffffu : 0u);
    uint first_corner = corner - (first - strip);
    uint kept = turn >= 0 ? first_corner + uint(turn) : first_corner - (left ? 2u : 1u);
    uint pair = 0u; // the second corner above the first
    [[dont_unroll]] for (uint k = 0u; k < 2u; ++k)
      pair = (pair << 16) | earlier_number(c, (k == 0u) == left ? corner - 1u : kept, corner, rank);
    e.leads = pair;
  }
  uint bit = 2u * tris + corner, at = c.base + (bit >> 5), offset = bit & 31u;
  uint w0 = words[at], w1 = words[at + 1u], w2 = words[at + 2u];
  e.lo = funnel(w0, w1, offset);
  e.hi = funnel(w1, w2, offset);
  restarts = (restarts & ((1u << count) - 1u)) | 1u;
  e.turns = restarts | (lefts << 16);
  e.corner_count = count + 2u * bitCount(restarts);
  e.ranks = rank | ((corner - rank) << 10) | (leading ? 1u << 20 : 0u);
  e.triangle_count = dead ? 0u : count;
  return e;
}

// Corner j of a leaf's list.
vec3 leaf_corner(uint cluster, uint ranks, uint leads, uint lo, uint hi, uint j) {
  Cluster c = read_cluster(cluster);
  bool leading = (ranks & (1u << 20)) != 0u;
  uint number;
  if (leading && j < 2u) {
    number = j == 0u ? leads & 0xffffu : leads >> 16;
  } else {
    if (leading) j -= 2u;
    uint word = j < 32u ? lo : hi, below = word & ((1u << (j & 31u)) - 1u);
    uint ones = bitCount(below) + (j < 32u ? 0u : bitCount(lo)), rank = ranks & 1023u, named = (ranks >> 10) & 1023u;
    number = corner_number(c, rank + ones + named + j - ones, rank + ones, ((word >> (j & 31u)) & 1u) != 0u);
  }
  return position(c, number);
}

// Corners A, B, C of triangle j of a leaf whose corners begin at `base`.
uvec3 triangle_corners(uint turns, uint base, uint j) {
  uint restarts = turns & 0xffffu, lefts = turns >> 16, upto = (2u << j) - 1u;
  uint through = restarts & upto, strip = uint(findMSB(through));
  uint C = base + j + 2u * bitCount(through), A = C - 2u, B = C - 1u;
  if (strip != j) {
    // The corner that does not change: where the last turn the other way was made.
    uint strip_c = C - (j - strip), after = upto & ~((2u << strip) - 1u);
    bool left = ((lefts >> j) & 1u) != 0u;
    uint other = (left ? ~lefts : lefts) & after;
    uint kept = other != 0u ? strip_c + (uint(findMSB(other)) - strip) - 1u : strip_c - (left ? 2u : 1u);
    A = left ? kept : C - 1u;
    B = left ? C - 1u : kept;
  }
  return uvec3(A, B, C);
}
