#include "compress/bake/clusters/geometry_encoder.h"

#include <algorithm>
#include <limits>

#include <tbb/parallel_for.h>

#include "compress/bake/clusters/renumbering.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/trees/node_groups.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

struct EncodedChunk {
  /// payload_offset is relative to the chunk; first triangles and vertices are not set
  std::vector<baked::ClusterRecord> clusters;
  std::vector<uint8_t> payload;
  std::vector<SourceVertex> sources;
  Vec3 lo{std::numeric_limits<float>::infinity()}, hi{-std::numeric_limits<float>::infinity()};
  ClusterView::StreamBits bits;
};

void add(ClusterView::StreamBits& total, const ClusterView::StreamBits& bits) {
  total.indices += bits.indices, total.positions += bits.positions, total.normals += bits.normals,
      total.uvs += bits.uvs;
}

/// Encodes a run of consecutive clusters.
class ChunkEncoder {
public:
  ChunkEncoder(const QuantizedGeometry& geometry, const GeometryClusters& clusters)
      : geometry_(geometry), all_(clusters) {
    frame_.origin = geometry.origin;
    frame_.step_mantissa = geometry.grid.mantissa;
    frame_.step_exponent = geometry.grid.exponent;
    frame_.anchor_shift = geometry.anchor_shift;
    frame_.uv_encoding = static_cast<uint8_t>(geometry.uv_encoding);
    frame_.uv_exponent = stored_uv_exponent(geometry.uv_exponent);
    frame_.normal_encoding = static_cast<uint8_t>(geometry.normal_encoding);
  }

  EncodedChunk run(std::span<const ClusterRange> clusters) {
    for (const ClusterRange& cluster : clusters) encode(cluster);
    out_.payload = writer_.bytes();
    out_.payload.resize(out_.payload.size() + kReadSlackBytes);
    for (size_t i = 0; i < clusters.size(); ++i) inspect(out_.clusters[i], geometry_.kinds[clusters[i].kind]);
    out_.payload.resize(out_.payload.size() - kReadSlackBytes);
    if (!geometry_.sources.empty())
      for (const uint32_t vertex : expected_vertices_)
        out_.sources.push_back(geometry_.sources[geometry_.vertices[vertex].position]);
    return std::move(out_);
  }

private:
  void encode(const ClusterRange& cluster) {
    const TriangleKind& kind = geometry_.kinds[cluster.kind];
    numbers_.clear(), local_triangles_.clear(), places_.clear();
    for (const Triangle& t : std::span(all_.triangles).subspan(cluster.first_triangle, cluster.triangle_count)) {
      // Sequenced x, y, z: argument order is unspecified.
      const uint32_t x = numbers_(t.x), y = numbers_(t.y), z = numbers_(t.z);
      local_triangles_.emplace_back(x, y, z);
    }
    const std::span<const uint32_t> used = numbers_.values;
    for (const uint32_t vertex : used) places_.push_back(geometry_.positions[geometry_.vertices[vertex].position]);
    if (cluster.ordered == 0) groups_.find(places_, local_triangles_);
    const std::span<const Triangle> triangles = cluster.ordered != 0 ? local_triangles_ : groups_.triangles();
    const auto vertex_count = static_cast<uint32_t>(used.size());
    const Strips strips = cluster.ordered != 0 ? strips_in_order(triangles, vertex_count)
                                               : find_strips(triangles, vertex_count, groups_.ends());

    positions_.clear(), codes_.clear(), uvs_.clear();
    for (const uint32_t local : strips.vertex_order) {
      const QuantizedVertex& v = geometry_.vertices[used[local]];
      positions_.push_back(places_[local]);
      if (!kind.flat) codes_.push_back(v.normal_code);
      if (kind.uvs) uvs_.push_back(v.uv);
    }
    const size_t offset = writer_.bytes().size();
    out_.clusters.push_back(encode_cluster({&strips, positions_, codes_, uvs_, kind.slot, geometry_.origin,
                                            geometry_.anchor_shift, geometry_.normal_encoding},
                                           writer_));
    out_.clusters.back().payload_offset = static_cast<uint32_t>(offset / 4);

    for (const uint32_t local : strips.vertex_order) expected_vertices_.push_back(used[local]);
    for (const uint32_t triangle : strips.triangle_order) {
      const Triangle& t = triangles[triangle];
      expected_triangles_.emplace_back(used[t.x], used[t.y], used[t.z]);
    }
  }

