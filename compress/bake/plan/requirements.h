#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// Why a part of a geometry stores each stream or not. Triangles of one part may differ in whether they store normals.
struct PartNeeds {
  /// kAbsent, kUnused: no triangle stores normals. kForShading: all triangles do, except those whose normals equal the
  /// face normal, which are found later. kOnRequest: all triangles do.
  baked::Reason normals = baked::kAbsent;
  baked::Reason uvs = baked::kAbsent;
  baked::Reason tangents = baked::kAbsent; ///< informative only: the format has no encoding for tangents yet

  bool store_normals() const { return is_needed(normals); }
  bool store_uvs() const { return is_needed(uvs); }

private:
  static bool is_needed(baked::Reason reason) { return reason > baked::kInferred; }
};

/// Which streams a geometry needs, and how precisely.
struct GeometryNeeds {
  std::vector<PartNeeds> parts;          ///< in the order of the plan's parts
  std::array<int32_t, 2> uv_exponent{};  ///< 0 if no part needs UVs
  std::array<double, 2> texels_per_uv{}; ///< of the finest mask or texture that is stored
  bool infer_normals = true;             ///< leave out normals of triangles whose normals equal the face normal
};

/// Assumed size in texels along u and v of textures of unknown size that need texture coordinates.
inline constexpr uint32_t kAssumedTexels = 4096;

/// Decides which streams a geometry needs, from the flags of all materials that its instances assign to its parts:
/// - normals: if the camera can see the surface;
/// - UVs: if an alpha mask looks them up. For shading also if a normal map does, or a texture: one that is stored, or
///   any texture if none are stored, as it may be supplied elsewhere;
/// - tangents: for shading, if a normal map needs them;
/// and the streams that config.keep_normals and config.keep_uvs request.
/// Throws Error(kInput) if a material's mask or stored texture does not exist.
GeometryNeeds analyse_requirements(const Scene& scene, const ScenePlan& scene_plan, const GeometryPlan& plan,
                                   const BakeConfig& config);

} // namespace packtrace
