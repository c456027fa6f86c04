// A ray's way through the scene in steps of one node, for kernels whose lanes do other work between steps. With many
// placements the tree over them is walked by the same instructions as their trees; what the other ray needs lies in
// shared memory meanwhile. The kernel defines kGroup, S and LANE.

const uint kNoPlacement = 0xffffffffu;
const uint kRootParent = 0xffffffffu; // of the root of the tree over placements

// With many placements: rays as triangle tests need them, by word, then by thread: origin, shear, begin, end, major; for
// nearest hits, also rest.
#ifdef CLOSEST
const uint kTestWords = kManyPlacements ? 12u * kGroup : 1u;
#else
const uint kTestWords = kManyPlacements ? 9u * kGroup : 1u;
#endif
shared uint s_test[kTestWords];
// The ray in unit space, for box tests of the tree over placements: inverse, near_bias, far_bias, begin, end.
const uint kTopWords = kManyPlacements ? 11u * kGroup : 1u;
shared float s_top[kTopWords];

void save_for_tests(GridRay r) {
  if (!kManyPlacements) return; // a lane's ray stays in the grid of the only placement
  uint at = gl_SubgroupID * S + LANE;
  [[unroll]] for (uint i = 0u; i < 3u; ++i) {
    s_test[i * kGroup + at] = floatBitsToUint(r.origin[i]);
    s_test[(3u + i) * kGroup + at] = floatBitsToUint(r.shear[i]);
  }
  s_test[6u * kGroup + at] = floatBitsToUint(r.begin);
  s_test[7u * kGroup + at] = floatBitsToUint(r.end);
  s_test[8u * kGroup + at] = r.major;
#ifdef CLOSEST
  [[unroll]] for (uint i = 0u; i < 3u; ++i) s_test[(9u + i) * kGroup + at] = floatBitsToUint(r.rest[i]);
#endif
}
// The ray of another lane in the grid of its placement; all lanes together.
GridRay ray_for_tests(GridRay own, uint lane) {
  GridRay r = own;
  r.rest = vec3(0.0);
  if (kManyPlacements) {
    uint at = gl_SubgroupID * S + lane;
    [[unroll]] for (uint i = 0u; i < 3u; ++i) {
      r.origin[i] = uintBitsToFloat(s_test[i * kGroup + at]);
      r.shear[i] = uintBitsToFloat(s_test[(3u + i) * kGroup + at]);
    }
    r.begin = uintBitsToFloat(s_test[6u * kGroup + at]);
    r.end = uintBitsToFloat(s_test[7u * kGroup + at]);
    r.major = s_test[8u * kGroup + at];
#ifdef CLOSEST
    [[unroll]] for (uint i = 0u; i < 3u; ++i) r.rest[i] = uintBitsToFloat(s_test[(9u + i) * kGroup + at]);
#endif
  } else {
    r.origin = subgroupShuffle(own.origin, lane);
    r.begin = kMayBeFar ? subgroupShuffle(own.begin, lane) : 0.0;
    r.end = subgroupShuffle(own.end, lane);
    r.shear = subgroupShuffle(own.shear, lane);
    r.major = subgroupShuffle(own.major, lane);
#ifdef CLOSEST
    r.rest = subgroupShuffle(own.rest, lane);
#endif
  }
  return r;
}
void save_top(GridRay r) {
  uint at = gl_SubgroupID * S + LANE;
  [[unroll]] for (uint i = 0u; i < 3u; ++i) {
    s_top[i * kGroup + at] = r.inverse[i];
    s_top[(3u + i) * kGroup + at] = r.near_bias[i];
    s_top[(6u + i) * kGroup + at] = r.far_bias[i];
  }
  s_top[9u * kGroup + at] = r.begin;
  s_top[10u * kGroup + at] = r.end;
}
void restore_top(inout GridRay r) {
  uint at = gl_SubgroupID * S + LANE;
  [[unroll]] for (uint i = 0u; i < 3u; ++i) {
    r.inverse[i] = s_top[i * kGroup + at];
    r.near_bias[i] = s_top[(3u + i) * kGroup + at];
    r.far_bias[i] = s_top[(6u + i) * kGroup + at];
  }
  r.begin = s_top[9u * kGroup + at];
  r.end = s_top[10u * kGroup + at];
}

// --- a ray's way through the scene, which may stop at any node ---
struct Way {
  bool in_tree;             // of a placement
  uint first, group, size;  // nodes that are left; stack entries
  uint base;                // stack entries of the tree over placements
  uint next;                // placement to enter; kNoPlacement: none
  uint tree_first, tree_flags;
};

