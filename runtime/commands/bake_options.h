#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compress/bake/bake_config.h"
#include "runtime/commands/loaded_scene.h"

namespace packtrace {

inline constexpr const char *kAuto = "auto", *kNoTextures = "none";
inline constexpr std::array<const char*, baked::kPurposeCount> kPurposes{"ao", "shading"};
inline constexpr const char* kKeepNormals = "normals";
inline constexpr const char* kKeepUvs = "uv";
inline constexpr std::array<const char*, 3> kLodUses{"off", "instanced", "all"}; // indexed by LodUse
inline constexpr const char* kLodDefaultValue = kLodUses[2];                     // meaning of --lod without a value

inline constexpr std::array<const char*, 3> kPresets{"smallest", "balanced", "exact"};

/// Options of bake as given on the command line.
struct BakeOptions {
  std::string input, output;
  std::optional<double> precision, precision_abs, precision_edge;
  std::optional<uint32_t> position_bits;
  std::optional<std::string> normals; ///< auto unless set
  std::optional<double> normal_error;
  std::string purpose = kPurposes[baked::kAo];
  std::vector<std::string> keep;
  std::string uvs = kAuto;
  std::optional<std::string> textures; ///< if not set, the purpose decides
  std::optional<double> texture_psnr;
  std::optional<std::string> trees; ///< on unless set
  std::string lod = kLodUses[0];
  std::optional<uint32_t> lod_min_triangles, lod_levels;
  std::string resume;
  std::optional<std::string> codec; ///< none unless set
  SceneOptions scene;
  bool dry_run = false;
  std::string preset;               ///< empty, or one of kPresets
  std::vector<std::string> targets; ///< limits that a search must keep, see parse_target()
};

/// Throws Error(kUsage) for values out of range and options that exclude each other.
BakeConfig make_config(const BakeOptions& options);

/// Whether an option chooses the position grid.
bool chooses_grid(const BakeOptions& options);

/// Sets what the preset says and the user did not.
void apply_preset(BakeOptions& options);

} // namespace packtrace
