#version 460
#extension GL_GOOGLE_include_directive : require
// Counts the occlusion rays that hit something, for each point. Rays are made here.
// CLOSEST: instead sums the visibility and the distance of the nearest hits, as occlusion_nearest.comp does.
//
// A thread walks a ray's nodes and puts the leaves it reaches into its subgroup's queue. Once that is long enough, or no
// ray goes on, the subgroup's lanes set up a leaf each, then decode a corner each, then test a pair of ray and triangle
// each. Leaves stay in registers and are shuffled, and so do the rays of a single placement. With many placements a ray
// steps through the tree over them as through a placed tree, so that rays in both share their instructions.
// Subgroups have 4 to 32 lanes, and nodes numbers below 2^24. No cluster is masked.
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#ifdef PARTITIONED
#extension GL_NV_shader_subgroup_partitioned : require
#endif
#define FROM_SURFACES
#include "traversal.glsl"
#include "points.glsl"
#include "leaves.glsl"
#ifdef CLOSEST
#include "visibility.glsl"
#else
layout(std430, binding = 10) buffer Counts { uint counts[]; }; // the last word: 1 if some ray was not traced
#endif

const uint kGroup = 64u, kPlaces = 2u; // threads; places of the queue per lane
// Decoded corners per lane. A leaf has up to 48: lanes times this must be at least that.
layout(constant_id = 9) const uint kCorners = 8u;

layout(local_size_x = 64) in;

shared uint s_queue[kGroup * kPlaces];     // node << 8 | lane << 3 | slot
shared uint s_corner[kGroup * kCorners * 3]; // floats; before there are any: which lane has a leaf
#ifdef CLOSEST
shared uint s_nearest[kGroup]; // by thread: ordered() t of the nearest hit of the current flush
const uint kNoHit = 0xffffffffu;
#else
shared uint s_hit[kGroup / 4u]; // by subgroup: bits of the rays that hit something
#endif

#define S gl_SubgroupSize
#define LANE gl_SubgroupInvocationID

void sync_shared() {
  subgroupMemoryBarrierShared();
  subgroupBarrier();
}
// Number of bits up to and including the lane's.
uint through_lane(uint mask) { return bitCount(mask & (0xffffffffu >> (31u - LANE))); }

// The n-th bit that is set, from 0.
uint nth_bit(uint mask, uint n) {
  uint at = 0u, c = bitCount(mask & 0xffffu);
  if (n >= c) { n -= c; at = 16u; mask >>= 16; }
  c = bitCount(mask & 0xffu);
  if (n >= c) { n -= c; at += 8u; mask >>= 8; }
  c = bitCount(mask & 0xfu);
  if (n >= c) { n -= c; at += 4u; mask >>= 4; }
  c = bitCount(mask & 3u);
  if (n >= c) { n -= c; at += 2u; mask >>= 2; }
  return at + (n >= (mask & 1u) ? 1u : 0u);
}

#include "ray_steps.glsl"

// --- pairs ---
Corner shared_corner(GridRay p, uint at) { // at: of the first float
  uint kx = p.major, ky = kx == 2u ? 0u : kx + 1u, kz = kx == 0u ? 2u : kx - 1u;
  return make_corner(p, vec3(uintBitsToFloat(s_corner[at + kx]), uintBitsToFloat(s_corner[at + ky]),
                             uintBitsToFloat(s_corner[at + kz])));
}

#ifdef CLOSEST
// Maps a float to an unsigned integer so that the order is kept.
uint ordered(float t) {
  uint bits = floatBitsToUint(t);
  return bits ^ ((bits & 0x80000000u) != 0u ? 0xffffffffu : 0x80000000u);
}
float from_ordered(uint word) {
  return uintBitsToFloat(word ^ ((word & 0x80000000u) != 0u ? 0x80000000u : 0xffffffffu));
}

