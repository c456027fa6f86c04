#pragma once

#include <cstddef>
#include <cstdint>

#include "compress/format/layout/packed_node.h"

/// What the traversal kernels read and write. Plain data: kernels are compiled once per instruction set, so nothing
/// here may bring inline functions along that the linker could take from the wrong one.
namespace packtrace::packed {

/// Triangles that are decoded and tested at once.
inline constexpr uint32_t kBatch = 8;
/// Corners of a batch's strips at most; a leaf with more is decoded in several batches.
inline constexpr uint32_t kBatchCorners = 16;

// TraceCluster::flags
inline constexpr uint8_t kSeenByCamera = baked::kCameraBelow;
inline constexpr uint8_t kOccludes = baked::kOcclusionBelow;
inline constexpr uint8_t kMasked = baked::kMaskedLeaves;
inline constexpr uint8_t kWide = 1u << 3;       ///< only KernelScene::decode_wide reads its vertices
inline constexpr uint32_t kIndexBitsShift = 4u; ///< above: bits of an explicit vertex number, 0..8

/// A cluster as kernels read it: what follows from its record and its geometry's, worked out once.
struct TraceCluster {
  const uint8_t* bits;      ///< strips
  int32_t base[3];          ///< of the fields' zero, in 2^-down tree steps
  uint16_t position_bit;    ///< where the positions begin
  uint8_t position_bits[3]; ///< their sum is at most 57
  uint8_t up, down;         ///< tree coordinate = (base + field 2^up) / 2^down; one of the two is 0
  uint8_t triangle_count;
  uint8_t restart_count;
  uint8_t flags;
  uint8_t reserved[2];
};
static_assert(sizeof(TraceCluster) == 32);

/// Up to kBatch triangles of a cluster, decoded. Lanes from count on hold anything finite.
struct alignas(64) DecodedBatch {
  uint64_t tag; ///< see batch_tag()
  uint32_t count;
  uint32_t padding[5];
  float vertex[3][3][kBatch]; ///< [axis][corner][triangle], coordinates of the tree
};
static_assert(sizeof(DecodedBatch) == 320);

/// Decoded batches that were needed lately: each has one place where it may lie.
struct BatchCache {
  DecodedBatch* entries;
  uint32_t hash_shift; ///< 32 - log2(number of entries)
};

// Rays that go through the tree over placements together (placement_stream.h).
inline constexpr uint32_t kStreamRays = 4096; ///< at most
inline constexpr uint32_t kLeastStream = 512;
inline constexpr uint32_t kStreamGroups = kStreamRays / 64 + 7; ///< of 64, by octant
inline constexpr size_t kStreamGroupBytes = 4224, kStreamPartBytes = 16, kStreamAlignment = 64;

/// What a thread keeps.
struct ThreadMemory {
  BatchCache batches;
  void* stream; ///< room for a tree of the scene's depth, aligned to kStreamAlignment; null: groups are traced alone
};

struct TraceTree {
  const baked::PackedNode* nodes; ///< root first
  float max_coordinate;           ///< of the root's box, and of the vertices in it
};

/// Where a tree lies.
struct TracePlacement {
  double grid_from_unit[12]; ///< four columns of three
  double box_lo[3];          ///< of the tree, in its grid
  double box_hi[3];
  uint32_t tree;
  uint16_t ray_classes;
  uint16_t aligned; ///< 1: the grid's axes are those of unit space, all else in the first three columns is 0
};

/// Of the tree over placements. Children: kTopLeaf + placement, or a node after this one.
struct alignas(64) TopNode {
  float lo[3][baked::kNodeWidth]; ///< unit space, rounded outwards; anything where there is no child
  float hi[3][baked::kNodeWidth];
  uint32_t child[baked::kNodeWidth];
  uint32_t slots; ///< in use, as bits
};
inline constexpr uint32_t kTopLeaf = 1u << 31;
inline constexpr uint32_t kMaxTopDepth = 64;

/// What the kernels count if they are asked to.
struct KernelCounters {
  uint64_t rays = 0, placements = 0; ///< placements: entered, each ray its own
  uint64_t nodes = 0, node_rays = 0; ///< nodes visited by groups, and by each ray in them
  uint64_t leaves = 0, leaf_rays = 0;
  uint64_t triangles = 0; ///< tested against a ray each
  uint64_t batches_decoded = 0, exact_triangles = 0;
};

/// RayTracer's Ray with the same layout and without inline functions. Kernels read arrays of Ray through it, which
/// may_alias makes well defined.
struct [[gnu::may_alias]] KernelRay {
  float origin[3];
  float tnear;
  float direction[3];
  float tfar;
};

/// Rays on their way through one placed tree, for something else than its inner nodes to find the leaf nodes they
/// reach.
struct TreeSearch {
  static constexpr uint32_t kMaxRays = 64;

