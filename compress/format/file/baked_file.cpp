#include "compress/format/file/baked_file.h"

#include <algorithm>
#include <cassert>

#include "compress/format/deformation/deformation_view.h"
#include "compress/format/file/mapped_file.h"
#include "pbrt_import/base/large_pages.h"

namespace packtrace {
namespace {

DiskForm resident_form(std::span<const std::byte> bytes) {
  DiskForm form;
  form.file_bytes = bytes.size();
  return form;
}

} // namespace

BakedFile::BakedFile(std::unique_ptr<MappedFile> map, std::vector<std::byte> owned, std::span<const std::byte> bytes,
                     const DiskForm& disk, const std::string& name)
    : map_(std::move(map)), owned_(std::move(owned)), bytes_(bytes), disk_(disk),
      sections_(validate_baked_file(bytes, name, disk.clusters_checked)) {}

BakedFile::BakedFile(BakedFile&&) noexcept = default;
BakedFile& BakedFile::operator=(BakedFile&&) noexcept = default;
BakedFile::~BakedFile() = default;

BakedFile BakedFile::open(const std::filesystem::path& path) {
  auto map = std::make_unique<MappedFile>(path);
  const auto bytes = map->bytes();
  if (is_paged_file(bytes)) return expand(bytes, path.string());
  return BakedFile(std::move(map), {}, bytes, resident_form(bytes), path.string());
}

BakedFile BakedFile::expand(std::span<const std::byte> bytes, const std::string& name) {
  DiskForm disk;
  std::vector<std::byte> owned = expand_paged_file(bytes, name, disk);
  const std::span<const std::byte> resident(owned); // moving the vector keeps its elements in place
  return BakedFile(nullptr, std::move(owned), resident, disk, name);
}

BakedFile BakedFile::from_bytes(std::span<const std::byte> bytes, const std::string& name) {
  if (is_paged_file(bytes)) return expand(bytes, name);
  std::vector<std::byte> owned;
  reserve_large(owned, bytes.size());
  owned.assign(bytes.begin(), bytes.end());
  const std::span<const std::byte> copy(owned);
  return BakedFile(nullptr, std::move(owned), copy, resident_form(copy), name);
}

BakedFile BakedFile::borrow_bytes(std::span<const std::byte> bytes, const std::string& name) {
  if (is_paged_file(bytes)) return expand(bytes, name);
  return BakedFile(nullptr, {}, bytes, resident_form(bytes), name);
}

std::span<const baked::ClusterRecord> BakedFile::clusters(uint32_t geometry) const {
  const baked::GeometryRecord& record = sections_.geometries[geometry];
  return sections_.clusters.subspan(static_cast<size_t>(record.first_cluster), record.cluster_count);
}

ClusterView BakedFile::cluster(uint32_t geometry, uint32_t cluster) const {
  const baked::GeometryRecord& record = sections_.geometries[geometry];
  assert(cluster < record.cluster_count);
  return {record, sections_.clusters[static_cast<size_t>(record.first_cluster) + cluster],
          sections_.payload.data() + record.payload_offset};
}

uint32_t BakedFile::cluster_of_triangle(uint32_t geometry, uint32_t triangle) const {
  const auto records = clusters(geometry);
  assert(triangle < sections_.geometries[geometry].triangle_count);
  const auto after = std::upper_bound(
      records.begin(), records.end(), triangle,
      [](uint32_t number, const baked::ClusterRecord& record) { return number < record.first_triangle; });
  return static_cast<uint32_t>(after - records.begin()) - 1;
}

uint32_t BakedFile::base_geometry_count() const {
  const auto end =
      std::partition_point(sections_.geometries.begin(), sections_.geometries.end(),
                           [](const baked::GeometryRecord& g) { return (g.flags & baked::kLodLevel) == 0; });
  return static_cast<uint32_t>(end - sections_.geometries.begin());
}

LodView BakedFile::lod(uint32_t geometry) const {
  const auto all = sections_.lod_levels;
  const auto first =
      std::partition_point(all.begin(), all.end(), [&](const baked::LodLevelRecord& l) { return l.base < geometry; });
  auto end = first;
  uint64_t groups = 0, links = 0;
  for (; end != all.end() && end->base == geometry; ++end) // at most kMaxLodLevels steps
    groups += end->group_count, links += sections_.geometries[end->geometry].cluster_count;
  if (first == end) return {};
  return {{first, end},
          sections_.lod_groups.subspan(static_cast<size_t>(first->first_group), static_cast<size_t>(groups)),
          sections_.lod_links.subspan(static_cast<size_t>(first->first_link), static_cast<size_t>(links))};
}

Affine BakedFile::world_from_object(uint32_t instance) const {
  const auto& m = sections_.instances[instance].world_from_object;
  return Affine(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11]);
}

