#pragma once

#include <cstddef>
#include <cstdint>

#include "compress/format/layout/packed_node.h"

/// Types that the traversal kernels read and write. They are plain data: kernels are compiled once per instruction set,
/// and an inline function in this header could be linked from an object file that uses the wrong one.
namespace packtrace::packed {

/// Maximum number of triangles in a batch; a batch is decoded and tested at once.
inline constexpr uint32_t kBatch = 8;
/// Maximum number of corners in a batch's strips; a leaf with more is decoded in several batches.
inline constexpr uint32_t kBatchCorners = 16;

// TraceCluster::flags
inline constexpr uint8_t kMasked = baked::kMaskedLeaves;
inline constexpr uint8_t kNeedsWideDecode = 1u << 3; ///< its vertices can be read by KernelScene::decode_wide only
inline constexpr uint32_t kIndexBitsShift = 4u;      ///< from this bit on: bits per explicit vertex number, 0..8

/// A cluster as the kernels read it; computed once from its record and its geometry's.
struct TraceCluster {
  const uint8_t* bits;      ///< the cluster's bit stream, which begins with its strips
  int32_t base[3];          ///< position of field value 0, in units of 2^-down grid steps of the tree
  uint16_t position_bit;    ///< first bit of the positions in `bits`
  uint8_t position_bits[3]; ///< field widths along x, y, z; their sum is at most 57
  uint8_t up, down;         ///< tree coordinate = (base + field 2^up) / 2^down; one of the two is 0
  uint8_t triangle_count;
  uint8_t strip_count;
  uint8_t flags;
  uint8_t reserved[2];
};
static_assert(sizeof(TraceCluster) == 32);

/// Up to kBatch decoded triangles of a cluster. Lanes from `count` on hold arbitrary finite values.
struct alignas(64) DecodedBatch {
  uint64_t tag; ///< identifies the cluster and first triangle; 0: empty
  uint32_t count;
  uint32_t padding[5];
  float vertex[3][3][kBatch]; ///< [axis][corner][triangle], in the tree's grid
};
static_assert(sizeof(DecodedBatch) == 320);

/// Direct-mapped cache of decoded batches.
struct BatchCache {
  DecodedBatch* entries;
  uint32_t hash_shift; ///< 32 - log2(number of entries)
};

// Sizes for rays that traverse the tree over placements together (placement_stream.h).
inline constexpr uint32_t kStreamRays = 4096; ///< maximum number of rays per portion
inline constexpr uint32_t kMinStreamRays = 512;
inline constexpr uint32_t kStreamGroups = kStreamRays / 64 + 7; ///< groups of up to 64 rays of one octant
inline constexpr size_t kStreamGroupBytes = 4224, kStreamPartBytes = 16, kStreamAlignment = 64;

/// Per-thread working memory of the kernels.
struct ThreadMemory {
  BatchCache batches;
  /// Memory for a PlacementStream through the scene's tree over placements, aligned to kStreamAlignment. Null: each
  /// group is traced alone.
  void* stream;
};

struct TraceTree {
  const baked::PackedNode* nodes; ///< root first
  /// Largest absolute coordinate of the root's box, and so of the vertices in it; at least 1.
  float max_coordinate;
  /// How box tests allow for rounding errors. 1: each node's boxes are enlarged in proportion to the node's own largest
  /// coordinate (enlarge_boxes()). 0: rays have a pad in proportion to max_coordinate, the same at all nodes.
  uint32_t graded;
};

/// A placed tree.
struct TracePlacement {
  double grid_from_unit[12]; ///< affine transform from unit space to the tree's grid: four columns of three
  double box_lo[3];          ///< the tree's bounds, in its grid
  double box_hi[3];
  uint32_t tree;
  uint16_t ray_classes;
  uint16_t aligned; ///< 1: the transform only scales and translates, so its linear part is diagonal
};

/// A node of the tree over placements. A child is kTopLeaf + placement number, or the number of a later node.
struct alignas(64) TopNode {
  float lo[3][baked::kNodeWidth]; ///< unit space, rounded outwards; arbitrary in unused slots
  float hi[3][baked::kNodeWidth];
  uint32_t child[baked::kNodeWidth];
  uint32_t slots; ///< bit mask of the slots in use
};
inline constexpr uint32_t kTopLeaf = 1u << 31;
inline constexpr uint32_t kMaxTopDepth = 64;

/// Optional statistics of the kernels.
struct KernelCounters {
  uint64_t rays = 0, placements = 0; ///< placements: pairs of a ray and a placement that it enters
  uint64_t nodes = 0, node_rays = 0; ///< node visits by groups, and by the rays in them
  uint64_t leaves = 0, leaf_rays = 0;
  uint64_t triangles = 0; ///< pairs of a ray and a triangle tested
  uint64_t batches_decoded = 0, exact_triangles = 0;
};

/// Has the layout of RayTracer's Ray but no inline functions. Kernels read arrays of Ray through this type; may_alias
/// makes that well defined.
struct [[gnu::may_alias]] KernelRay {
  float origin[3];
  float tnear;
  float direction[3];
  float tfar;
};

/// A search for the leaf nodes that some rays of one placed tree may reach. It is handed to KernelScene::search_tree,
/// which replaces the traversal of the tree's inner nodes.
struct TreeSearch {
  static constexpr uint32_t kMaxRays = 64;

