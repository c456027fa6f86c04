#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "compress/bake/clusters/geometry_encoder.h"
#include "compress/bake/lod/lod_encoder.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/shading/shading_codec.h"
#include "compress/format/textures/texture_encoder.h"
#include "compress/format/trees/packed_trees.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Collects the records of a file.
class FileSections {
public:
  /// Adds materials, masks, textures and cameras. Throws Error(kInput) if they break the rules of scene.h.
  /// @param textures the scene's textures in order, or empty: then no material refers to a texture
  FileSections(const Scene& scene, const std::vector<EncodedTexture>& textures);

  /// Makes room for the clusters and streams of geometries that will be added.
  void reserve(size_t clusters, size_t payload_bytes);

  /// Sets the record's ranges, counts, bounds and name, and appends it with its clusters and payload.
  void add_geometry(baked::GeometryRecord record, const EncodedGeometry& encoded, std::string_view name);

  /// Appends the LOD levels of a geometry. Call after all add_geometry() calls, in the order of the base geometries.
  void add_lod(uint32_t base, const EncodedLod& lod);

  /// Sets all instances. Call before without_trees() and build_trees().
  void set_instances(std::vector<baked::InstanceRecord> instances) { instances_ = std::move(instances); }

  void set_material_slots(std::vector<uint32_t> slots) { material_slots_ = std::move(slots); }
  void set_rigid_motion(std::vector<uint8_t> bytes) { rigid_motion_ = std::move(bytes); }
  /// Stores materials' shading, lights and environment maps. Throws as encode_shading() does.
  void add_shading(const Scene& scene) { shading_ = encode_shading(scene); }
  void set_deformation(std::vector<uint8_t> bytes) { deformation_ = std::move(bytes); }
  void set_requirements(std::vector<baked::RequirementRecord> rows) { requirements_ = std::move(rows); }

  /// Records of all geometries added so far, including LOD levels.
  const std::vector<baked::GeometryRecord>& geometries() const { return geometries_; }
  /// Sums of the bits of all added geometries.
  const ClusterView::StreamBits& stream_bits() const { return stream_bits_; }

  /// Geometries, clusters, payload, instances and LOD levels added so far. Valid until something is added.
  BakedSections without_trees() const;

  /// Builds the trees over everything added so far. Throws like build_packed_trees().
  void build_trees();

  /// Returns the file's bytes. Nothing may be added afterwards.
  std::vector<std::byte> assemble(const baked::SummaryRecord& summary);

private:
  void append(baked::GeometryRecord& record, const EncodedGeometry& encoded);
  baked::StringRef add_string(std::string_view text);
  void add_materials(const Scene& scene, bool textured);
  void add_masks(const Scene& scene);
  void add_textures(const Scene& scene, const std::vector<EncodedTexture>& textures);
  void add_cameras(const Scene& scene);

  std::vector<baked::GeometryRecord> geometries_;
  std::vector<baked::ClusterRecord> clusters_;
  /// Always ends with kReadSlackBytes zero bytes.
  std::vector<uint8_t> payload_ = std::vector<uint8_t>(kReadSlackBytes);
  std::vector<baked::MaterialRecord> materials_;
  std::vector<baked::InstanceRecord> instances_;
  std::vector<baked::MaskRecord> masks_;
  std::vector<uint32_t> mask_words_;
  std::vector<baked::TextureRecord> textures_;
  std::vector<uint8_t> texture_bytes_;
  std::vector<baked::CameraRecord> cameras_;
  std::string strings_;
  std::vector<uint32_t> material_slots_;
  std::vector<baked::RequirementRecord> requirements_;
  std::vector<baked::LodLevelRecord> lod_levels_;
  std::vector<baked::LodGroupRecord> lod_groups_;
  std::vector<baked::LodLinkRecord> lod_links_;
  PackedTrees trees_;
  std::vector<uint8_t> rigid_motion_, deformation_, shading_;
  ClusterView::StreamBits stream_bits_;
};

} // namespace packtrace