// Shortens the ray to the nearest hit of a flush. Returns false if there is none, or an earlier hit is nearer.
bool take_nearest(uint word, inout UnitRay u, Way way, inout GridRay r) {
  if (word == kNoHit) return false;
  precise double unit = (double(from_ordered(word)) + r.t_begin) * r.t_scale; // monotonic in t
  float unit_t = float(unit);
  if (unit_t > u.tmax) return false;
  u.tmax = unit_t;
  shorten(u, way, r);
  return true;
}
#endif

// Tests up to S leaves of the queue from e0 on.
void flush_leaves(GridRay r, uint tree_flags, uint e0, uint total) {
  const uint thread0 = gl_SubgroupID * S, queue0 = thread0 * kPlaces, corner0 = thread0 * kCorners * 3u;
  const uint capacity = S * kCorners;
  bool have = e0 + LANE < total;
  uint entry = have ? s_queue[queue0 + e0 + LANE] : 0xffffffffu;
  uint key = entry & ~0xf8u, ray = (entry >> 3) & 31u;
  // Lanes with the same leaf: it is decoded once.
#ifdef PARTITIONED
  uint leader = uint(findLSB(subgroupPartitionNV(key).x));
#else
  uint h = corner0 + ((key * 0x9e3779b1u) >> 16) % (2u * S);
  atomicExchange(s_corner[h], LANE); // a plain store may be forwarded to the load below
  sync_shared();
  uint w = atomicOr(s_corner[h], 0u), leader = subgroupShuffle(key, w) == key ? w : LANE;
  sync_shared();
#endif
  uint leaders = subgroupBallot(have && leader == LANE).x, leaves = bitCount(leaders);
  uint leaf = subgroupShuffle(entry, nth_bit(leaders, min(LANE, leaves - 1u)));
  uint mine = bitCount(leaders & ((1u << leader) - 1u));
  Leaf e = Leaf(0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
  bool leads = LANE < leaves;
  if (leads) e = set_up(leaf >> 8, leaf & 7u);
  uint end_m = subgroupInclusiveAdd(e.corner_count), start_m = end_m - e.corner_count;
  uint my_turns = subgroupShuffle(e.turns, mine);
  uint my_start = subgroupShuffle(start_m | (e.corner_count << 16) | (e.triangle_count << 24), mine);
  uint my_n = have ? my_start >> 24 : 0u, my_end = (my_start & 0xffffu) + ((my_start >> 16) & 255u);
  my_start &= 0xffffu;
  uint done = 0u, at = 0u;
  while (at < leaves) {
    // Leaves up to the capacity for corners.
    bool lead_in = leads && LANE >= at && end_m - done <= capacity;
    uint batch = bitCount(subgroupBallot(lead_in).x);
    if (batch == 0u) break; // a leaf is larger than kCorners allows
    uint all_m = subgroupShuffle(end_m, at + batch - 1u) - done, from = start_m - done;
    for (uint k0 = 0u; k0 < all_m; k0 += S) {
      uint mark = subgroupOr(lead_in && from - k0 < S ? 1u << (from - k0) : 0u);
      uint owner = at + bitCount(subgroupBallot(lead_in && from < k0).x) + through_lane(mark) - 1u, k = k0 + LANE;
      uint o_cluster = subgroupShuffle(e.cluster, owner), o_ranks = subgroupShuffle(e.ranks, owner),
           o_leads = subgroupShuffle(e.leads, owner), o_lo = subgroupShuffle(e.lo, owner),
           o_hi = subgroupShuffle(e.hi, owner), o_from = subgroupShuffle(from, owner);
      if (k < all_m) {
        uvec3 v = floatBitsToUint(leaf_corner(o_cluster, o_ranks, o_leads, o_lo, o_hi, k - o_from));
        uint q = corner0 + 3u * k;
        s_corner[q] = v.x;
        s_corner[q + 1u] = v.y;
        s_corner[q + 2u] = v.z;
      }
    }
    sync_shared();
    bool in_batch = my_n != 0u && my_start >= done && my_end - done <= capacity;
    uint n = in_batch ? my_n : 0u, end_n = subgroupInclusiveAdd(n), n_from = end_n - n;
    uint all_n = subgroupShuffle(end_n, S - 1u), entries = subgroupBallot(in_batch).x;
    uint e_pair = n_from | ((my_start - done) << 10) | (ray << 20), nth = LANE;
    bool gaps = (entries & (entries + 1u)) != 0u;
    if (gaps) nth = nth_bit(entries, LANE);
    for (uint k0 = 0u; k0 < all_n; k0 += S) {
      uint mark = subgroupOr(in_batch && n_from - k0 < S ? 1u << (n_from - k0) : 0u);
      uint owner = bitCount(subgroupBallot(in_batch && n_from < k0).x) + through_lane(mark) - 1u, k = k0 + LANE;
      if (gaps) owner = subgroupShuffle(nth, owner);
      uint pair = subgroupShuffle(e_pair, owner), turns = subgroupShuffle(my_turns, owner), lane = (pair >> 20) & 31u;
      GridRay p = ray_for_tests(r, lane);
      uint flags = kAnyFine ? subgroupShuffle(tree_flags, lane) : 0u;
      if (k < all_n) {
        uvec3 q = triangle_corners(turns, (pair >> 10) & 1023u, k - (pair & 1023u));
        TriangleHit hit;
        if (test_triangle(p, shared_corner(p, corner0 + 3u * q.x), shared_corner(p, corner0 + 3u * q.y),
                          shared_corner(p, corner0 + 3u * q.z), flags, hit))
#ifdef CLOSEST
          atomicMin(s_nearest[thread0 + lane], ordered(hit.t));
#else
          atomicOr(s_hit[gl_SubgroupID], 1u << lane);
#endif
      }
    }
    sync_shared();
    done += all_m;
    at += batch;
  }
}

void main() {
  const uint room = S * kPlaces, queue0 = gl_SubgroupID * room;
  uint item = gl_WorkGroupID.x * kGroup + gl_SubgroupID * S + LANE;
  uint units = (push.point_count + 31u) / 32u, unit = item >> 5, slice = unit / units;
  uint in_part = (unit % units) * 32u + (item & 31u), number = push.first_point + in_part;
  uint slices = (push.sample_count + push.per_thread - 1u) / push.per_thread;
  bool valid = slice < slices && in_part < push.point_count;
  valid = valid && points[valid ? number : 0u].pixel != kNoPoint;
  uint s = push.first_sample + slice * push.per_thread;
  uint end = push.first_sample + min((slice + 1u) * push.per_thread, push.sample_count);
#ifdef CLOSEST
  bool struck = false; // the ray has a hit
  s_nearest[gl_SubgroupID * S + LANE] = kNoHit;
#else
  uint occluded = 0u;
  if (LANE == 0u) s_hit[gl_SubgroupID] = 0u;
#endif
  // pending: some leaf of the ray is in the queue. held: leaves of a node for which the queue had no room.
  bool alive = valid && s < end, tracing = false, pending = false;
  uint count = 0u, held = 0u, held_node = 0u;
  UnitRay u;
  GridRay r;
  Way way;
  sync_shared();
  for (uint guard = 0u; guard < 1000000u; ++guard) { // so that a mistake does not hang the device
    bool ended = false, hit = false, full = false;
    // A ray each for lanes that have none, once enough have none.
    uint idle = bitCount(subgroupBallot(alive && !tracing && !pending).x);
    if (idle != 0u && (idle >= push.idle_lanes || !subgroupAny(tracing || pending))) {
      if (alive && !tracing && !pending) {
        Point point = read_point(number); // again for each ray: it would take twelve registers all the way
        u = unit_ray(point.origin, sample_direction(point, s), 0.0, push.tfar);
        tracing = push.tfar > 0.0 && begin_way(u, way, r);
        ended = !tracing;
#ifdef CLOSEST
        struck = false;
#endif
      }
    }
    if (!subgroupAny(tracing || pending || ended)) break;
    bool walking;
    do {
      walking = tracing && held == 0u && way.next == kNoPlacement;
      // A ray's queued leaves are tested in the grid of its placement, so it enters the next one only after the tests.
      bool entering = kManyPlacements && tracing && way.next != kNoPlacement && !pending;
      bool enters = kManyPlacements && // what most lanes can do; the others wait
                    bitCount(subgroupBallot(entering).x) > bitCount(subgroupBallot(walking).x);
      if (enters) {
        if (entering) {
          enter_placement(u, way.next, way, r);
          way.next = kNoPlacement;
        }
      } else if (walking) {
        if (kManyPlacements && way.in_tree && way.group == 0u && way.size == way.base) {
          way.in_tree = false;
          way.base = 0u;
          restore_top(r);
        }
        if (way.group == 0u) {
          if (way.size == way.base) {
            tracing = false;
            ended = !pending;
          } else {
            --way.size;
            way.first = stack[way.size].x;
            way.group = stack[way.size].y;
          }
        }
        if (way.group != 0u) held = step(r, way, held_node);
      }
      // A leaf of each lane in turn.
      for (uint b = subgroupBallot(held != 0u).x; b != 0u && !full;) {
        uint to = count + through_lane(b) - 1u;
        if (held != 0u && to < room) {
          s_queue[queue0 + to] = (held_node << 8) | (LANE << 3) | uint(findLSB(held));
          held &= held - 1u;
          pending = true;
        }
        count = min(count + bitCount(b), room);
        b = subgroupBallot(held != 0u).x;
        full = count == room && b != 0u;
      }
      walking = tracing && held == 0u && !(kManyPlacements && way.next != kNoPlacement && pending);
    } while (count < S && !full && subgroupAny(walking) &&
             (push.idle_lanes >= S || bitCount(subgroupBallot(ended && s + 1u < end).x) < push.idle_lanes));
    if (count != 0u && (full || count >= S || !subgroupAny(walking))) {
      sync_shared();
      // Whole subgroups of leaves; the rest waits where rays go on.
      uint ending = subgroupAny(walking) && count >= S ? count - count % S : count;
      for (uint e = 0u; e < ending; e += S) flush_leaves(r, way.tree_flags, e, count);
      uint rest = count - ending, entry = 0u;
      bool mine = false, stays = LANE < rest; // mine: the lane's ray is done; stays: its queue entry is still needed
      if (stays) entry = s_queue[queue0 + ending + LANE];
#ifdef CLOSEST
      if (pending) {
        uint nearest = s_nearest[gl_SubgroupID * S + LANE];
        s_nearest[gl_SubgroupID * S + LANE] = kNoHit;
        if (take_nearest(nearest, u, way, r)) struck = true;
      }
#else
      uint found = s_hit[gl_SubgroupID];
      mine = (tracing || pending) && ((found >> LANE) & 1u) != 0u;
      hit = mine;
      stays = stays && ((found >> ((entry >> 3) & 31u)) & 1u) == 0u;
#endif
      uint staying = subgroupBallot(stays).x, waiting = subgroupOr(stays ? 1u << ((entry >> 3) & 31u) : 0u);
      sync_shared();
      if (stays) s_queue[queue0 + through_lane(staying) - 1u] = entry;
#ifndef CLOSEST
      if (LANE == 0u) s_hit[gl_SubgroupID] = 0u;
#endif
      count = bitCount(staying);
      sync_shared();
      bool waits = ((waiting >> LANE) & 1u) != 0u;
      if (mine || (pending && !tracing && !waits)) {
        ended = true;
        tracing = false;
        held = 0u;
      }
      pending = waits;
    }
    if (ended) {
#ifdef CLOSEST
      add_sample(number, struck, u.tmax);
#else
      occluded += hit ? 1u : 0u;
#endif
      ++s;
      alive = s < end;
    }
  }
#ifdef CLOSEST
  if (alive || tracing || pending) sums[sums.length() - 1] = 1.0lf;
#else
  if (alive || tracing || pending) atomicMax(counts[counts.length() - 1], 1u);
  if (valid && occluded != 0u) atomicAdd(counts[number], occluded);
#endif
}
