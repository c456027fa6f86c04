#pragma once

#include <array>
#include <cstdint>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/cluster/normal_packing.h"
#include "compress/format/layout/payload_writer.h"

namespace packtrace {

/// How a triangle is reached; the values are part of the disk form.
enum class Turn : uint8_t { kRight = 0, kLeft = 1, kRestart = 2 };

/// What one cluster holds, as values: all that its record and bit streams say, and nothing of how they say it.
struct ClusterValues {
  uint32_t triangle_count = 0, vertex_count = 0, restart_count = 0;
  uint32_t material = 0; ///< slot
  bool has_normals = false, has_uvs = false;
  std::array<Turn, kMaxClusterTriangles> turns;
  uint32_t corner_count = 0;
  std::array<uint16_t, kMaxClusterCorners> corners; ///< the corner list (index_codec.h)
  std::array<LatticePoint, kMaxClusterVertices> positions;
  uint32_t normal_chart = 0;   ///< that pack_normals() takes
  bool normal_palette = false; ///< distinct normals are stored once
  std::array<NormalFields, kMaxClusterVertices> normals;
  std::array<UvLattice, kMaxClusterVertices> uvs;
};

/// The values of a valid cluster. Clusters that encode_cluster() wrote come back from them, bit for bit.
void unpack_cluster(const ClusterView& view, ClusterValues& values);

/// Appends the resident form of clusters to a buffer of fixed size, byte for byte as encode_cluster() does.
class ClusterPacker {
public:
  /// Starts over with a buffer for `bytes` bytes.
  void begin(size_t bytes) { payload_.begin(bytes); }

  /// The record without payload_offset, first_triangle and first_vertex. Returns false, having written nothing, where
  /// the values cannot be those of a valid cluster of this geometry, or do not fit the buffer.
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
  uint32_t palette_count_ = 0;                             // 0: none
  std::array<NormalFields, kMaxClusterVertices> palette_;  // distinct, by code
  std::array<uint8_t, kMaxClusterVertices> palette_entry_; // per vertex
  UvLattice uv_lo_{};
  std::array<uint32_t, 2> uv_bits_{};
};

} // namespace packtrace
