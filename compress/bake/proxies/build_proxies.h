#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compress/bake/proxies/proxy_config.h"
#include "compress/format/file/baked_file.h"
#include "compress/format/voxels/proxy_codec.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Builds the proxies of a file's instanced geometries, or of all geometries if none is instanced. Geometries in which
/// nothing occludes, and those that deform, get none.
/// @param warn is called for each option that could not be applied
/// Throws like voxelize() and encode_occupancy(), and Error(kLimitExceeded) for more than 256 materials of a geometry.
std::vector<Proxy> build_proxies(const BakedFile& file, const ProxyConfig& config, const MemoryBudget& budget,
                                 Progress& progress, const std::function<void(std::string)>& warn);

/// Builds the proxy of one geometry; nullopt if it has no occluding triangle. Throws like build_proxies().
std::optional<Proxy> build_proxy(const BakedFile& file, uint32_t geometry, const ProxyConfig& config,
                                 const MemoryBudget& budget);

/// The file with these proxies.
/// @param file without proxies
std::vector<std::byte> with_proxies(const BakedFile& file, std::span<const Proxy> proxies);

} // namespace packtrace
