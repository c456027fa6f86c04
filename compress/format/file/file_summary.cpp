#include "compress/format/file/file_summary.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "compress/format/deformation/deformation_view.h"
#include "compress/format/voxels/proxy_section.h"

namespace packtrace {
namespace {

StreamBytes stream_bytes(const BakedFile& file) {
  const BakedSections& s = file.sections();
  const auto whole = [](uint64_t bits) { return (bits + 7) / 8; };
  const auto& bits = s.summary.front().stream_bits;
  StreamBytes bytes;
  bytes.indices = whole(bits[0]), bytes.positions = whole(bits[1]);
  bytes.normals = whole(bits[2]), bytes.uvs = whole(bits[3]);
  const uint64_t streams = bytes.indices + bytes.positions + bytes.normals + bytes.uvs;
  bytes.payload_padding = s.payload.size() - std::min<uint64_t>(streams, s.payload.size());
  bytes.cluster_records = s.clusters.size_bytes();
  bytes.geometry_records = s.geometries.size_bytes();
  bytes.instance_records = s.instances.size_bytes();
  bytes.requirement_records = s.requirements.size_bytes();
  bytes.lod_records = s.lod_levels.size_bytes() + s.lod_groups.size_bytes() + s.lod_links.size_bytes();
  bytes.trees = s.trees.size_bytes() + s.nodes.size_bytes();
  bytes.rigid_motion = s.rigid_motion.size(), bytes.deformation = s.deformation.size();
  bytes.material_records = s.materials.size_bytes() + s.material_slots.size_bytes();
  bytes.masks = s.masks.size_bytes() + s.mask_words.size_bytes();
  bytes.textures = s.textures.size_bytes() + s.texture_bytes.size();
  bytes.cameras = s.cameras.size_bytes();
  if (file.has_shading()) {
    const ShadingBytes shading = shading_bytes(s.shading, s.materials.size());
    bytes.shading_materials = shading.materials, bytes.lights = shading.lights, bytes.environment_maps = shading.maps;
  }
  bytes.strings = s.strings.size();
  bytes.total = file.file_bytes();
  if (const size_t proxies = proxy_bytes(file).size(); proxies > 0) bytes.proxies = proxies + sizeof(uint64_t);
  bytes.header_and_alignment = bytes.total - s.payload.size() - bytes.cluster_records - bytes.geometry_records -
                               bytes.instance_records - bytes.material_records - bytes.masks - bytes.textures -
                               bytes.cameras - bytes.strings - bytes.requirement_records - bytes.lod_records -
                               bytes.trees - bytes.rigid_motion - bytes.deformation - s.shading.size() - bytes.proxies;
  return bytes;
}

void add_grid(std::vector<GridUse>& grids, const baked::GeometryRecord& g) {
  const PositionGrid grid{g.step_mantissa, g.step_exponent};
  const bool world = (g.flags & baked::kWorldSpace) != 0;
  const auto same = [&](const GridUse& use) { return use.grid == grid && use.world_space == world; };
  const auto found = std::find_if(grids.begin(), grids.end(), same);
  if (found != grids.end())
    ++found->geometries;
  else
    grids.push_back({grid, world, 1});
}

void add_normals(std::vector<NormalUse>& uses, const baked::GeometryRecord& g,
                 std::span<const baked::ClusterRecord> clusters) {
  uint64_t vertices = 0;
  for (const baked::ClusterRecord& cluster : clusters)
    if ((cluster.flags & baked::kClusterHasNormals) != 0) vertices += cluster.vertex_count;
  if (vertices == 0) return;
  const auto encoding = static_cast<NormalEncoding>(g.normal_encoding);
  auto use = std::lower_bound(uses.begin(), uses.end(), encoding,
                              [](const NormalUse& one, NormalEncoding other) { return one.encoding < other; });
  if (use == uses.end() || use->encoding != encoding) use = uses.insert(use, NormalUse{encoding});
  ++use->geometries;
  use->vertices += vertices;
  use->max_error_degrees = std::max(use->max_error_degrees, g.max_normal_error_degrees);
}

/// Texels per unit of texture coordinate, larger axis, of the finest texture or mask of a material.
double texels_per_uv(const BakedSections& s, const baked::MaterialRecord& material) {
  double most = 0.0;
  if (material.albedo_texture != baked::kNone) {
    const baked::TextureRecord& texture = s.textures[material.albedo_texture];
    most = std::max(std::abs(double{texture.uv_scale[0]}) * texture.width,
                    std::abs(double{texture.uv_scale[1]}) * texture.height);
  }
  for (const uint32_t number : {material.alpha_mask, material.shadow_alpha_mask}) {
    if (number == baked::kNone) continue;
    const baked::MaskRecord& mask = s.masks[number];
    most = std::max(
        {most, std::abs(double{mask.uv_scale[0]}) * mask.width, std::abs(double{mask.uv_scale[1]}) * mask.height});
  }
  return most;
}

/// Maximum of texels_of_slot over runs of `slots` slots whose starts ascend. Visits each slot once even if runs
/// overlap.
double finest_texture(const std::vector<double>& texels_of_slot, const std::vector<uint32_t>& runs, uint32_t slots) {
  double most = 0.0;
  uint64_t end = 0;
  for (const uint32_t run : runs) {
    for (uint64_t i = std::max<uint64_t>(run, end); i < uint64_t{run} + slots; ++i)
      most = std::max(most, texels_of_slot[static_cast<size_t>(i)]);
    end = uint64_t{run} + slots;
  }
  return most;
}

/// @param texels per unit of texture coordinate, of the finest texture that the materials of any instance use
void add_uvs(std::vector<UvUse>& uses, const baked::GeometryRecord& g, std::span<const baked::ClusterRecord> clusters,
             double texels) {
  uint64_t vertices = 0;
  for (const baked::ClusterRecord& cluster : clusters)
    if ((cluster.flags & baked::kClusterHasUvs) != 0) vertices += cluster.vertex_count;
  if (vertices == 0) return;
  const auto encoding = static_cast<UvEncoding>(g.uv_encoding);
  auto use = std::lower_bound(uses.begin(), uses.end(), encoding,
                              [](const UvUse& one, UvEncoding other) { return one.encoding < other; });
  if (use == uses.end() || use->encoding != encoding) use = uses.insert(use, UvUse{encoding});
  ++use->geometries;
  use->vertices += vertices;
  use->max_error = std::max(use->max_error, g.max_uv_error);
  use->max_error_texels = std::max(use->max_error_texels, g.max_uv_error * texels);
}

GeometryUse use_of(const BakedFile& file, uint32_t geometry, uint32_t instances) {
  const baked::GeometryRecord& g = file.geometries()[geometry];
  GeometryUse use;
  use.name = file.text(g.name);
  use.requirements = g.requirements, use.slots = g.slot_count;
  use.instances = instances, use.triangles = g.triangle_count;
  for (uint32_t c = 0; c < g.cluster_count; ++c) {
    const ClusterView view = file.cluster(geometry, c);
    const ClusterView::StreamBits bits = view.stream_bits();
    use.normal_triangles += view.has_normals() ? view.triangle_count() : 0;
    use.uv_triangles += view.has_uvs() ? view.triangle_count() : 0;
    use.normal_bits += bits.normals, use.uv_bits += bits.uvs;
  }
  return use;
}

void add_materials(FileSummary& summary, const BakedSections& s) {
  std::vector<int64_t> change(s.material_slots.size() + 1); // of the number of instances, from slot to slot
  for (const baked::InstanceRecord& instance : s.instances) {
    ++change[instance.first_slot];
    --change[instance.first_slot + s.geometries[instance.geometry].slot_count];
  }
  std::vector<uint8_t> used(s.materials.size());
  int64_t instances = 0;
  for (size_t i = 0; i < s.material_slots.size(); ++i) {
    instances += change[i];
    if (instances > 0) used[s.material_slots[i]] = 1;
  }
  for (size_t i = 0; i < used.size(); ++i)
    if (used[i] != 0) ++summary.materials_in_use, summary.material_flags |= s.materials[i].flags;
  for (const baked::GeometryRecord& g : s.geometries) summary.max_slots = std::max(summary.max_slots, g.slot_count);
}

std::vector<ProxySummary> summarize_proxies(const BakedFile& file) {
  std::vector<ProxySummary> result;
  const std::span<const uint8_t> bytes = proxy_bytes(file);
  if (bytes.empty()) return result;
  for (const Proxy& proxy : read_proxies(bytes)) {
    const voxels::ProxyRecord& r = proxy.record;
    ProxySummary use;
    use.name = file.text(file.geometries()[r.geometry].name);
    use.kind = r.kind, use.flags = r.flags;
    use.edge = r.edge, use.surface_error = r.surface_error, use.voxel_error = r.voxel_error;
    if (proxy.is_field()) {
      use.size = proxy.field.size(), use.bits = proxy.field.bits();
      use.stored_voxels = uint64_t{proxy.field.header().stored_bricks} * voxels::kBrickSamples;
    } else {
      use.size = proxy.voxels.size(), use.swatches = r.palette_count;
      use.voxels = count_occupied(proxy.voxels), use.stored_voxels = proxy.voxels.stored_voxels();
      use.bits = proxy.voxels.bits(), use.index_bits = proxy.voxels.index_bits();
    }
    result.push_back(std::move(use));
  }
  return result;
}

/// @param uses number of instances per geometry
void add_geometries(FileSummary& summary, const BakedFile& file, std::span<const uint32_t> uses) {
  const BakedSections& s = file.sections();
  std::vector<double> texels; // by material slot
  for (const uint32_t material : s.material_slots) texels.push_back(texels_per_uv(s, s.materials[material]));
  const std::vector<std::vector<uint32_t>> runs = material_runs(s);
  summary.geometries = file.base_geometry_count();
  for (size_t i = 0; i < summary.geometries; ++i) {
    const baked::GeometryRecord& g = s.geometries[i];
    summary.triangles += g.triangle_count;
    summary.vertices += g.vertex_count;
    summary.clusters += g.cluster_count;
    summary.shared_geometries += uses[i] > 1;
    summary.max_position_error = std::max(summary.max_position_error, g.max_position_error);
    summary.max_position_error_bound = std::max(summary.max_position_error_bound, g.position_error_bound);
    summary.max_normal_error_degrees = std::max(summary.max_normal_error_degrees, g.max_normal_error_degrees);
    summary.max_uv_error = std::max(summary.max_uv_error, g.max_uv_error);
    if (g.cluster_count > 0) add_grid(summary.grids, g);
    add_normals(summary.normals, g, file.clusters(static_cast<uint32_t>(i)));
    add_uvs(summary.uvs, g, file.clusters(static_cast<uint32_t>(i)), finest_texture(texels, runs[i], g.slot_count));
    summary.by_geometry.push_back(use_of(file, static_cast<uint32_t>(i), uses[i]));
  }
  std::sort(summary.grids.begin(), summary.grids.end(), [](const GridUse& a, const GridUse& b) {
    return std::tuple(!a.world_space, a.grid.step()) < std::tuple(!b.world_space, b.grid.step());
  });
}

/// Adds mesh sequences and level chains.
/// @param uses number of instances per geometry
void add_deformations(FileSummary& summary, const BakedSections& s, std::span<const uint32_t> uses) {
  for (const baked::DeformationRecord& d : deformation_records(s.deformation))
    summary.sequences.push_back({std::string(s.text(s.geometries[d.geometry].name)), d.frame_count, d.group_frames,
                                 d.frames_per_second, d.first_number, d.source_vertices, d.data_bytes,
                                 d.max_position_error});
  for (const baked::LevelChainRecord& chain : level_chains(s.deformation)) {
    LevelChainUse& use = summary.level_chains.emplace_back();
    use.distances.assign(chain.distance.begin(), chain.distance.begin() + chain.level_count - 1);
    for (const uint32_t g : std::span(chain.geometry).first(chain.level_count)) {
      use.names.emplace_back(s.text(s.geometries[g].name));
      use.instances += uses[g];
    }
  }
}

} // namespace

FileSummary summarize(const BakedFile& file) {
  const BakedSections& s = file.sections();
  FileSummary summary;
  summary.trees = s.trees.size(), summary.nodes = s.nodes.size();
  for (const baked::TreeRecord& tree : s.trees) summary.tree_depth = std::max(summary.tree_depth, tree.depth);
  std::vector<uint32_t> uses(s.geometries.size());
  for (const baked::InstanceRecord& instance : s.instances) {
    ++uses[instance.geometry];
    summary.placed_triangles += s.geometries[instance.geometry].triangle_count;
    summary.placed_vertices += s.geometries[instance.geometry].vertex_count;
  }
  add_geometries(summary, file, uses);
  add_materials(summary, s);
  summary.requirements.assign(s.requirements.begin(), s.requirements.end());
  for (const baked::TextureRecord& t : s.textures)
    summary.textures.push_back({std::string(s.text(t.name)), t.width, t.height, static_cast<TextureCodec>(t.codec),
                                texture_bytes(static_cast<TextureCodec>(t.codec), t.width, t.height), t.psnr_db});
  add_deformations(summary, s, uses);
  summary.lod = summarize_lod(file);
  summary.proxies = summarize_proxies(file);
  summary.motion = summarize_motion(file);
  summary.instances = s.instances.size();
  summary.materials = s.materials.size();
  summary.masks = s.masks.size();
  const ShadingData shading = file.shading();
  summary.lights = shading.lights.size();
  summary.area_light_materials =
      static_cast<uint64_t>(std::ranges::count_if(shading.materials, &SurfaceShading::emits));
  summary.cameras = s.cameras.size();
  summary.bytes = stream_bytes(file);
  summary.disk = file.disk();
  const auto per = [&](uint64_t count) {
    return count > 0 ? static_cast<double>(summary.bytes.total) / static_cast<double>(count) : 0.0;
  };
  summary.bytes_per_triangle = per(summary.triangles);
  summary.bytes_per_placed_triangle = per(summary.placed_triangles);
  if (summary.clusters > 0)
    summary.triangles_per_cluster = static_cast<double>(summary.triangles) / static_cast<double>(summary.clusters);
  summary.bounds = file.world_bounds();
  summary.bounds.lo += file.origin(), summary.bounds.hi += file.origin();
  summary.bake = s.summary.front();
  return summary;
}

} // namespace packtrace
