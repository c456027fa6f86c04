#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "compress/bake/proxies/proxy_config.h"

namespace packtrace {

/// The proxy options of `bake`.
struct ProxyOptions {
  std::optional<std::string> proxy; ///< off unless set
  std::optional<uint32_t> voxels;
  std::optional<std::string> rule;
  std::optional<uint32_t> field_bits;
  bool fill = false, dag = false, materials = false;

  /// Names of the given options.
  std::vector<std::string> names() const;
};

void add_proxy_options(CLI::App& verb, ProxyOptions& options);

/// Throws Error(kUsage) for values out of range and contradictory options.
ProxyConfig make_proxy_config(const ProxyOptions& options);

} // namespace packtrace
