#include "compress/bake/proxies/build_proxies.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "compress/bake/proxies/geometry_field.h"
#include "compress/bake/proxies/geometry_voxels.h"
#include "compress/bake/proxies/occluding_triangles.h"
#include "compress/format/deformation/deformation_view.h"
#include "compress/format/file/baked_image.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

uint32_t srgb8(float linear) {
  const double c = std::clamp(static_cast<double>(linear), 0.0, 1.0);
  const double encoded = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1.0 / 2.4) - 0.055;
  return static_cast<uint32_t>(std::lround(255.0 * encoded));
}

/// A palette of the albedos of a geometry's slots, and each slot's swatch.
struct Palette {
  std::vector<uint32_t> colors;
  std::vector<uint8_t> swatch_of_slot;

  Palette(const BakedFile& file, const baked::GeometryRecord& geometry, uint32_t run, const std::string& name) {
    for (uint32_t slot = 0; slot < geometry.slot_count; ++slot) {
      const auto& albedo = file.sections().materials[file.sections().material_slots[run + slot]].albedo;
      const uint32_t color = srgb8(albedo[0]) | srgb8(albedo[1]) << 8 | srgb8(albedo[2]) << 16;
      const auto found = std::ranges::find(colors, color);
      if (found == colors.end() && colors.size() == voxels::kMaxSwatches)
        throw Error(ErrorKind::kLimitExceeded, "voxels of " + name + ": more than 256 colours of materials");
      swatch_of_slot.push_back(static_cast<uint8_t>(found - colors.begin()));
      if (found == colors.end()) colors.push_back(color);
    }
  }
};

/// None if alpha masks leave no voxel.
std::optional<Proxy> build_voxels(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs,
                                  const OccludingTriangles& source, const ProxyConfig& config,
                                  const MemoryBudget& budget) {
  const baked::GeometryRecord& record = file.geometries()[geometry];
  const std::string name(file.text(record.name));
  const GeometryVoxels voxels = voxelize(file, runs, source, config, budget, name);
  if (voxels.set.count() == 0) return std::nullopt;
  Proxy proxy;
  OccupancyOptions options;
  options.dag = config.dag;
  std::vector<uint8_t> swatches;
  if (config.materials) {
    Palette palette(file, record, runs.front(), name);
    for (const uint32_t slot : voxels.slots) swatches.push_back(palette.swatch_of_slot[slot]);
    proxy.palette = std::move(palette.colors);
    options.swatches = swatches, options.palette_count = static_cast<uint32_t>(proxy.palette.size());
  }
  proxy.voxels = encode_occupancy(voxels.set, options);
  const DVec3 origin = voxels.frame.origin;
  proxy.record = {geometry,
                  voxels::kVoxelProxy,
                  (source.closed ? voxels::kClosedSource : 0) | (voxels.filled ? voxels::kFilled : 0) |
                      (config.rule == VoxelRule::kSeparating ? voxels::kThin : 0) |
                      (config.rule == VoxelRule::kMatched ? voxels::kMatched : 0),
                  0,
                  {origin.x, origin.y, origin.z},
                  voxels.frame.edge,
                  voxels.surface_error,
                  voxels.voxel_error,
                  0};
  return proxy;
}

/// Errors of a field are those of its quantisation: its distances are exact.
Proxy build_distances(const BakedFile& file, uint32_t geometry, const OccludingTriangles& source,
                      const ProxyConfig& config, const MemoryBudget& budget) {
  const std::string name(file.text(file.geometries()[geometry].name));
  GeometryField built = build_field(source, config, budget, name);
  Proxy proxy;
  proxy.field = std::move(built.field);
  const double error = proxy.field.quantum() * built.edge;
  proxy.record = {geometry,
                  voxels::kFieldProxy,
                  (source.closed ? voxels::kClosedSource : 0) | (built.has_sign ? voxels::kSigned : 0),
                  0,
                  {built.origin.x, built.origin.y, built.origin.z},
                  built.edge,
                  error,
                  error,
                  0};
  return proxy;
}

std::optional<Proxy> build_any(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs,
                               const ProxyConfig& config, const MemoryBudget& budget,
                               const OccludingTriangles& source) {
  if (source.triangles.empty()) return std::nullopt;
  return config.use == ProxyUse::kField ? build_distances(file, geometry, source, config, budget)
                                        : build_voxels(file, geometry, runs, source, config, budget);
}

} // namespace

std::vector<Proxy> build_proxies(const BakedFile& file, const ProxyConfig& config, const MemoryBudget& budget,
                                 Progress& progress, const std::function<void(std::string)>& warn) {
  const uint32_t count = file.base_geometry_count();
  const auto world_space = [&](uint32_t g) { return (file.geometries()[g].flags & baked::kWorldSpace) != 0; };
  bool instanced = false;
  for (uint32_t g = 0; g < count; ++g) instanced |= !world_space(g) && file.geometries()[g].cluster_count > 0;
  const std::vector<std::vector<uint32_t>> runs = material_runs(file.sections());
  std::vector<Proxy> proxies;
  uint64_t open = 0, empty = 0;
  progress.begin("building proxies", count);
  for (uint32_t g = 0; g < count; ++g) {
    progress.check_cancelled();
    progress.advance();
    if (instanced && world_space(g)) continue;
    const OccludingTriangles source = occluding_triangles(file, g, runs[g]);
    std::optional<Proxy> proxy = build_any(file, g, runs[g], config, budget, source);
    if (!proxy) {
      ++empty;
      continue;
    }
    open += config.fill && !source.closed;
    proxies.push_back(std::move(*proxy));
  }
  if (open > 0)
    warn(std::to_string(open) + " of " + std::to_string(proxies.size()) +
         " geometries are not closed; their voxels are not filled");
  if (empty > 0)
    warn(std::to_string(empty) + (empty == 1 ? " geometry has nothing that occludes and gets no proxy"
                                             : " geometries have nothing that occludes and get no proxy"));
  return proxies;
}

std::optional<Proxy> build_proxy(const BakedFile& file, uint32_t geometry, const ProxyConfig& config,
                                 const MemoryBudget& budget) {
  const std::vector<uint32_t> runs = material_runs(file.sections())[geometry];
  if (runs.empty()) return std::nullopt;
  return build_any(file, geometry, runs, config, budget, occluding_triangles(file, geometry, runs));
}

std::vector<std::byte> with_proxies(const BakedFile& file, std::span<const Proxy> proxies) {
  BakedSections sections = file.sections();
  baked::SummaryRecord summary = sections.summary.front();
  summary.purpose |= voxels::kHasProxies;
  sections.summary = {&summary, 1};
  const std::vector<uint8_t> stream = encode_proxies(proxies);
  std::vector<uint8_t> tail(sections.shading.begin(), sections.shading.end());
  tail.insert(tail.end(), stream.begin(), stream.end());
  const uint64_t bytes = stream.size();
  const auto* const first = reinterpret_cast<const uint8_t*>(&bytes);
  tail.insert(tail.end(), first, first + sizeof bytes);
  sections.shading = tail;
  return assemble_baked_file(sections);
}

} // namespace packtrace