  bool same_vertex(const ClusterView& view, const TriangleKind& kind, uint32_t local, uint32_t expected) const {
    const QuantizedVertex& v = geometry_.vertices[expected];
    if (view.lattice(local) != geometry_.positions[v.position]) return false;
    if (view.has_normals() == kind.flat || view.has_uvs() != kind.uvs) return false;
    if (!kind.flat && view.normal_code(local) != v.normal_code) return false;
    return !kind.uvs || view.uv_code(local) == std::array<int64_t, 2>{v.uv[0], v.uv[1]};
  }

  /// Decodes a cluster, compares it with its input and adds it to the totals.
  void inspect(const baked::ClusterRecord& record, const TriangleKind& kind) {
    const ClusterView view(frame_, record, out_.payload.data());
    const uint32_t* vertices = expected_vertices_.data() + first_vertex_;
    bool same = true;
    for (uint32_t v = 0; v < view.vertex_count(); ++v) same &= same_vertex(view, kind, v, vertices[v]);
    std::array<Triangle, kMaxClusterTriangles> triangles;
    decode_indices(view, 0, triangles);
    for (uint32_t i = 0; i < view.triangle_count(); ++i) {
      const Triangle t(vertices[triangles[i].x], vertices[triangles[i].y], vertices[triangles[i].z]);
      const Triangle& e = expected_triangles_[first_triangle_ + i]; // may start at another corner
      same &= t == e || t == Triangle(e.y, e.z, e.x) || t == Triangle(e.z, e.x, e.y);
    }
    if (!same) throw Error(ErrorKind::kLimitExceeded, "a cluster does not decode to what was encoded");
    first_vertex_ += view.vertex_count(), first_triangle_ += view.triangle_count();

    add(out_.bits, view.stream_bits());
    std::array<Vec3, kMaxClusterVertices> positions;
    decode_positions(view, positions);
    for (uint32_t v = 0; v < view.vertex_count(); ++v)
      out_.lo = glm::min(out_.lo, positions[v]), out_.hi = glm::max(out_.hi, positions[v]);
  }

  const QuantizedGeometry& geometry_;
  const GeometryClusters& all_;
  baked::GeometryRecord frame_{};
  std::vector<uint32_t> expected_vertices_; // of all clusters, in order
  std::vector<Triangle> expected_triangles_;
  size_t first_vertex_ = 0, first_triangle_ = 0;
  // Buffers of encode(), kept between clusters to avoid allocations.
  Renumbering numbers_{kMaxClusterVertices}; // the vertices, in order of first use
  std::vector<Triangle> local_triangles_;
  std::vector<LatticePoint> places_, positions_; // by local number; by stored number
  std::vector<uint32_t> codes_;
  std::vector<UvLattice> uvs_;
  NodeGroups groups_;
  BitWriter writer_;
  EncodedChunk out_;
};

} // namespace

EncodedGeometry encode_geometry(const QuantizedGeometry& geometry, const GeometryClusters& clusters) {
  constexpr size_t kRun = 128; // clusters per task
  const size_t runs = (clusters.clusters.size() + kRun - 1) / kRun;
  std::vector<EncodedChunk> encoded(runs);
  tbb::parallel_for(size_t{0}, runs, [&](size_t i) {
    const auto all = std::span(clusters.clusters);
    encoded[i] = ChunkEncoder(geometry, clusters).run(all.subspan(i * kRun, std::min(kRun, all.size() - i * kRun)));
  });

  EncodedGeometry out;
  out.bounds_lo = Vec3(std::numeric_limits<float>::infinity());
  out.bounds_hi = -out.bounds_lo;
  for (EncodedChunk& chunk : encoded) {
    const uint64_t first_word = out.payload.size() / 4;
    if ((out.payload.size() + chunk.payload.size()) / 4 > std::numeric_limits<uint32_t>::max())
      throw Error(ErrorKind::kLimitExceeded, "the streams of one geometry exceed 16 GiB");
    for (baked::ClusterRecord& record : chunk.clusters) {
      record.payload_offset += static_cast<uint32_t>(first_word);
      record.first_triangle = out.triangle_count;
      record.first_vertex = out.vertex_count;
      out.triangle_count += record.triangle_count;
      out.vertex_count += record.vertex_count;
      ++out.class_clusters[geometry.slot_class[record.material_slot]];
      out.clusters.push_back(record);
    }
    out.payload.insert(out.payload.end(), chunk.payload.begin(), chunk.payload.end());
    out.sources.insert(out.sources.end(), chunk.sources.begin(), chunk.sources.end());
    out.bounds_lo = glm::min(out.bounds_lo, chunk.lo);
    out.bounds_hi = glm::max(out.bounds_hi, chunk.hi);
    add(out.stream_bits, chunk.bits);
    chunk = {};
  }
  return out;
}

} // namespace packtrace
