// The buffers of a scene as they lie in the file, and the decoders of clusters.
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "arithmetic.glsl"

// RAY_PIPELINE: a ray generation shader, which leaves traversal to the driver; else a compute kernel.
#ifdef RAY_PIPELINE
#extension GL_EXT_ray_tracing : require
#define THREAD gl_LaunchIDEXT.x
#else
#define THREAD gl_GlobalInvocationID.x
#endif

layout(constant_id = 2) const uint kStack = 112;           // entries that a traversal may push
layout(constant_id = 3) const bool kManyPlacements = true; // there is a tree over placements
layout(constant_id = 4) const bool kAnyFine = true;        // some tree has kFineTree or kInexactDifferences
layout(constant_id = 5) const bool kAnyGraded = true;
layout(constant_id = 6) const bool kAnyMasked = true;
layout(constant_id = 7) const bool kAnyExactVertices = true;
layout(constant_id = 8) const bool kHalfBytes = false; // halves that are denormal convert exactly

#ifdef NODES_WRITABLE
layout(std430, binding = 0) buffer Nodes { uvec4 nodes[]; };
#else
layout(std430, binding = 0) readonly restrict buffer Nodes { uvec4 nodes[]; }; // 5 a node
#endif
layout(std430, binding = 1) readonly restrict buffer Clusters { uvec4 clusters[]; }; // 2 a cluster
layout(std430, binding = 2) readonly restrict buffer Payload { uint words[]; };
layout(std430, binding = 3) readonly restrict buffer Placements { PlacementRecord placements[]; };
layout(std430, binding = 4) readonly restrict buffer TopNodes { uvec4 top_nodes[]; }; // 7 a TopNodeRecord
layout(std430, binding = 4) readonly restrict buffer TopWords { uint top_words[]; };   // 28
layout(std430, binding = 5) readonly restrict buffer Trees { TreeRecord trees[]; };
layout(std430, binding = 6) readonly restrict buffer ExactVertices { float exact_vertices[]; }; // 3 a vertex
layout(std430, binding = 7) readonly restrict buffer Masks { uint mask_words[]; };
layout(std430, binding = 8) readonly restrict buffer Scene { SceneRecord scene; };

// --- bits ---
uint funnel(uint lo, uint hi, uint shift) { return uint(((uint64_t(hi) << 32) | uint64_t(lo)) >> shift); }
uint bits_at(uint base, uint bit) {
  uint at = base + (bit >> 5);
  return funnel(words[at], words[at + 1u], bit & 31u);
}
// Number of set bits in [bit, bit + count).
uint count_ones(uint base, uint bit, uint count) {
  uint at = base + (bit >> 5), shift = bit & 31u, end = shift + count, ones = 0u;
  uint word = words[at] & (0xffffffffu << shift);
  [[dont_unroll]] while (end >= 32u) {
    ones += bitCount(word);
    end -= 32u;
    word = words[++at];
  }
  return ones + bitCount(word & ((1u << end) - 1u));
}
// Offset from `bit` of the highest bit in [bit, bit + count) that differs from `inverted`'s, or -1.
int last_one(uint base, uint bit, uint count, uint inverted) {
  [[dont_unroll]] while (count > 0u) {
    uint step = min(count, 32u);
    count -= step;
    uint word = bits_at(base, bit + count) ^ inverted;
    if (step < 32u) word &= (1u << step) - 1u;
    if (word != 0u) return int(count) + findMSB(word);
  }
  return -1;
}

// --- clusters ---
struct Cluster {
  uint base; // word of the payload
  uint triangle_count, strip_count, flags;
  ivec3 origin;
  uint position_bit, stride;
  uvec3 widths;
  uint up;
  float scale;
  uint mask;
};
Cluster read_cluster(uint number) {
  uvec4 a = clusters[2u * number], b = clusters[2u * number + 1u];
  Cluster c;
  c.base = a.x;
  c.origin = ivec3(a.yzw);
  c.position_bit = b.x & 0xffffu;
  c.widths = uvec3((b.x >> 16) & 255u, b.x >> 24, b.y & 255u);
  c.stride = c.widths.x + c.widths.y + c.widths.z;
  c.up = (b.y >> 8) & 255u;
  c.scale = uintBitsToFloat((127u - ((b.y >> 16) & 255u)) << 23);
  c.triangle_count = b.y >> 24;
  c.strip_count = b.z & 255u;
  c.flags = b.z >> 8;
  c.mask = b.w;
  return c;
}
uint index_bits(Cluster c) { return (c.flags >> kIndexBitsShift) & 15u; }