  uint32_t tree;
  uint32_t any; ///< 1: any hit will do, 0: the nearest is wanted
  uint32_t count;
  uint32_t number[kMaxRays]; ///< of each ray below, in the words of visit()
  KernelRay
      rays[kMaxRays]; ///< in the tree's grid; reach 2^-22 of the largest coordinate, theirs or the tree's, farther
  const float (*limits)[2]; ///< by number: the second is the negated tfar of now
  void* traversal;
  /// Tests the leaves of nodes of the tree against rays, given as bits; returns those that still look for a hit.
  uint64_t (*visit)(const TreeSearch& search, const uint32_t* nodes, uint32_t node_count, uint64_t rays);
};

/// Of the largest coordinate: 6 M kSmallestDirection, over kBoxPad.
inline constexpr float kLeastTopPad = 0x1p-57f;

struct KernelScene {
  const TraceCluster* clusters; ///< by number in the cluster section
  const TraceTree* trees;
  const TracePlacement* placements;
  const TopNode* top_nodes; ///< null: placement 0 is all there is
  uint32_t placement_count;
  TracePlacement top;       ///< of top_nodes, whose grid is unit space
  float top_max_coordinate; ///< of the boxes in top_nodes
  /// M of kBoxPad there. Over more than eight placements it is kLeastTopPad of the largest coordinate, and the boxes
  /// themselves are larger by 2^-20 of their planes' coordinates, the planes' share of the roundings: else one
  /// placement far away would make all rays near the origin enter all others.
  float top_pad_coordinate;
  /// Decodes triangles of a kWide cluster; returns how many.
  uint32_t (*decode_wide)(const void* owner, uint32_t cluster, uint32_t first, uint32_t count, DecodedBatch& out);
  /// Whether a masked triangle is there.
  bool (*present)(const void* owner, uint32_t placement, uint32_t cluster, uint32_t triangle, float u, float v,
                  uint32_t ray_class);
  const void* owner;
  /// Not null: visits the leaf nodes that rays may reach, more than that if it likes, in the place of inner nodes.
  void (*search_tree)(const void* searcher, const TreeSearch& search);
  const void* searcher;
  /// By placement: boxes around parts of its tree, for rays to be tested against before they are moved into its grid;
  /// null: they are not.
  const TopNode* parts;
};

/// RayTracer's RayHit likewise.
struct [[gnu::may_alias]] KernelHit {
  float t, u, v;
  uint32_t placement, cluster, triangle;
};

/// One instruction set's functions.
struct Kernels {
  const char* isa;
  void (*closest)(const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, size_t count,
                  uint32_t ray_class, KernelHit* hits, KernelCounters* counters);
  void (*any)(const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, size_t count, uint32_t ray_class,
              uint8_t* occluded, KernelCounters* counters);
  /// For tests: decodes up to kBatch triangles and returns how many.
  uint32_t (*decode)(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out);
};

extern const Kernels kScalarKernels;
#if defined(__x86_64__)
extern const Kernels kAvx2Kernels;
extern const Kernels kAvx512Kernels;
#endif

} // namespace packtrace::packed
