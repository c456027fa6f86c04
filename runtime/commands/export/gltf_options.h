#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "compress/exchange/gltf/gltf_config.h"

namespace packtrace {

/// The options of `export` for glTF files.
struct GltfOptions {
  std::optional<std::string> profile; ///< exchange unless set
  std::optional<std::string> codec;   ///< that of the profile unless set
  std::optional<int> level, normal_bits, uv_bits;
  std::optional<double> webp_psnr;
  bool instancing = false, levels = false;

  std::vector<std::string> names() const; ///< of all given options
  std::string profile_name() const;
  /// The profile's settings with those that the options replace. Throws Error(kUsage) for options that have no effect
  /// on the codec, and for values that it does not allow.
  GltfConfig config() const;
};

/// The name of a codec, as --codec takes it.
std::string name_of(GltfCodec codec);

void add_gltf_options(CLI::App& verb, GltfOptions& options);

} // namespace packtrace
