#include "compress/bake/write/file_sections.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compress/format/file/baked_image.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

void require(bool ok, const std::string& what) {
  if (!ok) throw Error(ErrorKind::kInput, "invalid scene: " + what);
}

} // namespace

FileSections::FileSections(const Scene& scene, const std::vector<EncodedTexture>& textures) {
  add_materials(scene, !textures.empty());
  add_masks(scene);
  add_textures(scene, textures);
  add_cameras(scene);
}

baked::StringRef FileSections::add_string(std::string_view text) {
  if (text.size() > std::numeric_limits<uint32_t>::max() - strings_.size())
    throw Error(ErrorKind::kLimitExceeded, "names take more than 4 GiB");
  const baked::StringRef ref{static_cast<uint32_t>(strings_.size()), static_cast<uint32_t>(text.size())};
  strings_ += text;
  return ref;
}

void FileSections::add_materials(const Scene& scene, bool textured) {
  for (const Material& material : scene.materials) {
    const auto mask = [&](MaterialFlags flag, uint32_t index) {
      if ((material.flags & flag) == 0) return baked::kNone;
      require(index < scene.masks.size(), "an alpha mask of material " + material.name + " does not exist");
      return index;
    };
    require((material.flags & ~kAllMaterialFlags) == 0, "unknown flags of material " + material.name);
    for (int channel = 0; channel < 3; ++channel)
      require(material.albedo[channel] >= 0.0f && material.albedo[channel] <= 1.0f,
              "the albedo of material " + material.name + " is outside [0, 1]");
    baked::MaterialRecord record{};
    record.flags = material.flags;
    record.albedo = {material.albedo.x, material.albedo.y, material.albedo.z};
    record.alpha_mask = mask(kAlphaMask, material.alpha_mask);
    record.shadow_alpha_mask = mask(kShadowAlphaMask, material.shadow_alpha_mask);
    record.albedo_texture = textured ? material.albedo_texture : baked::kNone;
    require(record.albedo_texture == baked::kNone ||
                (record.albedo_texture < scene.textures.size() && (material.flags & kAlbedoTexture) != 0),
            "the texture of material " + material.name + " does not exist, or its flag is not set");
    record.name = add_string(material.name);
    materials_.push_back(record);
  }
}

void FileSections::add_masks(const Scene& scene) {
  for (const AlphaMask& mask : scene.masks) {
    require(mask.width > 0 && mask.height > 0 &&
                mask.words.size() == size_t{AlphaMask::row_words(mask.width)} * mask.height,
            "an alpha mask's bits and size disagree");
    for (const float f : {mask.uv_scale.x, mask.uv_scale.y, mask.uv_offset.x, mask.uv_offset.y})
      require(std::isfinite(f), "an alpha mask's texture transform is not finite");
    baked::MaskRecord record{};
    record.first_word = mask_words_.size();
    record.width = mask.width;
    record.height = mask.height;
    record.wrap = static_cast<uint32_t>(mask.wrap);
    record.uv_scale = {mask.uv_scale.x, mask.uv_scale.y};
    record.uv_offset = {mask.uv_offset.x, mask.uv_offset.y};
    mask_words_.insert(mask_words_.end(), mask.words.begin(), mask.words.end());
    masks_.push_back(record);
  }
}

void FileSections::add_textures(const Scene& scene, const std::vector<EncodedTexture>& textures) {
  for (size_t i = 0; i < textures.size(); ++i) {
    const AlbedoTexture& texture = scene.textures[i];
    baked::TextureRecord record{};
    record.first_byte = texture_bytes_.size();
    record.width = texture.width;
    record.height = texture.height;
    record.wrap = static_cast<uint32_t>(texture.wrap);
    record.codec = static_cast<uint32_t>(textures[i].codec);
    record.uv_scale = {texture.uv_scale.x, texture.uv_scale.y};
    record.uv_offset = {texture.uv_offset.x, texture.uv_offset.y};
    record.psnr_db = static_cast<float>(textures[i].psnr_db);
    record.name = add_string(texture.name);
    texture_bytes_.insert(texture_bytes_.end(), textures[i].data.begin(), textures[i].data.end());
    require(!find_texture_fault(record, texture_bytes_.size()), "texture " + texture.name);
    textures_.push_back(record);
  }
}

void FileSections::add_cameras(const Scene& scene) {
  for (const Camera& camera : scene.cameras) {
    require(camera.width_px > 0 && camera.height_px > 0, "a camera's film has no pixels");
    baked::CameraRecord record{};
    bool finite = std::isfinite(camera.fov_degrees);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) {
        record.world_from_camera[static_cast<size_t>(3 * column + row)] = camera.world_from_camera[column][row];
        finite &= std::isfinite(camera.world_from_camera[column][row]);
      }
    record.fov_degrees = camera.fov_degrees;
    if (camera.screen_window) {
      const glm::dvec4& w = *camera.screen_window;
      record.screen_window = {w.x, w.y, w.z, w.w};
      record.has_screen_window = 1;
      for (const double d : record.screen_window) finite &= std::isfinite(d);
    }
    require(finite, "a camera's transform, angle or screen window is not finite");
    record.projection = static_cast<uint32_t>(camera.projection);
    record.width_px = camera.width_px;
    record.height_px = camera.height_px;
    record.film_name = add_string(camera.film_name);
    cameras_.push_back(record);
  }
}

