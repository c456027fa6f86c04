#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/language/parameters.h"
#include "pbrt_import/scene/math.h"
#include "pbrt_import/text/reporter.h"

namespace packtrace {

/// A texture of an MTL material: st = uv * scale + offset.
struct MtlMap {
  std::filesystem::path file; ///< empty: none
  Place place;
  Vec2 scale{1.0f}, offset{0.0f};
  bool clamp = false;
};

/// A material of an MTL file.
struct MtlMaterial {
  std::string name;
  Place place;
  std::optional<Vec3> diffuse;    ///< Kd
  Vec3 specular{0.0f};            ///< Ks
  Vec3 emission{0.0f};            ///< Ke
  float shininess = 0.0f;         ///< Ns, exponent of a Phong lobe
  float opacity = 1.0f;           ///< d, or 1 - Tr
  float refraction = 1.5f;        ///< Ni
  int illumination = 2;           ///< illum
  std::optional<float> roughness; ///< Pr, of the physically based extension
  std::optional<float> metallic;  ///< Pm
  MtlMap diffuse_map, opacity_map, normal_map;
};

/// Reads the materials of an MTL file. Problems are reported; statements that do not matter for occlusion or simple
/// shading are skipped.
/// @param text the file, followed by kScannerReach zeros
/// @param file number of the file in SourceFiles
/// @param folder to which the names of its textures are relative
/// Sources: Wavefront, MTL material format (Lightscape), 1995; Exocortex, Extending Wavefront MTL for Physically-Based
/// Materials, 2013.
std::vector<MtlMaterial> read_mtl(std::string_view text, uint32_t file, const std::filesystem::path& folder,
                                  Reporter& reporter);

/// Path of a file named by an OBJ or MTL file, relative to its folder. Backslashes are separators if no file has the
/// name as written.
std::filesystem::path resolve_named_file(std::string_view name, const std::filesystem::path& folder);

} // namespace packtrace
