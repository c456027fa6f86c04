#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "compress/bake/geometry_plan.h"

namespace packtrace {

/// Which streams a part of a geometry carries.
struct PartNeeds {
  bool normals = false; ///< the mesh has them; flat triangles are found later, triangle by triangle
  bool uvs = false;     ///< the material looks into a mask or texture that is stored
};

struct GeometryNeeds {
  std::vector<PartNeeds> parts;          ///< as in the plan
  std::array<int32_t, 2> uv_exponent{};  ///< 0 where no part needs uvs
  std::array<double, 2> texels_per_uv{}; ///< of the finest mask or texture that is stored
};

/// One reason why data of the source is not in the file.
struct DroppedStream {
  std::string stream; ///< "texture coordinates", "normals"
  std::string reason;
  uint64_t source_bytes = 0; ///< what it takes in the source
  bool operator==(const DroppedStream&) const = default;
};

/// Decides the streams of one geometry. Throws Error(kInput) if a material's mask or texture does not exist.
/// @param textures whether textures are stored
GeometryNeeds analyse_requirements(const Scene& scene, const GeometryPlan& plan, bool textures);

/// Source bytes of texture coordinates that no stored material looks up.
uint64_t unneeded_uv_bytes(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs);

} // namespace packtrace
