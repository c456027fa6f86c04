#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "compress/exchange/vertex16/vertex16_decode.h"
#include "compress/format/layout/baked_format.h"

/// Records of the files that `export --layout vertex16` writes, version 1; docs/vertex16.md describes them. All values
/// are little-endian. Every section starts at a multiple of 64 bytes. Bytes that belong to no field and no section are
/// zero.
namespace packtrace::vertex16 {

inline constexpr std::array<uint8_t, 8> kMagic = {'P', 'T', 'V', '1', '6', '\r', '\n', 0x1a};
inline constexpr uint32_t kVersion = 1;

/// Section numbers are indices into Header::sections.
enum Section : uint32_t {
  kVertices,  ///< one glm::uvec4 per vertex
  kIndices16, ///< uint16_t: indices of draws with index_bits 16
  kIndices32, ///< uint32_t: indices of draws with index_bits 32
  kGeometries,
  kDraws,
  kInstances,
  kMaterialSlots, ///< this and all following sections are as in the .ptk file
  kMaterials,
  kMasks,
  kMaskWords,
  kTextures,
  kTextureBytes,
  kStrings,
  kSectionCount
};

struct Header {
  std::array<uint8_t, 8> magic;
  uint32_t version;
  uint32_t header_bytes;
  uint64_t file_bytes;
  std::array<uint64_t, 2> content_hash; ///< XXH3-128, low half first, of [header_bytes, file_bytes)
  uint32_t section_count;
  uint32_t reserved;
  std::array<baked::SectionRecord, kSectionCount> sections;
  std::array<uint64_t, 2> padding;
  uint64_t header_hash; ///< XXH3-64 of the header before this field
};

/// Errors are those of the export, measured against the decoded .ptk file.
struct GeometryRecord {
  Vertex16Frame frame;
  uint32_t first_vertex;
  uint32_t vertex_count;
  uint32_t first_draw;
  uint32_t draw_count;
  std::array<float, 3> bounds_lo; ///< of the decoded vertices; lo > hi if there are none
  float max_position_error;       ///< largest axis, object units
  std::array<float, 3> bounds_hi;
  float max_uv_error; ///< larger axis
  float max_normal_error_degrees;
  float max_tangent_error_degrees; ///< against the mean of dP/du over the triangles around a vertex
  uint32_t index_bits;             ///< 16 or 32, for all its draws
  uint32_t slot_count;             ///< number of material slots
};

// DrawRecord::flags
inline constexpr uint32_t kDrawFlat = 1u << 0;     ///< all vertices have the flat normal; if not set, none has it
inline constexpr uint32_t kDrawUvs = 1u << 1;      ///< if not set, texture coordinates are meaningless
inline constexpr uint32_t kDrawTangents = 1u << 2; ///< if not set, tangents are meaningless
inline constexpr uint32_t kDrawFlags = kDrawFlat | kDrawUvs | kDrawTangents;

/// Triangles of one geometry with one material slot: DrawIndexed(index_count, 1, first_index, vertex_offset, 0).
struct DrawRecord {
  uint32_t first_index;   ///< into the index section that the geometry's index_bits select
  uint32_t index_count;   ///< multiple of 3
  uint32_t vertex_offset; ///< the geometry's first_vertex
  uint32_t geometry;
  uint32_t material_slot; ///< an instance's material is material_slots[first_slot + material_slot]
  uint32_t flags;
  std::array<uint32_t, 2> reserved;
};

struct InstanceRecord {
  std::array<float, 12> world_from_object; ///< three rows of four, like VkTransformMatrixKHR
  uint32_t geometry;
  uint32_t first_slot; ///< into the material slots; the run has the geometry's slot_count entries
  std::array<uint32_t, 2> reserved;
};

static_assert(baked::kIsPod<Header> && sizeof(Header) == 384 && offsetof(Header, sections) == 48 &&
              offsetof(Header, header_hash) == 376);
static_assert(baked::kIsPod<GeometryRecord> && sizeof(GeometryRecord) == 96 &&
              offsetof(GeometryRecord, first_vertex) == 32 && offsetof(GeometryRecord, bounds_lo) == 48 &&
              offsetof(GeometryRecord, max_normal_error_degrees) == 80 && offsetof(GeometryRecord, index_bits) == 88);
static_assert(baked::kIsPod<DrawRecord> && sizeof(DrawRecord) == 32 && offsetof(DrawRecord, flags) == 20);
static_assert(baked::kIsPod<InstanceRecord> && sizeof(InstanceRecord) == 64);
static_assert(sizeof(glm::uvec4) == 16);

/// Record size of each section in bytes.
inline constexpr std::array<uint32_t, kSectionCount> kRecordBytes = {sizeof(glm::uvec4),
                                                                     sizeof(uint16_t),
                                                                     sizeof(uint32_t),
                                                                     sizeof(GeometryRecord),
                                                                     sizeof(DrawRecord),
                                                                     sizeof(InstanceRecord),
                                                                     baked::kRecordBytes[baked::kMaterialSlots],
                                                                     baked::kRecordBytes[baked::kMaterials],
                                                                     baked::kRecordBytes[baked::kMasks],
                                                                     baked::kRecordBytes[baked::kMaskWords],
                                                                     baked::kRecordBytes[baked::kTextures],
                                                                     baked::kRecordBytes[baked::kTextureBytes],
                                                                     baked::kRecordBytes[baked::kStrings]};

} // namespace packtrace::vertex16
