#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/pages/page_codec.h"
#include "compress/format/shading/shading_codec.h"
#include "compress/format/textures/texture_codec.h"
#include "pbrt_import/scene/alpha_mask.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

class MappedFile;

/// Typed spans over the sections of a baked file. They do not own memory.
struct BakedSections {
  std::span<const baked::GeometryRecord> geometries;
  std::span<const baked::ClusterRecord> clusters;
  std::span<const uint8_t> payload;
  std::span<const baked::MaterialRecord> materials;
  std::span<const baked::InstanceRecord> instances;
  std::span<const baked::MaskRecord> masks;
  std::span<const uint32_t> mask_words;
  std::span<const baked::TextureRecord> textures;
  std::span<const uint8_t> texture_bytes; ///< without the shading behind them
  std::span<const uint8_t> shading;       ///< read_shading() decodes it; empty: not baked for shading
  std::span<const baked::CameraRecord> cameras;
  std::span<const char> strings;
  std::span<const baked::SummaryRecord> summary; ///< exactly one record
  std::span<const uint32_t> material_slots;
  std::span<const baked::RequirementRecord> requirements;
  std::span<const baked::LodLevelRecord> lod_levels;
  std::span<const baked::LodGroupRecord> lod_groups;
  std::span<const baked::LodLinkRecord> lod_links;
  std::span<const baked::TreeRecord> trees; ///< empty if the file stores no trees; build_packed_trees() makes them
  std::span<const uint8_t> rigid_motion;    ///< read_rigid_motion() decodes it
  std::span<const uint8_t> deformation;
  std::span<const baked::PackedNode> nodes;

  std::string_view text(baked::StringRef ref) const { return {strings.data() + ref.offset, ref.bytes}; }
};

/// A baked file that was validated as a whole when it was opened. No access through it can leave the file's bytes.
/// Spans and views live as long as the BakedFile; moving it does not invalidate them. All functions are const and may
/// run on several threads.
class BakedFile {
public:
  /// Maps the file and validates it. Files with codec fast or small are decoded into memory first.
  /// Throws Error(kInput) with the fault and its place, Error(kUnsupported) for other format versions, and Error(kIo).
  static BakedFile open(const std::filesystem::path& path);

  /// Like open(), for bytes in memory. Resident bytes are copied.
  /// @param name of the file in error messages
  static BakedFile from_bytes(std::span<const std::byte> bytes, const std::string& name = "memory");

  /// Like from_bytes() without the copy: the caller keeps the bytes alive and unchanged. They must be 8-byte aligned.
  static BakedFile borrow_bytes(std::span<const std::byte> bytes, const std::string& name = "memory");

  BakedFile(BakedFile&&) noexcept;
  BakedFile& operator=(BakedFile&&) noexcept;
  ~BakedFile();

  std::span<const baked::GeometryRecord> geometries() const { return sections_.geometries; }
  std::span<const baked::InstanceRecord> instances() const { return sections_.instances; }
  const baked::SummaryRecord& summary() const { return sections_.summary.front(); }
  const BakedSections& sections() const { return sections_; }
  /// The resident file (codec none), as it is held in memory.
  std::span<const std::byte> bytes() const { return bytes_; }
  uint64_t file_bytes() const { return bytes_.size(); }
  /// Codec and sizes of the file that was opened, before decoding.
  const DiskForm& disk() const { return disk_; }
  std::string_view text(baked::StringRef ref) const { return sections_.text(ref); }

  std::span<const baked::ClusterRecord> clusters(uint32_t geometry) const;
  ClusterView cluster(uint32_t geometry, uint32_t cluster) const;
  /// Index of the geometry's cluster that holds `triangle`; triangle < triangle_count. Takes O(log clusters).
  uint32_t cluster_of_triangle(uint32_t geometry, uint32_t triangle) const;

  /// Number of geometries that instances may reference. They come first; all geometries behind them are LOD levels.
  uint32_t base_geometry_count() const;
  /// LOD levels of a geometry below base_geometry_count(); empty if it has none. Takes O(log levels).
  LodView lod(uint32_t geometry) const;

  Affine world_from_object(uint32_t instance) const;
  /// Material numbers of the instance's geometry, by material slot.
  std::span<const uint32_t> instance_materials(uint32_t instance) const;
  AlphaMaskView mask(uint32_t index) const;
  TextureView texture(uint32_t index) const;
  std::vector<Material> materials() const;
  /// Whether the file was baked for shading: materials() have their shading, and there are lights.
  bool has_shading() const { return !sections_.shading.empty(); }
  /// Materials' shading, lights and environment maps; empty without has_shading().
  ShadingData shading() const;
  std::vector<Camera> cameras() const;
  /// World-space bounds of all instances at all times, relative to origin().
  Bounds world_bounds() const;
  /// World coordinates of the point that all positions, instances and cameras of the file are relative to. It is 0
  /// unless the world lies far from its zero.
  DVec3 origin() const;

private:
  BakedFile(std::unique_ptr<MappedFile> map, std::vector<std::byte> owned, std::span<const std::byte> bytes,
            const DiskForm& disk, const std::string& name);
  static BakedFile expand(std::span<const std::byte> bytes, const std::string& name);

  std::unique_ptr<MappedFile> map_; // owns bytes_ if not null
  std::vector<std::byte> owned_;    // else owns bytes_ if not empty; else bytes_ is borrowed
  std::span<const std::byte> bytes_;
  DiskForm disk_;
  BakedSections sections_;
};

/// Bounds of the decoded vertices in object space. Empty if the geometry has no clusters.
Bounds object_bounds(const baked::GeometryRecord& geometry);

/// By geometry: the distinct values of first_slot of its instances, ascending.
std::vector<std::vector<uint32_t>> material_runs(const BakedSections& sections);

/// Validates a whole file image and returns its sections. BakedFile calls it when it opens a file.
/// @param bytes 8-byte aligned
/// @param clusters_checked find_cluster_fault() has already accepted every cluster, see DiskForm
BakedSections validate_baked_file(std::span<const std::byte> bytes, const std::string& name,
                                  bool clusters_checked = false);

} // namespace packtrace
