#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/progress.h"
#include "runtime/commands/cli_support.h"
#include "runtime/commands/proxy_options.h"

namespace packtrace {

/// The options of `export` for .glsl files.
struct ShaderOptions {
  ProxyOptions proxy;
  std::optional<std::string> geometry; ///< name or number; unset: the only one with a proxy, or the only one
  std::optional<std::string> form;     ///< shadertoy unless set
  std::optional<uint32_t> max_elements;
  std::optional<std::string> up;

  bool any() const {
    return proxy.proxy != "off" || geometry || form || max_elements || up || proxy.voxels || proxy.rule;
  }
};

/// A shader and its reports.
struct ShaderExport {
  std::vector<std::byte> bytes;
  nlohmann::json json;
  std::string text;
};

void add_shader_options(CLI::App& verb, ShaderOptions& options);

/// Makes a shader of a .ptk file. The stored proxy is used unless options choose another grid.
/// Throws Error(kUsage) for unknown geometries and wrong options, Error(kLimitExceeded), with the largest grid that
/// fits, for shaders with too many array elements.
ShaderExport export_shader(const std::string& input, const std::string& output, const ShaderOptions& options,
                           const MemoryBudget& budget, Progress& progress);

} // namespace packtrace
