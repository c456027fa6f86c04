#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "compress/bake/bake_config.h"
#include "runtime/commands/bake/proxy_options.h"
#include "runtime/commands/cli/loaded_scene.h"

namespace packtrace {

inline constexpr std::array<const char*, 3> kPresets{"smallest", "balanced", "exact"};

/// Value of --sequence for the meshes that a glTF file's animation deforms.
inline constexpr std::string_view kAnimationSequence = "animation";

/// The options of `bake`.
struct BakeOptions {
  std::vector<std::string> inputs;    ///< a pbrt scene, or mesh files that make one
  std::string input, output;          ///< input: the first of `inputs`
  BakeConfig config;                  ///< its precision; make_config() adds the rest
  std::optional<std::string> normals; ///< auto unless set
  std::optional<double> normal_error;
  std::string purpose = "ao";
  std::vector<std::string> keep;
  std::string uvs = "auto";
  std::optional<std::string> textures; ///< if not set, the purpose decides
  std::optional<double> texture_psnr;
  std::optional<std::string> trees; ///< on unless set
  std::string lod = "off";
  std::optional<uint32_t> lod_min_triangles, lod_levels;
  std::string resume;
  std::optional<std::string> codec;   ///< none unless set
  std::optional<std::string> motion;  ///< keep unless set
  std::string keys;                   ///< file of keys; empty: none
  std::string distance_levels;        ///< file of level chains; empty: none
  std::vector<std::string> sequences; ///< patterns of PLY files, see FramePattern
  std::optional<double> sequence_fps;
  std::optional<int64_t> sequence_start;
  std::optional<uint32_t> sequence_group;
  ProxyOptions proxy;
  SceneOptions scene;
  bool dry_run = false;
  std::string preset;                ///< empty, or one of kPresets
  std::vector<std::string> targets;  ///< limits that a search must keep, see parse_target()
  std::optional<std::string> camera; ///< of the pictures that a search compares; as of render
};

/// Adds all options of `bake` to the verb. `options` must outlive it.
void add_bake_options(CLI::App& verb, BakeOptions& options);

/// Whether an option chooses the position grid.
bool chooses_grid(const BakeOptions& options);

/// Applies the preset to options that the user did not give.
void apply_preset(BakeOptions& options);

/// Throws Error(kUsage) for values out of range and contradictory options.
BakeConfig make_config(const BakeOptions& options);

} // namespace packtrace
