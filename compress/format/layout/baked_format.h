#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "compress/format/layout/lod_format.h"
#include "compress/format/layout/packed_node.h"
#include "pbrt_import/scene/material_flags.h"

/// What lies in a .ptk file, version 5; docs/baked_format.md says it in words. Little-endian; every section starts at a
/// multiple of 64 bytes; bytes that no field or section owns are zero.
namespace packtrace::baked {

inline constexpr std::array<uint8_t, 8> kMagic = {'P', 'T', 'K', 0x89, '\r', '\n', 0x1a, 0};
inline constexpr uint32_t kVersion = 5;
inline constexpr size_t kSectionAlignment = 64;
inline constexpr uint32_t kNone = ~0u;

/// Section numbers are places in FileHeader::sections.
enum Section : uint32_t {
  kGeometries,
  kClusters,
  kPayload, ///< bytes: bit streams, then 8 zero bytes
  kMaterials,
  kInstances,
  kMasks,
  kMaskWords, ///< uint32_t, rows of all masks
  kTextures,
  kTextureBytes, ///< of all textures
  kCameras,
  kStrings,       ///< UTF-8 bytes, not terminated
  kSummary,       ///< one record
  kMaterialSlots, ///< uint32_t: materials, in runs that instances begin at
  kRequirements,
  kLodLevels, ///< LodLevelRecord, lod_format.h
  kLodGroups, ///< LodGroupRecord
  kLodLinks,  ///< LodLinkRecord
  kTrees,     ///< TreeRecord, packed_node.h
  kNodes,     ///< PackedNode, of all trees in order; the last section, as files of other codecs make it anew
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
  uint64_t header_hash; ///< XXH3-64 of the header before this field
};

struct StringRef {
  uint32_t offset; ///< bytes into the string section
  uint32_t bytes;
};

// GeometryRecord::flags
inline constexpr uint32_t kWorldSpace = 1u << 0; ///< on the scene's grid; its instances' transforms are the identity
inline constexpr uint32_t kLodLevel = 1u << 1; ///< a coarser level of another geometry; no instances; behind all others
inline constexpr uint32_t kGeometryFlags = kWorldSpace | kLodLevel;

/// Clusters of one geometry, ordered by material_class().
struct GeometryRecord {
  uint64_t first_cluster;
  uint64_t payload_offset;       ///< bytes into the payload section, multiple of 4
  uint64_t payload_bytes;        ///< multiple of 4
  std::array<int64_t, 3> origin; ///< lattice
  double max_position_error;     ///< measured, largest axis, object units
  double position_error_bound;   ///< what the step and the float result allow, >= max_position_error
  uint32_t cluster_count;
  uint32_t triangle_count;
  uint32_t vertex_count; ///< sum over clusters
  uint32_t step_mantissa;
  int32_t step_exponent;
  uint32_t anchor_shift;              ///< cluster anchors count 2^anchor_shift steps
  std::array<int32_t, 2> uv_exponent; ///< 0 unless the encoding is the lattice
  std::array<float, 3> bounds_lo;     ///< of the decoded vertices; lo > hi where there are none
  std::array<float, 3> bounds_hi;
  float max_normal_error_degrees;  ///< measured against the source
  float mean_normal_error_degrees; ///< of all its normals
  float max_uv_error;
  uint32_t flags;
  std::array<uint32_t, 8> class_clusters; ///< clusters of each material class; sums to cluster_count
  StringRef name;
  uint32_t normal_encoding; ///< normal_codec.h, of all its clusters
  uint32_t uv_encoding;     ///< uv_codec.h, of all its clusters
  uint32_t slot_count;      ///< of material slots, ordered by material_class(); 0 without clusters
  uint32_t requirements;    ///< requirement_bit()s: reasons that hold for some of its triangles
};

// ClusterRecord::flags
inline constexpr uint8_t kClusterHasNormals = 1u << 0;
inline constexpr uint8_t kClusterHasUvs = 1u << 1;
inline constexpr uint8_t kClusterMixedCharts = 1u << 2; ///< each normal carries its chart
inline constexpr uint32_t kClusterChartShift = 3;       ///< else all are unfolded around this one:
inline constexpr uint8_t kClusterChart = 7u << kClusterChartShift;
inline constexpr uint8_t kClusterFlags = kClusterHasNormals | kClusterHasUvs | kClusterMixedCharts | kClusterChart;

/// Up to 128 triangles of one material slot. Payload, bit by bit without gaps: strips (index_codec.h); per vertex the
/// lattice coordinates x, y, z less the anchor; normals; texture coordinates.
struct ClusterRecord {
  uint32_t payload_offset;              ///< in 4-byte words from the geometry's payload
  uint32_t first_triangle;              ///< within the geometry
  uint32_t first_vertex;                ///< within the geometry
  uint32_t material_slot;               ///< each instance has a material for it: that at its first_slot + this
  std::array<int32_t, 3> anchor;        ///< lattice, less the geometry's origin, in 2^anchor_shift steps
  std::array<int16_t, 2> normal_anchor; ///< of x and y, in units of two codes
  uint16_t vertex_count;                ///< 1..256
  uint16_t normal_palette;              ///< distinct normals, or 0: one per vertex in order
  uint8_t triangle_count;               ///< 1..128
  uint8_t restart_count;                ///< strips, 1..triangle_count
  std::array<uint8_t, 3> position_bits; ///< 0..57 per axis
  std::array<uint8_t, 2> normal_bits;   ///< above the anchor: x and y, 0..17
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
  uint32_t first_slot; ///< into the material slots, of the geometry's slot_count
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
  float psnr_db; ///< measured; infinite where nothing was lost
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

/// What the file is to be good for.
enum Purpose : uint32_t { kAo, kShading, kPurposeCount };

/// Streams that geometry has only where something needs them.
enum Stream : uint32_t { kNormals, kUvs, kTangents, kStreamCount };

/// Why a stream is in the file, or not: up to kInferred it is not stored, from kForMask on it is, except tangents.
enum Reason : uint32_t {
  kAbsent,       ///< the source has none, or nothing that would need it
  kUnused,       ///< nothing looks at it for this purpose
  kInferred,     ///< normals: the face's
  kForMask,      ///< an alpha mask looks it up
  kForTexture,   ///< a texture looks it up
  kForNormalMap, ///< a normal or bump map needs it
  kForShading,   ///< normals: not the face's, or among such, where separating them takes more
  kOnRequest,    ///< the user asked for it
  kReasonCount
};

/// Of GeometryRecord::requirements.
constexpr uint32_t requirement_bit(uint32_t stream, uint32_t reason) { return 1u << (kReasonCount * stream + reason); }
inline constexpr uint32_t kAllRequirements = (1u << (uint32_t{kReasonCount} * kStreamCount)) - 1;

inline constexpr uint32_t kKeepShift = 8; ///< of SummaryRecord::purpose

/// What was decided about some triangles, of all geometries together. Ordered by stream, then reason.
struct RequirementRecord {
  uint32_t stream;
  uint32_t reason;
  uint32_t geometries; ///< with such triangles
  uint32_t reserved;
  uint64_t triangles;
  uint64_t source_bytes; ///< that the stream takes in the source
  uint64_t stored_bits;  ///< of the payload; a geometry's count for the last of the stream's reasons
};

/// What the bake did: figures for people, nothing that decoding needs.
struct SummaryRecord {
  uint64_t source_triangles;  ///< of all shapes and objects of the scene
  uint64_t dropped_triangles; ///< by the importer
  uint64_t unused_triangles;  ///< of objects that are never instanced; not stored
  uint64_t source_vertices;
  uint64_t merged_vertices;
  uint64_t collapsed_triangles;    ///< have no area on the lattice; not stored
  std::array<double, 3> bounds_lo; ///< world, of the decoded instances
  std::array<double, 3> bounds_hi;
  double precision_value;
  uint32_t precision_kind;      ///< 0 edge fraction, 1 diagonal fraction, 2 absolute, 3 bits
  uint32_t world_step_mantissa; ///< 0: no world-space geometry
  int32_t world_step_exponent;
  uint32_t purpose;                    ///< Purpose; bits kKeepShift + Stream: all of it was to be kept
  std::array<uint64_t, 4> stream_bits; ///< payload: indices, positions, normals, uvs
  uint64_t left_out;                   ///< shapes and instances that leave the float range; not stored
  uint64_t coinciding_triangles;       ///< became equal to another one by quantisation; not stored
  double source_area;                  ///< of all placed triangles before quantisation, world units squared, about
  double collapsed_area;               ///< of collapsed_triangles, likewise
};

template <typename T>
inline constexpr bool kIsPod = std::is_trivially_copyable_v<T>&& std::is_standard_layout_v<T>;

static_assert(kIsPod<FileHeader> && sizeof(SectionRecord) == 24 && sizeof(FileHeader) == 512);
static_assert(offsetof(FileHeader, content_hash) == 24 && offsetof(FileHeader, sections) == 48 &&
              offsetof(FileHeader, header_hash) == 504);
static_assert(kIsPod<GeometryRecord> && sizeof(GeometryRecord) == 192 && alignof(GeometryRecord) == 8);
static_assert(offsetof(GeometryRecord, origin) == 24 && offsetof(GeometryRecord, cluster_count) == 64 &&
              offsetof(GeometryRecord, bounds_lo) == 96 && offsetof(GeometryRecord, flags) == 132 &&
              offsetof(GeometryRecord, class_clusters) == 136 && offsetof(GeometryRecord, name) == 168 &&
              offsetof(GeometryRecord, normal_encoding) == 176 && offsetof(GeometryRecord, slot_count) == 184);
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
static_assert(kIsPod<SummaryRecord> && sizeof(SummaryRecord) == 184 && offsetof(SummaryRecord, stream_bits) == 120 &&
              offsetof(SummaryRecord, coinciding_triangles) == 160);

/// sizeof the records of each section.
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
                                                                     sizeof(PackedNode)};

inline constexpr uint32_t kMaskedClass = 4; ///< bit of a material class: a mask must be looked up

/// Order of clusters within a geometry, 0..7: solid and seen by everything first, masked ones last.
constexpr uint32_t material_class(MaterialFlags flags) {
  return (camera_visible(flags) ? 0u : 1u) | (occludes(flags) ? 0u : 2u) | (needs_mask(flags) ? kMaskedClass : 0u);
}

} // namespace packtrace::baked
