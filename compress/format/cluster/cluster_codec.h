#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "compress/format/cluster/index_codec.h"
#include "compress/format/cluster/normal_codec.h"
#include "compress/format/cluster/position_grid.h"
#include "compress/format/cluster/uv_codec.h"
#include "compress/format/layout/baked_format.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Random access to one cluster. Construction decodes nothing, and no function allocates. Valid as long as the
/// underlying bytes, which must have been validated (BakedFile does so). Vertex and triangle numbers are local: 0-based
/// within the cluster. The winding of a triangle matches its geometric normal.
class ClusterView {
public:
  /// @param payload the geometry's payload, followed by 8 readable bytes
  ClusterView(const baked::GeometryRecord& geometry, const baked::ClusterRecord& cluster, const uint8_t* payload);

  uint32_t triangle_count() const { return layout_.triangle_count; }
  uint32_t vertex_count() const { return layout_.vertex_count; }
  uint32_t material_slot() const { return record_->material_slot; }
  bool has_normals() const { return (record_->flags & baked::kClusterHasNormals) != 0; }
  bool has_uvs() const { return (record_->flags & baked::kClusterHasUvs) != 0; }

  /// Three local vertex numbers.
  Triangle triangle(uint32_t index) const { return decode_triangle(bits_, layout_, index); }
  /// Position in object space.
  Vec3 position(uint32_t vertex) const;
  /// Lattice coordinates in steps from the lattice's zero.
  LatticePoint lattice(uint32_t vertex) const;
  /// Unit normal in object space. Needs has_normals().
  Vec3 normal(uint32_t vertex) const;
  /// Canonical fields of normal_encoding(). Needs has_normals().
  NormalFields normal_fields(uint32_t vertex) const;
  uint32_t normal_code(uint32_t vertex) const { return join_normal_code(normal_encoding_, normal_fields(vertex)); }
  NormalEncoding normal_encoding() const { return normal_encoding_; } ///< of the geometry
  /// Needs has_uvs().
  Vec2 uv(uint32_t vertex) const;
  /// Stored codes of u and v in the geometry's encoding. Needs has_uvs().
  std::array<int64_t, 2> uv_code(uint32_t vertex) const;

  /// Object-space box that contains every vertex, computed from the record alone. It spans 2^position_bits lattice
  /// points per axis, so its extent is up to about twice that of the vertices.
  void bounds(Vec3& lo, Vec3& hi) const;

  /// Payload bits per stream.
  struct StreamBits {
    uint64_t indices = 0, positions = 0, normals = 0, uvs = 0;
    uint64_t total() const { return indices + positions + normals + uvs; }
  };
  StreamBits stream_bits() const;

  const baked::ClusterRecord& record() const { return *record_; }
  const uint8_t* bits() const { return bits_; }
  const IndexLayout& layout() const { return layout_; }

private:
  friend void decode_positions(const ClusterView&, std::span<Vec3>);
  friend void decode_normals(const ClusterView&, std::span<Vec3>);

  /// @param entry a vertex, or with a palette one of its entries
  NormalFields normal_entry(uint32_t entry) const;
  void decode_normal_entries(uint32_t count, std::span<Vec3> out) const;

  const baked::ClusterRecord* record_;
  const uint8_t* bits_;
  IndexLayout layout_;
  LatticePoint base_; ///< lattice point of a vertex whose fields are 0
  double step_;
  UvDecoder u_decoder_, v_decoder_;
  NormalEncoding normal_encoding_;
  uint32_t normal_stride_;   ///< bits per vertex or palette entry
  uint32_t position_stride_; ///< bits per vertex
  uint32_t position_bit_, normal_bit_, uv_bit_;
};

/// Decodes the object-space positions of all vertices; out.size() >= vertex_count().
void decode_positions(const ClusterView& cluster, std::span<Vec3> out);
/// Decodes all triangles and adds `base` to each index; out.size() >= triangle_count().
void decode_indices(const ClusterView& cluster, uint32_t base, std::span<Triangle> out);
/// Decodes the unit normals of all vertices; out.size() >= vertex_count(). Needs has_normals().
void decode_normals(const ClusterView& cluster, std::span<Vec3> out);
/// Decodes the texture coordinates of all vertices; out.size() >= vertex_count(). Needs has_uvs().
void decode_uvs(const ClusterView& cluster, std::span<Vec2> out);

/// Returns the fault of a record or its payload, or nothing. Checks everything that ClusterView relies on, that all
/// coordinates stay within the lattice, and that all positions are finite.
/// @param payload_bytes size of the geometry's payload; 8 more bytes are readable
std::optional<std::string_view> find_cluster_fault(const baked::GeometryRecord& geometry,
                                                   const baked::ClusterRecord& cluster, const uint8_t* payload,
                                                   uint64_t payload_bytes);

/// One cluster to encode. Vertices are in the order of strips.vertex_order.
struct ClusterInput {
  const Strips* strips = nullptr;
  std::span<const LatticePoint> positions;
  std::span<const uint32_t> normal_codes; ///< empty if the cluster has no normals
  std::span<const UvLattice> uvs;         ///< empty if the cluster has no texture coordinates
  uint32_t material_slot = 0;
  LatticePoint origin{};                                    ///< of the geometry
  uint32_t anchor_shift = 0;                                ///< of the geometry
  NormalEncoding normal_encoding = NormalEncoding::kAxis24; ///< of normal_codes
};

/// Appends the payload, padded to 4 bytes, and returns the record. payload_offset, first_triangle and first_vertex are
/// 0; the caller sets them. Needs |coordinate| <= kMaxLattice, and (coordinate - origin) >> anchor_shift within
/// int32_t.
baked::ClusterRecord encode_cluster(const ClusterInput& input, BitWriter& writer);

} // namespace packtrace