void FileSections::reserve(size_t clusters, size_t payload_bytes) {
  clusters_.reserve(clusters_.size() + clusters);
  payload_.reserve(payload_.size() + payload_bytes);
}

void FileSections::add_geometry(baked::GeometryRecord record, const EncodedGeometry& encoded, std::string_view name) {
  record.name = add_string(name);
  append(record, encoded);
}

void FileSections::add_lod(uint32_t base, const EncodedLod& lod) {
  require(lod_groups_.size() + lod.groups.size() <= ~0u && lod_links_.size() + lod.links.size() <= ~0u,
          "levels of detail have 2^32 groups or clusters, or more");
  auto first_group = static_cast<uint32_t>(lod_groups_.size()), first_link = static_cast<uint32_t>(lod_links_.size());
  for (uint32_t number = 0; number < lod.levels.size(); ++number) {
    const EncodedLod::Level& level = lod.levels[number];
    const auto geometry = number == 0 ? base : static_cast<uint32_t>(geometries_.size());
    if (number > 0) {
      baked::GeometryRecord record = geometries_[base];
      record.flags = static_cast<uint16_t>(record.flags | baked::kLodLevel);
      record.name = {};
      record.normal_encoding = static_cast<uint8_t>(level.normal_encoding);
      record.max_normal_error_degrees = std::min(record.max_normal_error_degrees + level.max_normal_error, 180.0f);
      record.mean_normal_error_degrees =
          std::min(record.mean_normal_error_degrees + level.mean_normal_error, record.max_normal_error_degrees);
      append(record, level.encoded);
    }
    lod_levels_.push_back({first_group, first_link, static_cast<uint32_t>(level.triangles), base, geometry,
                           static_cast<uint16_t>(level.group_count), static_cast<uint16_t>(number), level.error});
    first_group += level.group_count, first_link += geometries_[geometry].cluster_count;
  }
  lod_groups_.insert(lod_groups_.end(), lod.groups.begin(), lod.groups.end());
  lod_links_.insert(lod_links_.end(), lod.links.begin(), lod.links.end());
}

void FileSections::append(baked::GeometryRecord& record, const EncodedGeometry& encoded) {
  require(clusters_.size() + encoded.clusters.size() <= ~0u, "geometry has 2^32 clusters, or more");
  record.first_cluster = static_cast<uint32_t>(clusters_.size());
  record.payload_offset = payload_.size() - kReadSlackBytes;
  record.payload_bytes = encoded.payload.size();
  record.cluster_count = static_cast<uint32_t>(encoded.clusters.size());
  record.triangle_count = encoded.triangle_count;
  record.vertex_count = encoded.vertex_count;
  record.bounds_lo = {encoded.bounds_lo.x, encoded.bounds_lo.y, encoded.bounds_lo.z};
  record.bounds_hi = {encoded.bounds_hi.x, encoded.bounds_hi.y, encoded.bounds_hi.z};
  record.class_clusters = encoded.class_clusters;
  geometries_.push_back(record);
  clusters_.insert(clusters_.end(), encoded.clusters.begin(), encoded.clusters.end());
  payload_.insert(payload_.end() - kReadSlackBytes, encoded.payload.begin(), encoded.payload.end());
  stream_bits_.indices += encoded.stream_bits.indices;
  stream_bits_.positions += encoded.stream_bits.positions;
  stream_bits_.normals += encoded.stream_bits.normals;
  stream_bits_.uvs += encoded.stream_bits.uvs;
}

BakedSections FileSections::without_trees() const {
  BakedSections sections;
  sections.geometries = geometries_;
  sections.clusters = clusters_;
  sections.payload = payload_;
  sections.instances = instances_;
  sections.lod_levels = lod_levels_;
  sections.lod_groups = lod_groups_;
  sections.lod_links = lod_links_;
  return sections;
}

void FileSections::build_trees() { trees_ = build_packed_trees(without_trees()); }

std::vector<std::byte> FileSections::assemble(const baked::SummaryRecord& summary) {
  baked::SummaryRecord complete = summary;
  complete.shading_bytes = shading_.size();
  return assemble_baked_file({geometries_,    clusters_,       payload_,       materials_,  instances_,  masks_,
                              mask_words_,    textures_,       texture_bytes_, shading_,    cameras_,    strings_,
                              {&complete, 1}, material_slots_, requirements_,  lod_levels_, lod_groups_, lod_links_,
                              trees_.trees,   rigid_motion_,   deformation_,   trees_.nodes});
}

} // namespace packtrace