std::span<const uint32_t> BakedFile::instance_materials(uint32_t instance) const {
  const baked::InstanceRecord& record = sections_.instances[instance];
  return sections_.material_slots.subspan(record.first_slot, sections_.geometries[record.geometry].slot_count);
}

std::vector<std::vector<uint32_t>> material_runs(const BakedSections& sections) {
  std::vector<std::vector<uint32_t>> runs(sections.geometries.size());
  for (const baked::InstanceRecord& instance : sections.instances)
    runs[instance.geometry].push_back(instance.first_slot);
  for (const baked::LevelChainRecord& chain : level_chains(sections.deformation)) {
    std::vector<uint32_t> all;
    const std::span<const uint32_t> geometries = std::span(chain.geometry).first(chain.level_count);
    for (const uint32_t g : geometries) all.insert(all.end(), runs[g].begin(), runs[g].end());
    for (const uint32_t g : geometries) runs[g] = all;
  }
  for (std::vector<uint32_t>& of_geometry : runs) {
    std::sort(of_geometry.begin(), of_geometry.end());
    of_geometry.erase(std::unique(of_geometry.begin(), of_geometry.end()), of_geometry.end());
  }
  return runs;
}

AlphaMaskView BakedFile::mask(uint32_t index) const {
  const baked::MaskRecord& record = sections_.masks[index];
  const size_t words = size_t{AlphaMask::row_words(record.width)} * record.height;
  return {record.width,
          record.height,
          static_cast<WrapMode>(record.wrap),
          Vec2(record.uv_scale[0], record.uv_scale[1]),
          Vec2(record.uv_offset[0], record.uv_offset[1]),
          sections_.mask_words.subspan(static_cast<size_t>(record.first_word), words)};
}

TextureView BakedFile::texture(uint32_t index) const {
  const baked::TextureRecord& record = sections_.textures[index];
  const auto codec = static_cast<TextureCodec>(record.codec);
  return {record.width,
          record.height,
          static_cast<WrapMode>(record.wrap),
          Vec2(record.uv_scale[0], record.uv_scale[1]),
          Vec2(record.uv_offset[0], record.uv_offset[1]),
          codec,
          sections_.texture_bytes.subspan(
              static_cast<size_t>(record.first_byte),
              static_cast<size_t>(packtrace::texture_bytes(codec, record.width, record.height)))};
}

std::vector<Material> BakedFile::materials() const {
  std::vector<Material> result;
  result.reserve(sections_.materials.size());
  for (const baked::MaterialRecord& record : sections_.materials)
    result.push_back({std::string(text(record.name)),
                      record.flags,
                      Vec3(record.albedo[0], record.albedo[1], record.albedo[2]),
                      record.alpha_mask,
                      record.shadow_alpha_mask,
                      record.albedo_texture,
                      {}});
  const std::vector<SurfaceShading> shading = this->shading().materials;
  for (size_t i = 0; i < shading.size(); ++i) result[i].shading = shading[i];
  return result;
}

ShadingData BakedFile::shading() const {
  if (!has_shading()) return {};
  return read_shading(sections_.shading, sections_.materials.size());
}

std::vector<Camera> BakedFile::cameras() const {
  std::vector<Camera> result;
  for (const baked::CameraRecord& record : sections_.cameras) {
    Camera camera;
    camera.projection = static_cast<Projection>(record.projection);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row)
        camera.world_from_camera[column][row] = record.world_from_camera[static_cast<size_t>(3 * column + row)];
    camera.fov_degrees = record.fov_degrees;
    if (const auto& w = record.screen_window; record.has_screen_window != 0)
      camera.screen_window = glm::dvec4(w[0], w[1], w[2], w[3]);
    camera.width_px = record.width_px;
    camera.height_px = record.height_px;
    camera.film_name = text(record.film_name);
    result.push_back(std::move(camera));
  }
  return result;
}

Bounds object_bounds(const baked::GeometryRecord& geometry) {
  Bounds bounds;
  if (geometry.cluster_count == 0) return bounds;
  bounds.extend(DVec3(geometry.bounds_lo[0], geometry.bounds_lo[1], geometry.bounds_lo[2]));
  bounds.extend(DVec3(geometry.bounds_hi[0], geometry.bounds_hi[1], geometry.bounds_hi[2]));
  return bounds;
}

DVec3 BakedFile::origin() const {
  const std::array<double, 3>& origin = summary().origin;
  return DVec3(origin[0], origin[1], origin[2]);
}

Bounds BakedFile::world_bounds() const {
  const baked::SummaryRecord& s = summary();
  Bounds bounds;
  bounds.lo = DVec3(s.bounds_lo[0], s.bounds_lo[1], s.bounds_lo[2]);
  bounds.hi = DVec3(s.bounds_hi[0], s.bounds_hi[1], s.bounds_hi[2]);
  return bounds;
}

} // namespace packtrace