  uint32_t tree;
  uint32_t any; ///< 1: any hits; 0: nearest hits
  uint32_t count;
  uint32_t number[kMaxRays]; ///< bit of each ray below in the masks of visit()
  /// In the tree's grid. A ray may hit triangles that lie off it by up to 2^-22 of the largest coordinate of its origin
  /// and the tree.
  KernelRay rays[kMaxRays];
  const float (*limits)[2]; ///< by number[]: the second is the negated current tfar
  void* traversal;
  /// Tests the leaves of some of the tree's nodes against rays, given as a bit mask. Returns the rays that still look
  /// for a hit.
  uint64_t (*visit)(const TreeSearch& search, const uint32_t* nodes, uint32_t node_count, uint64_t rays);
};

/// top_pad_coordinate of the tree over many placements, in units of the largest coordinate M. kBoxPad times it exceeds
/// 6 M kMinDirectionComponent, by which clamping a direction component may move a ray.
inline constexpr float kMinTopPad = 0x1p-57f;

struct KernelScene {
  const TraceCluster* clusters; ///< by number in the file's cluster section
  const TraceTree* trees;
  const TracePlacement* placements;
  const TopNode* top_nodes; ///< null: placement 0 is the only one
  uint32_t placement_count;
  TracePlacement top; ///< the tree of top_nodes, whose grid is unit space
  /// Largest absolute coordinate, in unit space, of the boxes in top_nodes and of the grids of aligned placements.
  float top_max_coordinate;
  /// M of kBoxPad for the tree over placements. With more than eight placements it is kMinTopPad times the largest
  /// coordinate. Each plane of the boxes is then moved outwards by 2^-20 of its coordinate, which covers the plane's
  /// rounding errors. With a pad in proportion to the largest coordinate, a single placement far away would make every
  /// ray near the origin enter all other placements.
  float top_pad_coordinate;
  /// Decodes triangles of a cluster that is flagged kNeedsWideDecode; returns their number.
  uint32_t (*decode_wide)(const void* owner, uint32_t cluster, uint32_t first, uint32_t count, DecodedBatch& out);
  /// Whether the alpha mask of a masked triangle keeps the surface at (u, v).
  bool (*present)(const void* owner, uint32_t placement, uint32_t cluster, uint32_t triangle, float u, float v,
                  uint32_t ray_class);
  const void* owner;
  /// If not null, replaces the traversal of inner nodes: calls TreeSearch::visit for all leaf nodes that the rays may
  /// reach. It may visit more.
  void (*search_tree)(const void* searcher, const TreeSearch& search);
  const void* searcher;
  /// By placement: boxes around parts of its tree, which rays are tested against before they are transformed into the
  /// tree's grid. Null: no such test.
  const TopNode* parts;
};

/// Has the layout of RayTracer's RayHit; see KernelRay.
struct [[gnu::may_alias]] KernelHit {
  float t, u, v;
  uint32_t placement, cluster, triangle;
};

/// The kernels of one instruction set.
struct Kernels {
  const char* isa;
  void (*closest)(const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, size_t count,
                  uint32_t ray_class, KernelHit* hits, KernelCounters* counters);
  void (*any)(const KernelScene& scene, ThreadMemory& memory, const KernelRay* rays, size_t count, uint32_t ray_class,
              uint8_t* occluded, KernelCounters* counters);
  /// Decodes the vertices of a triangle of a cluster that is not flagged kNeedsWideDecode.
  /// @param vertex corner, then axis; in the tree's grid
  void (*triangle)(const TraceCluster& cluster, uint32_t triangle, float (&vertex)[3][3]);
  /// For tests: decodes up to kBatch triangles and returns their number.
  uint32_t (*decode)(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out);
};

extern const Kernels kScalarKernels;
#if defined(__x86_64__)
extern const Kernels kAvx2Kernels;
extern const Kernels kAvx512Kernels;
#endif

} // namespace packtrace::packed
