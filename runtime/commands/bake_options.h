#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "compress/bake/bake_config.h"
#include "runtime/commands/loaded_scene.h"

namespace packtrace {

/// The options of `bake`.
struct BakeOptions {
  std::string input, output;
  BakeConfig config; ///< its precision; make_config() adds the rest
  std::string normals = "auto";
  std::optional<double> normal_error;
  std::string purpose = "ao";
  std::vector<std::string> keep;
  std::string uvs = "auto";
  std::optional<std::string> textures; ///< if not set, the purpose decides
  std::optional<double> texture_psnr;
  std::string trees = "on";
  std::string lod = "off";
  std::optional<uint32_t> lod_min_triangles, lod_levels;
  std::string resume;
  std::string codec{name_of(PageCodec::kNone)};
  SceneOptions scene;
  bool dry_run = false;
};

/// Adds all options of `bake` to the verb. `options` must outlive it.
void add_bake_options(CLI::App& verb, BakeOptions& options);

/// Throws Error(kUsage) for values out of range and contradictory options.
BakeConfig make_config(const BakeOptions& options);

} // namespace packtrace
