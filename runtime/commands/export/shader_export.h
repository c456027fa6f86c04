#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "compress/exchange/shader/shader_text.h"
#include "pbrt_import/base/progress.h"
#include "runtime/commands/bake/proxy_options.h"
#include "runtime/commands/cli/cli_support.h"

namespace packtrace {

/// The options of `export` for .glsl files.
struct ShaderOptions {
  ProxyOptions proxy;
  std::optional<std::string> geometry; ///< name or number; unset: the only one with a proxy, or the only one
  std::optional<std::string> form;     ///< shadertoy unless set
  std::optional<uint32_t> max_elements;
  std::optional<std::string> up;
  std::optional<std::string> texture;      ///< of a .ptk file: name or number
  std::optional<std::string> image_format; ///< of kTexelFormatNames; r2g4b2 unless set
  std::optional<uint32_t> image_size;      ///< texels along the longest side

  std::vector<std::string> voxel_names() const; ///< given options that apply to voxels only
  std::vector<std::string> image_names() const; ///< given options that apply to images only
  /// Names of all given options.
  std::vector<std::string> names() const;
  ShaderConfig config() const; ///< throws Error(kUsage) for a limit of 0 elements
};

/// A shader and its reports.
struct ShaderExport {
  std::vector<std::byte> bytes;
  nlohmann::json json;
  std::string text;
  std::vector<std::string> warnings; ///< about the input
};

void add_shader_options(CLI::App& verb, ShaderOptions& options);

/// Makes a shader of the voxels of a .ptk file, of one of its textures or of an image file. A stored proxy is used
/// unless options choose another grid. Throws Error(kUsage) for unknown geometries and textures and options without
/// effect, Error(kLimitExceeded), with the largest grid or image that fits, for shaders with too many array elements,
/// Error(kInput) for damaged images.
ShaderExport export_shader(const std::string& input, const std::string& output, const ShaderOptions& options,
                           const MemoryBudget& budget, Progress& progress);

} // namespace packtrace