// Takes the ray into the grid of a placement and to the root of its tree, if it may hit something there.
bool enter_placement(UnitRay u, uint placement, inout Way way, inout GridRay r) {
  if ((placements[placement].classes_aligned & kOcclusionClass) == 0u) return false;
  TreeRecord tree = trees[placements[placement].tree];
  float pad = (kAnyGraded && (tree.flags & kGraded) != 0u ? kGradedPad : 1.0) * tree.max_coordinate;
  // Without the copy below, NVIDIA's compiler allots 123 instead of 96 registers to the kernel of a single placement. With
  // many placements, a copy makes the kernel 3 % slower.
  if (kManyPlacements) {
    if (!enter(u, placement, tree.max_coordinate, pad, kMinDirection, r)) {
      restore_top(r);
      return false;
    }
  } else {
    GridRay entered;
    if (!enter(u, placement, tree.max_coordinate, pad, kMinDirection, entered)) return false;
    r = entered;
  }
  save_for_tests(r);
  if (way.group != 0u) stack[way.size++] = uvec2(way.first, way.group);
  way.in_tree = true;
  way.base = way.size;
  way.tree_first = way.first = tree.first_node;
  way.tree_flags = tree.flags;
  way.group = kRootGroup;
  return true;
}

// Whether a ray starts so far from the tree over placements that entering it needs doubles.
bool starts_far_from_all(UnitRay u) {
  vec3 size = abs(u.origin);
  return max(max(size.x, size.y), size.z) > kFar * scene.top_max_coordinate;
}

// Prepares a ray in unit space for box tests of the tree over placements. Returns false if the ray misses the tree.
bool enter_top(UnitRay u, inout GridRay r) {
  if (starts_far_from_all(u))
    return enter(u, scene.placement_count, scene.top_max_coordinate, scene.top_pad_coordinate, kMinTopDirection, r);
  r.begin = u.tnear;
  r.end = u.tmax;
  set_boxes(u.origin, u.direction, scene.top_pad_coordinate, kMinTopDirection, r);
  return true;
}

#ifdef CLOSEST
// Ends box tests of the ray at u.tmax, in the grid of the current placement and in the tree over placements.
void shorten(UnitRay u, Way way, inout GridRay r) {
  float end = grid_t(r, u.tmax);
  if (!kManyPlacements) {
    r.end = end;
    return;
  }
  uint at = gl_SubgroupID * S + LANE;
  s_test[7u * kGroup + at] = floatBitsToUint(end);
  bool far = starts_far_from_all(u); // their end in the tree over placements is not updated, which is conservative
  if (!far) s_top[10u * kGroup + at] = u.tmax;
  if (way.in_tree)
    r.end = end;
  else if (!far)
    r.end = u.tmax;
}
#endif

// Returns whether the ray may hit something.
bool begin_way(UnitRay u, out Way way, inout GridRay r) {
  way = Way(false, kRootParent, 0u, 0u, 0u, kNoPlacement, 0u, 0u);
  if (scene.placement_count == 0u) return false;
  if (!kManyPlacements) return enter_placement(u, 0u, way, r);
  way.group = kRootGroup;
  if (!enter_top(u, r)) return false;
  save_top(r);
  return true;
}

// Visits the next node. Returns the leaves whose boxes the ray passes, as a bit mask, and their node.
uint step(GridRay r, inout Way way, out uint node) {
  uint slot = take_slot(way.group);
  node = way.first + slot;
  bool top = kManyPlacements && !way.in_tree;
  if (top) {
    node = way.first == kRootParent ? 0u : top_child(way.first, slot);
    if ((node & kTopLeaf) != 0u) {
      way.next = node & ~kTopLeaf;
      return 0u;
    }
  }
  Node n;
  if (top)
    n = read_top_node(node);
  else
    n = read_node(node);
  if (((n.n0.w >> 16) & kOcclusionClass) == 0u) return 0u;
  float t[8];
  uint mask = pass_boxes(r, n, top, kAnyGraded && !top && (way.tree_flags & kGraded) != 0u, t);
  if (mask == 0u) return 0u;
  if ((n.n1.z & 255u) != kInnerChild) return mask;
  if (way.group != 0u) stack[way.size++] = uvec2(way.first, way.group);
  way.first = top ? node : way.tree_first + n.n1.x;
  way.group = group_of(mask, t);
  return 0u;
}
