#include "runtime/commands/bake/proxy_options.h"

#include "compress/format/voxels/voxel_set.h"
#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

constexpr const char *kNoProxy = "off", *kVoxelsName = "voxels", *kFieldName = "sdf";
constexpr const char *kConservativeName = "conservative", *kThinName = "thin", *kMatchedName = "matched";

} // namespace

void add_proxy_options(CLI::App& verb, ProxyOptions& options) {
  constexpr const char* kGroup = "Proxies";
  verb.add_option(
          "--proxy", options.proxy,
          "Store a stand-in for each instanced geometry, or for each geometry if none is instanced. voxels: one "
          "bit where the surface passes, in a tree that any voxel can be read from. sdf: distances to the surface "
          "near it (default off)")
      ->check(one_of({kNoProxy, kVoxelsName, kFieldName}))
      ->group(kGroup);
  verb.add_option("--proxy-voxels", options.voxels,
                  "Voxels along the longest side of a geometry's bounds, 1..4096 (default 64)")
      ->type_name("N")
      ->group(kGroup);
  verb.add_option("--proxy-surface", options.rule,
                  "Which voxels are set. conservative: all that the surface touches; thin: fewer, without holes that a "
                  "path through faces could pass; matched: as many, from the inside outwards, as hide what the "
                  "triangles hide, for render --proxy-beyond (default conservative)")
      ->check(one_of({kConservativeName, kThinName, kMatchedName}))
      ->group(kGroup);
  verb.add_option("--proxy-bits", options.field_bits, "Bits of a distance with --proxy sdf, 8 or 16 (default 8)")
      ->check(CLI::IsMember({8u, 16u}))
      ->type_name("N")
      ->group(kGroup);
  verb.add_flag("--proxy-fill", options.fill,
                "Also set the voxels inside closed geometries, which takes fewer bits; open ones are reported")
      ->group(kGroup);
  verb.add_flag("--proxy-dag", options.dag, "Store equal parts of the tree once where that takes fewer bits")
      ->group(kGroup);
  verb.add_flag("--proxy-materials", options.materials,
                "Store the colour of the material of each voxel, from a palette of at most 256; not with --proxy-dag")
      ->group(kGroup);
}

std::vector<std::string> ProxyOptions::names() const {
  std::vector<std::string> names;
  if (proxy) names.push_back("--proxy");
  if (voxels) names.push_back("--proxy-voxels");
  if (rule) names.push_back("--proxy-surface");
  if (field_bits) names.push_back("--proxy-bits");
  if (fill) names.push_back("--proxy-fill");
  if (dag) names.push_back("--proxy-dag");
  if (materials) names.push_back("--proxy-materials");
  return names;
}

ProxyConfig make_proxy_config(const ProxyOptions& options) {
  ProxyConfig config;
  if (options.proxy.value_or(kNoProxy) == kNoProxy) {
    std::vector<std::string> names = options.names();
    std::erase(names, "--proxy");
    if (!names.empty()) throw Error(ErrorKind::kUsage, names.front() + " requires --proxy voxels or sdf");
    return config;
  }
  config.use = options.proxy == kFieldName ? ProxyUse::kField : ProxyUse::kVoxels;
  if (config.use == ProxyUse::kField && (options.rule || options.fill || options.dag || options.materials))
    throw Error(ErrorKind::kUsage,
                "--proxy-surface, --proxy-fill, --proxy-dag and --proxy-materials require --proxy voxels");
  if (config.use == ProxyUse::kVoxels && options.field_bits)
    throw Error(ErrorKind::kUsage, "--proxy-bits requires --proxy sdf");
  config.field_bits = options.field_bits.value_or(config.field_bits);
  config.voxels = options.voxels.value_or(config.voxels);
  if (config.voxels < 1 || config.voxels > kMaxGridSize)
    throw Error(ErrorKind::kUsage,
                "--proxy-voxels must be 1 to " + std::to_string(kMaxGridSize) + ", the largest grid");
  if (options.rule == kThinName) config.rule = VoxelRule::kSeparating;
  if (options.rule == kMatchedName) config.rule = VoxelRule::kMatched;
  if (config.rule == VoxelRule::kMatched && options.fill)
    throw Error(ErrorKind::kUsage,
                "--proxy-fill has no effect with --proxy-surface matched, which fills closed geometries");
  config.fill = options.fill, config.dag = options.dag, config.materials = options.materials;
  if (config.dag && config.materials)
    throw Error(ErrorKind::kUsage, "--proxy-dag and --proxy-materials exclude each other: equal parts of the tree may "
                                   "have other materials");
  return config;
}

} // namespace packtrace
