#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "compress/format/layout/baked_format.h"
#include "compress/format/cluster/normal_codec.h"
#include "compress/format/pages/page_codec.h"
#include "compress/format/textures/texture_codec.h"
#include "compress/format/cluster/uv_codec.h"
#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// How BakeConfig::precision is meant. World-space geometry has one step for the whole scene, instanced geometry a step
/// of its own; "the geometry" below is all that lies outside objects together, or the one instanced geometry.
enum class PrecisionKind : uint32_t {
  kEdgeFraction = 0,     ///< step <= precision x the geometry's median edge length; 1e-9 <= precision <= 1
  kDiagonalFraction = 1, ///< step <= precision x the diagonal of the geometry's box; 1e-12 <= precision <= 0.1
  kAbsolute = 2,         ///< world error per axis <= precision / 2, in world units; any positive float
  kPositionBits = 3,     ///< step <= the box's longest side / (2^precision - 1); whole numbers 1..40
  /// As kEdgeFraction, and finer where pictures need it: what the cameras of the scene and the one that frames it see
  /// at 320 x 180 pixels keeps its ambient occlusion within .005 on average and .05 at 99 % of the pixels, and what
  /// they hit in all but .1 % (docs/accuracy.md). Files say kEdgeFraction.
  kPicture = 4,
};

/// Which geometries get levels of detail (docs/cluster_lod.md).
enum class LodUse : uint32_t {
  kOff,
  kInstanced, ///< those of several instances
  kAll
};

/// Steps of more than this fraction of an edge show: surfaces look rough.
inline constexpr double kRoughEdge = 1.0 / 8.0;

/// The default step as a fraction of the median edge: positions move by at most 1/256 of a typical edge per axis, face
/// normals of typical triangles by less than half a degree.
inline constexpr double kDefaultEdgeFraction = 1.0 / 128.0;

/// In degrees; what axis24 keeps for every direction. Shading from such normals differs by less than a thousandth.
inline constexpr double kDefaultNormalError = 0.04;

/// What the normals of one geometry may lose.
struct NormalLimits {
  double error_degrees = kDefaultNormalError; ///< largest angle between a normal of the source and what is decoded
  /// Triangles whose three normals are all this close to the decoded face's normal, or to its opposite, store none.
  double flat_degrees = kDefaultNormalError;
};

/// Everything a user can choose about a bake.
struct BakeConfig {
  PrecisionKind precision_kind = PrecisionKind::kPicture;
  double precision = kDefaultEdgeFraction;

  /// Of every geometry; without one, each geometry gets of axis16, oct20, axis24 and axis32 that of the fewest bits
  /// whose largest error, measured over its own normals, is within its normal_limits().
  std::optional<NormalEncoding> normals;
  /// Largest angle that a choice of encodings allows, .0025 .. 10 degrees; without one normal_limits() says it. Without
  /// meaning where `normals` is given.
  std::optional<double> normal_error_degrees;

  /// Limits for a geometry's normals. A stated encoding or error is kept as it is. Else normals lose as much beside the
  /// tilt of faces as they do at the default precision: kDefaultNormalError times the angle that a step makes over a
  /// typical edge, atan(step_per_edge), over that angle at kDefaultEdgeFraction; never less than kDefaultNormalError.
  /// @param step_per_edge the grid's step over a typical edge of the geometry; infinite where that is 0
  NormalLimits normal_limits(double step_per_edge) const;

  /// What the file is to be good for: streams that it does not need are left out.
  baked::Purpose purpose = baked::kAo;
  bool keep_normals = false; ///< of every triangle whose source has them
  bool keep_uvs = false;     ///< of every mesh that has them

  bool strict = false; ///< fail where something would be left out for leaving the range of floats

  /// Of every geometry; without one the lattice, whose step follows from the size of the textures looked up.
  std::optional<UvEncoding> uvs;

  /// Whether textures of materials are stored; for purpose kShading only.
  bool textures = false;
  /// Of every texture; without one, the smallest for each whose PSNR is at least min_texture_psnr_db.
  std::optional<TextureCodec> texture_codec;
  /// Of sRGB-encoded values. 10 .. 100; without meaning where a codec is given.
  double min_texture_psnr_db = 34.0;

  /// How the file lies on disk. Changes nothing that is decoded from it.
  PageCodec codec = PageCodec::kNone;

  bool trees = true; ///< whether the file holds trees over its clusters, or they are built when it is traced

  LodUse lod = LodUse::kOff;
  uint32_t lod_min_triangles = 128; ///< geometries of fewer get no levels
  uint32_t lod_levels = 31;         ///< above the source's, at most; 1..31

  /// A folder for finished levels of detail, which an interrupted bake finds there when it is started again;
  /// bake_scene() removes them in the end. Empty: none. Changes no byte of the file.
  std::filesystem::path resume;

  /// For the geometry on its grid, clusters, levels and the file. Changes no byte of it.
  MemoryBudget memory = MemoryBudget();

  /// Throws Error(kUsage) if a value is out of its range. Nothing is ever clamped.
  void validate() const;
};

} // namespace packtrace
