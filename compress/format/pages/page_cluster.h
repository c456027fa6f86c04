#pragma once

#include <array>
#include <cstdint>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/cluster/normal_packing.h"
#include "compress/format/layout/payload_writer.h"

namespace packtrace {

/// Direction in which a strip reaches a triangle. The values are part of the disk form.
enum class Turn : uint8_t { kRight = 0, kLeft = 1, kRestart = 2 };

/// Decoded values of one cluster, independent of their encoding in its record and bit streams.
struct ClusterValues {
  uint32_t triangle_count = 0, vertex_count = 0, strip_count = 0;
  uint32_t material = 0; ///< material slot
  bool has_normals = false, has_uvs = false;
  std::array<Turn, kMaxClusterTriangles> turns;
  uint32_t corner_count = 0;
  std::array<uint16_t, kMaxClusterCorners> corners; ///< the corner list (index_codec.h)
  std::array<LatticePoint, kMaxClusterVertices> positions;
  uint32_t normal_chart = 0;   ///< the `chart` argument of pack_normals()
  bool normal_palette = false; ///< the cluster uses a palette of distinct normals
  std::array<NormalFields, kMaxClusterVertices> normals;
  std::array<UvLattice, kMaxClusterVertices> uvs;
};

/// Reads the values of a valid cluster. For clusters that encode_cluster() wrote, ClusterPacker restores the same bits
/// from them.
void unpack_cluster(const ClusterView& view, ClusterValues& values);

/// Appends clusters in resident form to a buffer of fixed size, with the same bytes as encode_cluster().
class ClusterPacker {
public:
  /// Starts a new buffer of `bytes` bytes.
  void begin(size_t bytes) { payload_.begin(bytes); }

  /// Appends a cluster and fills in its record, except payload_offset, first_triangle and first_vertex. Returns false
  /// and writes nothing if the values cannot be those of a valid cluster of this geometry or do not fit the buffer.
  bool append(const baked::GeometryRecord& geometry, const ClusterValues& values, baked::ClusterRecord& record);

  size_t size() const { return payload_.size(); }
  const uint8_t* data() const { return payload_.data(); }

private:
  bool plan_positions(const baked::GeometryRecord& geometry, const ClusterValues& values, baked::ClusterRecord& record);
  bool plan_normals(const baked::GeometryRecord& geometry, const ClusterValues& values, baked::ClusterRecord& record);
  void find_palette(const ClusterValues& values);
  bool plan_uvs(const ClusterValues& values, baked::ClusterRecord& record);
  void put_strips(const ClusterValues& values, const IndexLayout& layout);
  void put_normals(const ClusterValues& values);
  void put_positions(const ClusterValues& values, const baked::ClusterRecord& record);
  void put_uvs(const ClusterValues& values);

  PayloadWriter payload_;
  LatticePoint base_{};
  NormalEncoding encoding_{};
  NormalPacking normals_;
  uint32_t palette_count_ = 0;                             // 0: no palette
  std::array<NormalFields, kMaxClusterVertices> palette_;  // distinct normals, ordered by code
  std::array<uint8_t, kMaxClusterVertices> palette_entry_; // palette index per vertex
  UvLattice uv_lo_{};
  std::array<uint32_t, 2> uv_bits_{};
};

} // namespace packtrace