// A vertex in the tree's grid.
vec3 position(Cluster c, uint vertex) {
  if (kAnyExactVertices && (c.flags & kExactVertices) != 0u) {
    uint at = 3u * (uint(c.origin.x) + vertex);
    return vec3(exact_vertices[at], exact_vertices[at + 1u], exact_vertices[at + 2u]);
  }
  uint bit = c.position_bit + vertex * c.stride, at = c.base + (bit >> 5), shift = bit & 31u;
  uint w0 = words[at], w1 = words[at + 1u], w2 = words[at + 2u];
  uint64_t fields = (uint64_t(funnel(w1, w2, shift)) << 32) | uint64_t(funnel(w0, w1, shift));
  uvec3 f;
  f.x = bitfieldExtract(uint(fields), 0, int(c.widths.x));
  f.y = bitfieldExtract(uint(fields >> c.widths.x), 0, int(c.widths.y));
  f.z = bitfieldExtract(uint(fields >> (c.widths.x + c.widths.y)), 0, int(c.widths.z));
  return vec3(c.origin + ivec3(f << c.up)) * c.scale;
}

// Walks a cluster's strips from one triangle on.
struct Walk {
  uint restarts, lefts, fresh_word; // of the run, from bit 0 on
  uint fresh_bits;                  // how many of fresh_word are left
  uint corner, rank;                // of the next corner in the list
};
uint corner_number(Cluster c, uint corner, uint rank, bool fresh) {
  if (fresh) return rank;
  uint width = index_bits(c);
  uint bit = 3u * c.triangle_count + 2u * c.strip_count + (corner - rank) * width;
  return bitfieldExtract(bits_at(c.base, bit), 0, int(width));
}
// The number of a corner that lies before `corner`, whose rank is known.
uint earlier_number(Cluster c, uint at, uint corner, uint rank) {
  uint fresh_bit = 2u * c.triangle_count;
  uint before = rank - count_ones(c.base, fresh_bit + at, corner - at);
  return corner_number(c, at, before, (bits_at(c.base, fresh_bit + at) & 1u) != 0u);
}
// Begins a leaf of at most 16 triangles. lead: the first two corners where the run starts within a strip.
Walk begin_walk(Cluster c, uint first, out uvec2 lead) {
  Walk w;
  w.restarts = bits_at(c.base, first);
  w.lefts = bits_at(c.base, c.triangle_count + first);
  w.corner = first + 2u * count_ones(c.base, 0u, first);
  w.rank = count_ones(c.base, 2u * c.triangle_count, w.corner);
  lead = uvec2(0u);
  if ((w.restarts & 1u) == 0u) {
    uint strip = uint(last_one(c.base, 0u, first + 1u, 0u));
    bool left = (w.lefts & 1u) != 0u;
    int turn = last_one(c.base, c.triangle_count + strip + 1u, first - strip, left ? 0xffffffffu : 0u);
    uint first_corner = w.corner - (first - strip);
    uint kept = turn >= 0 ? first_corner + uint(turn) : first_corner - (left ? 2u : 1u);
    uint a = earlier_number(c, kept, w.corner, w.rank), b = earlier_number(c, w.corner - 1u, w.corner, w.rank);
    lead = left ? uvec2(a, b) : uvec2(b, a);
  }
  w.fresh_word = 0u;
  w.fresh_bits = 0u;
  return w;
}
uint next_number(Cluster c, inout Walk w) {
  if (w.fresh_bits == 0u) {
    w.fresh_word = bits_at(c.base, 2u * c.triangle_count + w.corner);
    w.fresh_bits = 32u;
  }
  bool fresh = (w.fresh_word & 1u) != 0u;
  uint number = corner_number(c, w.corner, w.rank, fresh);
  w.fresh_word >>= 1;
  --w.fresh_bits;
  ++w.corner;
  w.rank += fresh ? 1u : 0u;
  return number;
}

// The numbers of a triangle's vertices.
uvec3 triangle_vertices(Cluster c, uint triangle) {
  uvec2 lead;
  Walk w = begin_walk(c, triangle, lead);
  if ((w.restarts & 1u) != 0u) {
    lead.x = next_number(c, w);
    lead.y = next_number(c, w);
  }
  return uvec3(lead, next_number(c, w));
}
