#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// Why a part of a geometry carries a stream or not; its triangles may differ in normals only (see normals).
struct PartNeeds {
  /// kAbsent, kUnused: none. kForShading: but for triangles whose normals are the face's, which are found later.
  /// kOnRequest: all.
  baked::Reason normals = baked::kAbsent;
  baked::Reason uvs = baked::kAbsent;
  baked::Reason tangents = baked::kAbsent; ///< the format has no encoding for them yet: a decision without effect

  bool store_normals() const { return is_needed(normals); }
  bool store_uvs() const { return is_needed(uvs); }

private:
  static bool is_needed(baked::Reason reason) { return reason > baked::kInferred; }
};

struct GeometryNeeds {
  std::vector<PartNeeds> parts;          ///< as in the plan
  std::array<int32_t, 2> uv_exponent{};  ///< 0 where no part needs uvs
  std::array<double, 2> texels_per_uv{}; ///< of the finest mask or texture that is stored
  bool infer_normals = true;             ///< store none of triangles whose normals are the face's
};

/// Textures of unknown size are taken to have this many texels along u and v where they ask for texture coordinates.
inline constexpr uint32_t kAssumedTexels = 4096;

/// Decides which streams a geometry needs, from the flags of all materials that its instances give to its parts:
/// - normals: where the camera can see the surface;
/// - uvs: where an alpha mask looks them up; for shading also where a normal map does, or a texture: one that is
///   stored, or any if none are, as it may come from elsewhere;
/// - tangents: for shading, where a normal map needs them;
/// and whatever config.keep asks for. Throws Error(kInput) if a material's mask or stored texture does not exist.
GeometryNeeds analyse_requirements(const Scene& scene, const ScenePlan& scene_plan, const GeometryPlan& plan,
                                   const BakeConfig& config);

} // namespace packtrace
