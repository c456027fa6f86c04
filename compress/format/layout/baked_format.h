#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "compress/format/layout/lod_format.h"
#include "compress/format/layout/packed_node.h"
#include "pbrt_import/scene/material_flags.h"

/// Records of a .ptk file, version 12; docs/baked_format.md describes them. All values are little-endian. Every section
/// starts at a multiple of 64 bytes. Bytes that belong to no field and no section are zero.
namespace packtrace::baked {

inline constexpr std::array<uint8_t, 8> kMagic = {'P', 'T', 'K', 0x89, '\r', '\n', 0x1a, 0};
inline constexpr uint32_t kVersion = 14;
inline constexpr size_t kSectionAlignment = 64;
inline constexpr uint32_t kNone = ~0u;

/// Section numbers are indices into FileHeader::sections.
enum Section : uint32_t {
  kGeometries,
  kClusters,
  kPayload, ///< bytes: bit streams of all clusters, then 8 zero bytes
  kMaterials,
  kInstances,
  kMasks,
  kMaskWords, ///< uint32_t: texel rows of all masks
  kTextures,
  kTextureBytes, ///< texels of all textures, then SummaryRecord::shading_bytes of shading, shading_codec.h
  kCameras,
  kStrings,       ///< UTF-8 bytes, not terminated
  kSummary,       ///< one record
  kMaterialSlots, ///< uint32_t: material numbers; each instance uses a run of them
  kRequirements,
  kLodLevels,   ///< LodLevelRecord, lod_format.h
  kLodGroups,   ///< LodGroupRecord
  kLodLinks,    ///< LodLinkRecord
  kTrees,       ///< TreeRecord, packed_node.h
  kRigidMotion, ///< bytes: keys of moving instances and cameras, motion_codec.h; empty if none moves
  kDeformation, ///< bytes: meshes whose vertices move; empty if there are none
  kNodes,       ///< PackedNode of all trees; the last section, because the disk forms store it apart from the others
  kSectionCount
};

struct SectionRecord {
  uint64_t offset; ///< bytes from the start of the file, multiple of 64
  uint64_t bytes;  ///< multiple of record_bytes
  uint32_t record_bytes;
  uint32_t reserved;
};

struct FileHeader {
  std::array<uint8_t, 8> magic;
  uint32_t version;
  uint32_t header_bytes;
  uint64_t file_bytes;
  std::array<uint64_t, 2> content_hash; ///< XXH3-128, low half first, of [header_bytes, file_bytes)
  uint32_t section_count;
  uint32_t reserved;
  std::array<SectionRecord, kSectionCount> sections;
  std::array<uint64_t, 2> padding; ///< zero
  uint64_t header_hash;            ///< XXH3-64 of the header before this field
};

struct StringRef {
  uint32_t offset; ///< bytes into the string section
  uint32_t bytes;
};

// GeometryRecord::flags
inline constexpr uint16_t kWorldSpace = 1u << 0; ///< lies on the scene's grid; instance transforms are the identity
/// LOD level above 0 of another geometry; no instance references it; behind all others.
inline constexpr uint16_t kLodLevel = 1u << 1;
inline constexpr uint16_t kGeometryFlags = kWorldSpace | kLodLevel;

/// Clusters of one geometry, ordered by material_class(). The order of the fields needs no padding and compresses well.
struct GeometryRecord {
  std::array<int64_t, 3> origin; ///< of the grid, in lattice steps
  double max_position_error;     ///< measured, largest axis, object units
  double position_error_bound;   ///< upper bound from the step and the rounding to float, >= max_position_error
  uint32_t step_mantissa;
  int32_t step_exponent;
  uint32_t anchor_shift;              ///< cluster anchors are in units of 2^anchor_shift steps
  std::array<int16_t, 2> uv_exponent; ///< u, v; 0 unless the encoding is the lattice
  uint16_t flags;
  uint8_t normal_encoding;        ///< normal_codec.h; the same for all its clusters
  uint8_t uv_encoding;            ///< uv_codec.h; the same for all its clusters
  std::array<float, 3> bounds_lo; ///< of the decoded vertices; lo > hi if there are none
  std::array<float, 3> bounds_hi;
  float max_normal_error_degrees;  ///< measured against the source
  float mean_normal_error_degrees; ///< mean over all its normals
  float max_uv_error;
  uint64_t payload_offset;                ///< bytes into the payload section, multiple of 4
  uint64_t payload_bytes;                 ///< multiple of 4
  std::array<uint32_t, 8> class_clusters; ///< clusters of each material class; sums to cluster_count
  uint32_t first_cluster;
  uint32_t cluster_count;
  uint32_t triangle_count;
  uint32_t vertex_count; ///< sum over clusters
  StringRef name;
  uint32_t slot_count;   ///< number of material slots, which are ordered by material_class(); 0 without clusters
  uint32_t requirements; ///< requirement_bit()s of the reasons that hold for some of its triangles
};

// ClusterRecord::flags
inline constexpr uint8_t kClusterHasNormals = 1u << 0;
inline constexpr uint8_t kClusterHasUvs = 1u << 1;
inline constexpr uint8_t kClusterMixedCharts = 1u << 2; ///< every normal stores its chart
inline constexpr uint32_t kClusterChartShift = 3;       ///< otherwise kClusterChart is the common chart:
inline constexpr uint8_t kClusterChart = 7u << kClusterChartShift;
inline constexpr uint8_t kClusterFlags = kClusterHasNormals | kClusterHasUvs | kClusterMixedCharts | kClusterChart;

/// Up to 128 triangles of one material slot. The payload holds, bit by bit without gaps: strips (index_codec.h); per
/// vertex the lattice coordinates x, y, z relative to the anchor; normals; texture coordinates.
struct ClusterRecord {
  uint32_t payload_offset;              ///< in 4-byte words from the start of the geometry's payload
  uint32_t first_triangle;              ///< within the geometry
  uint32_t first_vertex;                ///< within the geometry
  uint32_t material_slot;               ///< an instance's material is material_slots[first_slot + material_slot]
  std::array<int32_t, 3> anchor;        ///< lattice, relative to the geometry's origin, in 2^anchor_shift steps
  std::array<int16_t, 2> normal_anchor; ///< of x and y, in units of two codes
  uint16_t vertex_count;                ///< 1..256
  uint16_t normal_palette;              ///< number of palette entries; 0: no palette, one normal per vertex in order
  uint8_t triangle_count;               ///< 1..128
  uint8_t strip_count;                  ///< number of strips, 1..triangle_count
  std::array<uint8_t, 3> position_bits; ///< 0..57 per axis
  std::array<uint8_t, 2> normal_bits;   ///< widths of x and y relative to the normal anchor, 0..17
  uint8_t flags;
};

struct MaterialRecord {
  uint32_t flags; ///< pbrt_import/scene/material_flags.h
  std::array<float, 3> albedo;
  uint32_t alpha_mask;        ///< or kNone
  uint32_t shadow_alpha_mask; ///< or kNone
  uint32_t albedo_texture;    ///< or kNone
  StringRef name;
};

struct InstanceRecord {
  std::array<float, 12> world_from_object; ///< four columns of three
  uint32_t geometry;
  uint32_t first_slot; ///< into the material slots; the run has the geometry's slot_count entries
};

struct MaskRecord {
  uint64_t first_word; ///< into the mask words
  uint32_t width;
  uint32_t height;
  uint32_t wrap; ///< 0 repeat, 1 black, 2 clamp
  uint32_t reserved;
  std::array<float, 2> uv_scale;
  std::array<float, 2> uv_offset;
};

struct TextureRecord {
  uint64_t first_byte; ///< into the texture bytes
  uint32_t width;
  uint32_t height;
  uint32_t wrap;  ///< 0 repeat, 1 black, 2 clamp
  uint32_t codec; ///< texture_codec.h
  std::array<float, 2> uv_scale;
  std::array<float, 2> uv_offset;
  float psnr_db; ///< measured; infinite if lossless
  uint32_t reserved;
  StringRef name;
};

struct CameraRecord {
  std::array<double, 12> world_from_camera; ///< four columns of three
  double fov_degrees;
  std::array<double, 4> screen_window; ///< zero unless has_screen_window
  uint32_t projection;                 ///< 0 perspective, 1 orthographic, 2 environment
  uint32_t has_screen_window;          ///< 0 or 1
  uint32_t width_px;
  uint32_t height_px;
  StringRef film_name;
};

/// Purpose that the file is baked for.
enum Purpose : uint32_t { kAo, kShading, kPurposeCount };

/// Vertex streams that a geometry stores only if something needs them.
enum Stream : uint32_t { kNormals, kUvs, kTangents, kStreamCount };

/// Why a stream is stored or not: not stored for kAbsent to kInferred, stored from kForMask on. Tangents are never
/// stored.
enum Reason : uint32_t {
  kAbsent,       ///< the source has none; for tangents also: it has no normal map
  kUnused,       ///< nothing reads it for this purpose
  kInferred,     ///< normals: equal to the face normals
  kForMask,      ///< an alpha mask is looked up with it
  kForTexture,   ///< a texture is looked up with it
  kForNormalMap, ///< a normal or bump map needs it
  kForShading,   ///< normals: differ from the face normals, or separating the equal ones would take more bytes
  kOnRequest,    ///< the user asked for it
  kReasonCount
};

/// Bit of GeometryRecord::requirements.
constexpr uint32_t requirement_bit(uint32_t stream, uint32_t reason) { return 1u << (kReasonCount * stream + reason); }
inline constexpr uint32_t kAllRequirements = (1u << (uint32_t{kReasonCount} * kStreamCount)) - 1;

inline constexpr uint32_t kKeepShift = 8; ///< first keep bit of SummaryRecord::purpose

/// Totals over the triangles of all geometries for which one reason holds for one stream. Ordered by stream, then
/// reason.
struct RequirementRecord {
  uint32_t stream;
  uint32_t reason;
  uint32_t geometries; ///< number of geometries with such triangles
  uint32_t reserved;
  uint64_t triangles;
  uint64_t source_bytes; ///< size of the stream in the source
  uint64_t stored_bits;  ///< payload bits; a geometry's bits count for the last of the stream's reasons in it
};

/// Figures of the bake for reports. Decoding needs none of them.
struct SummaryRecord {
  uint64_t source_triangles;  ///< of all shapes and objects in the scene
  uint64_t dropped_triangles; ///< dropped by the importer
  uint64_t unused_triangles;  ///< triangles of objects without instances; not stored
  uint64_t source_vertices;
  uint64_t merged_vertices;
  uint64_t collapsed_triangles;    ///< no area on the lattice; not stored
  std::array<double, 3> bounds_lo; ///< of the decoded instances, in the file's coordinates
  std::array<double, 3> bounds_hi;
  std::array<double, 3> origin; ///< world coordinates of the file's zero; instances and cameras are relative to it
  double precision_value;
  uint32_t precision_kind;      ///< 0 edge fraction, 1 diagonal fraction, 2 absolute, 3 bits
  uint32_t world_step_mantissa; ///< 0: no world-space geometry
  int32_t world_step_exponent;
  uint32_t purpose;                    ///< Purpose; bit kKeepShift + Stream: the bake had to keep all of it
  std::array<uint64_t, 4> stream_bits; ///< payload: indices, positions, normals, uvs
  uint64_t left_out;                   ///< shapes and instances outside the float range; not stored
  uint64_t coinciding_triangles;       ///< equal to another triangle after quantisation; not stored
  double source_area;                  ///< of all placed triangles before quantisation, world units squared, about
  double collapsed_area;               ///< of collapsed_triangles, in the same units
  uint64_t shading_bytes;              ///< last bytes of the texture bytes; 0: not baked for shading
};

template <typename T>
inline constexpr bool kIsPod = std::is_trivially_copyable_v<T> && std::is_standard_layout_v<T>;

static_assert(kIsPod<FileHeader> && sizeof(SectionRecord) == 24 && sizeof(FileHeader) == 576);
static_assert(offsetof(FileHeader, content_hash) == 24 && offsetof(FileHeader, sections) == 48 &&
              offsetof(FileHeader, header_hash) == 568);
static_assert(kIsPod<GeometryRecord> && sizeof(GeometryRecord) == 176 && alignof(GeometryRecord) == 8);
static_assert(offsetof(GeometryRecord, step_mantissa) == 40 && offsetof(GeometryRecord, flags) == 56 &&
              offsetof(GeometryRecord, normal_encoding) == 58 && offsetof(GeometryRecord, bounds_lo) == 60 &&
              offsetof(GeometryRecord, payload_offset) == 96 && offsetof(GeometryRecord, class_clusters) == 112 &&
              offsetof(GeometryRecord, cluster_count) == 148 && offsetof(GeometryRecord, name) == 160 &&
              offsetof(GeometryRecord, slot_count) == 168);
static_assert(kIsPod<ClusterRecord> && sizeof(ClusterRecord) == 44 && alignof(ClusterRecord) == 4);
static_assert(offsetof(ClusterRecord, anchor) == 16 && offsetof(ClusterRecord, normal_anchor) == 28 &&
              offsetof(ClusterRecord, vertex_count) == 32 && offsetof(ClusterRecord, triangle_count) == 36 &&
              offsetof(ClusterRecord, flags) == 43);
static_assert(kIsPod<MaterialRecord> && sizeof(MaterialRecord) == 36 && offsetof(MaterialRecord, alpha_mask) == 16 &&
              offsetof(MaterialRecord, name) == 28);
static_assert(kIsPod<InstanceRecord> && sizeof(InstanceRecord) == 56 && offsetof(InstanceRecord, first_slot) == 52);
static_assert(kIsPod<MaskRecord> && sizeof(MaskRecord) == 40 && offsetof(MaskRecord, uv_scale) == 24);
static_assert(kIsPod<TextureRecord> && sizeof(TextureRecord) == 56 && offsetof(TextureRecord, uv_scale) == 24 &&
              offsetof(TextureRecord, name) == 48);
static_assert(kIsPod<CameraRecord> && sizeof(CameraRecord) == 160 && offsetof(CameraRecord, projection) == 136);
static_assert(kIsPod<RequirementRecord> && sizeof(RequirementRecord) == 40);
static_assert(kAllRequirements == 0xffffff);
static_assert(kIsPod<SummaryRecord> && sizeof(SummaryRecord) == 216 && offsetof(SummaryRecord, stream_bits) == 144 &&
              offsetof(SummaryRecord, coinciding_triangles) == 184);

/// Record size of each section in bytes.
inline constexpr std::array<uint32_t, kSectionCount> kRecordBytes = {sizeof(GeometryRecord),
                                                                     sizeof(ClusterRecord),
                                                                     1,
                                                                     sizeof(MaterialRecord),
                                                                     sizeof(InstanceRecord),
                                                                     sizeof(MaskRecord),
                                                                     sizeof(uint32_t),
                                                                     sizeof(TextureRecord),
                                                                     1,
                                                                     sizeof(CameraRecord),
                                                                     1,
                                                                     sizeof(SummaryRecord),
                                                                     sizeof(uint32_t),
                                                                     sizeof(RequirementRecord),
                                                                     sizeof(LodLevelRecord),
                                                                     sizeof(LodGroupRecord),
                                                                     sizeof(LodLinkRecord),
                                                                     sizeof(TreeRecord),
                                                                     1,
                                                                     1,
                                                                     sizeof(PackedNode)};

inline constexpr uint32_t kMaskedClass = 4; ///< bit of a material class: rays must look up a mask

/// Class that orders clusters within a geometry, 0..7: solid clusters that all rays see come first, masked ones last.
constexpr uint32_t material_class(MaterialFlags flags) {
  return (camera_visible(flags) ? 0u : 1u) | (occludes(flags) ? 0u : 2u) | (needs_mask(flags) ? kMaskedClass : 0u);
}

} // namespace packtrace::baked
