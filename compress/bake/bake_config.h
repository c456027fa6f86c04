#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "compress/bake/clusters/repeated_clusters.h"
#include "compress/bake/level_chain.h"
#include "compress/bake/proxies/proxy_config.h"
#include "compress/format/cluster/normal_codec.h"
#include "compress/format/cluster/uv_codec.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/pages/page_codec.h"
#include "compress/format/textures/texture_codec.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/mesh_sequence.h"

namespace packtrace {

/// Meaning of BakeConfig::precision. All world-space geometry shares one step; each instanced geometry has its own.
/// Below, "the geometry" is either all geometry outside objects together, or one instanced geometry.
enum class PrecisionKind : uint32_t {
  kEdgeFraction = 0,     ///< step <= precision x the geometry's median edge length; 1e-9 <= precision <= 1
  kDiagonalFraction = 1, ///< step <= precision x the diagonal of the geometry's bounds; 1e-12 <= precision <= 0.1
  kAbsolute = 2,         ///< world-space error per axis <= precision / 2, in world units; any positive float
  kPositionBits = 3,     ///< step <= longest side of the bounds / (2^precision - 1); whole numbers 1..40
  /// Like kEdgeFraction, with finer steps where images need them. Seen at 320 x 180 pixels from the scene's cameras and
  /// from a camera that frames the scene, ambient occlusion differs by at most 0.005 on average and 0.05 at 99 % of the
  /// pixels, and at most 0.1 % of the pixels change between hit and miss (docs/accuracy.md). Files record
  /// kEdgeFraction.
  kPicture = 4,
};

/// Selects the geometries that get LOD levels (docs/cluster_lod.md).
enum class LodUse : uint32_t {
  kOff,
  kInstanced, ///< geometries with more than one instance
  kAll
};

/// Surfaces look rough if the step exceeds this fraction of the median edge.
inline constexpr double kRoughEdge = 1.0 / 8.0;

/// Default step as a fraction of the median edge. Positions move by at most 1/256 of a typical edge per axis, and face
/// normals of typical triangles tilt by less than 0.5 degrees.
inline constexpr double kDefaultEdgeFraction = 1.0 / 128.0;

/// Degrees. axis24 stays within this error for every direction; it changes shading by less than 0.001.
inline constexpr double kDefaultNormalError = 0.04;

/// Largest normal errors allowed in one geometry.
struct NormalLimits {
  /// Largest angle between a source normal and its decoded normal. On grids coarser than the default, a vertex may take
  /// the normal of another one that rounds to the same point, which adds at most the encoding's own error.
  double error_degrees = kDefaultNormalError;
  /// A triangle stores no normals if all three are within this angle of its decoded face normal or of the opposite.
  double flat_degrees = kDefaultNormalError;
};

/// All options of a bake.
struct BakeConfig {
  PrecisionKind precision_kind = PrecisionKind::kPicture;
  double precision = kDefaultEdgeFraction;

  /// Normal encoding of every geometry. If unset, each geometry gets the one with the fewest bits, of axis12, axis16,
  /// oct20, axis24 and axis32, whose largest error, measured over its own normals, is within normal_limits().
  std::optional<NormalEncoding> normals;
  /// Largest allowed angle for the automatic choice of an encoding, 0.0025..10 degrees. If unset, normal_limits()
  /// derives it from the step. Ignored if `normals` is set.
  std::optional<double> normal_error_degrees;

  /// Error limits for one geometry's normals. A requested encoding or error is used as it is. Otherwise the limit grows
  /// with the step, in proportion to the tilt that the step causes over a typical edge:
  /// kDefaultNormalError * max(1, atan(step_per_edge) / atan(kDefaultEdgeFraction)).
  /// @param step_per_edge the grid's step divided by a typical edge of the geometry; infinite if that edge is 0
  NormalLimits normal_limits(double step_per_edge) const;

  /// Intended use of the file. Streams that it does not need are left out.
  baked::Purpose purpose = baked::kAo;
  bool keep_normals = false; ///< keep the normals of every triangle whose source has them
  bool keep_uvs = false;     ///< keep the UVs of every mesh that has them

  bool strict = false; ///< fail instead of leaving out shapes and instances that exceed the float range

  /// UV encoding of every geometry. If unset, UVs use a lattice whose step follows from the sizes of the textures that
  /// they look up.
  std::optional<UvEncoding> uvs;

  /// Whether to store the materials' textures. Requires purpose kShading.
  bool textures = false;
  /// Codec of every texture. If unset, each texture gets the smallest codec whose PSNR is at least min_texture_psnr_db.
  std::optional<TextureCodec> texture_codec;
  /// PSNR of the sRGB-encoded values, 10..100 dB. Ignored if texture_codec is set.
  double min_texture_psnr_db = 34.0;

  /// Compression of pages on disk. Decoded data do not depend on it.
  PageCodec codec = PageCodec::kNone;
  /// Which clusters are cut alike, as codecs fast and small store once what these have in common. It changes clusters
  /// and trees, but not the surface.
  RepeatedClusters repeated_clusters = RepeatedClusters::kNone;
  /// Sets the codec and the repeated_clusters that give it the smallest files.
  void choose_codec(PageCodec chosen) {
    codec = chosen;
    repeated_clusters = chosen == PageCodec::kFast    ? RepeatedClusters::kMost
                        : chosen == PageCodec::kSmall ? RepeatedClusters::kMany
                                                      : RepeatedClusters::kNone;
  }

  bool trees = true; ///< store trees over the clusters; otherwise they are built before tracing

  ProxyConfig proxy; ///< proxies of far or small instances

  LodUse lod = LodUse::kOff;
  uint32_t lod_min_triangles = 128; ///< geometries with fewer triangles get no LOD levels
  uint32_t lod_levels = 31;         ///< most LOD levels besides the source level; 1..31

  /// Meshes of the scene that move, each at most once. Geometries with such a mesh get no LOD levels.
  std::vector<MeshSequence> sequences;
  /// Frames per group of a sequence, 1..64. A frame is decoded from the begin of its group on: more frames per group
  /// take fewer bytes, but longer to reach.
  uint32_t sequence_group = 8;

  /// Objects that replace each other by distance; an object belongs to one chain at most. Geometries of
  /// chains are stored even if no instance uses them.
  std::vector<LevelChain> level_chains;

  /// Folder for finished LOD levels, so that an interrupted bake can reuse them when it is started again. bake_scene()
  /// removes them when it is done. Empty: no levels are kept. Does not change the file.
  std::filesystem::path resume;

  /// Memory limit for quantised geometry, clusters, LOD levels and the file. Does not change the file.
  MemoryBudget memory = MemoryBudget();

  /// Throws Error(kUsage) if a value is out of its range. Values are never clamped.
  void validate() const;
};

} // namespace packtrace
