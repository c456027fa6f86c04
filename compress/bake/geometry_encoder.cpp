#include "compress/bake/geometry_encoder.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <tuple>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "compress/bake/clusterize.h"
#include "compress/bake/weld_table.h"
#include "compress/format/bit_stream.h"
#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kChunkTriangles = 1u << 14; // worked on alone; clusters do not cross chunks
constexpr uint32_t kMortonBits = 21;           // per axis

/// Every third bit.
constexpr uint64_t spread(uint64_t x) {
  x = (x | (x << 32)) & 0x001f00000000ffffu;
  x = (x | (x << 16)) & 0x001f0000ff0000ffu;
  x = (x | (x << 8)) & 0x100f00f00f00f00fu;
  x = (x | (x << 4)) & 0x10c30c30c30c30c3u;
  return (x | (x << 2)) & 0x1249249249249249u;
}

struct SortKey {
  uint32_t rank; ///< of the kind
  uint32_t triangle;
  uint64_t morton;
  bool operator<(const SortKey& other) const {
    return std::tie(rank, morton, triangle) < std::tie(other.rank, other.morton, other.triangle);
  }
};

/// A run of one kind's triangles.
struct Chunk {
  uint32_t begin = 0, end = 0; ///< of the sorted triangles
};

struct EncodedChunk {
  std::vector<baked::ClusterRecord> clusters; ///< payload_offset from the chunk's start, firsts not set
  std::vector<uint8_t> payload;
  Vec3 lo{std::numeric_limits<float>::infinity()}, hi{-std::numeric_limits<float>::infinity()};
  ClusterView::StreamBits bits;
};

void add(ClusterView::StreamBits& total, const ClusterView::StreamBits& bits) {
  total.indices += bits.indices, total.positions += bits.positions, total.normals += bits.normals,
      total.uvs += bits.uvs;
}

/// Numbers the values of a chunk 0, 1, ...; numbers of other chunks' values do not matter to it.
class Renumbering {
public:
  explicit Renumbering(size_t capacity) : table_(capacity) {}
  uint32_t operator()(uint32_t value) {
    const auto next = static_cast<uint32_t>(values.size());
    const uint32_t number =
        table_.find_or_add(mix_words(value, 0), next, [&](uint32_t other) { return values[other] == value; });
    if (number == next) values.push_back(value);
    return number;
  }
  std::vector<uint32_t> values;

private:
  WeldTable table_;
};

class ChunkEncoder {
public:
  ChunkEncoder(const QuantizedGeometry& geometry, std::span<const SortKey> triangles)
      : geometry_(geometry), triangles_(triangles), kind_(geometry.kinds[geometry.kind_of[triangles[0].triangle]]),
        vertex_numbers_(3 * triangles.size()) {
    frame_.origin = geometry.origin;
    frame_.step_mantissa = geometry.grid.mantissa;
    frame_.step_exponent = geometry.grid.exponent;
    frame_.anchor_shift = geometry.anchor_shift;
    frame_.uv_encoding = static_cast<uint32_t>(geometry.uv_encoding);
    frame_.uv_exponent = geometry.uv_exponent;
    frame_.normal_encoding = static_cast<uint32_t>(geometry.normal_encoding);
  }

  EncodedChunk run() {
    const Clusters clusters = split();
    uint32_t begin = 0;
    for (const uint32_t end : clusters.ends) {
      encode({clusters.order.data() + begin, end - begin});
      begin = end;
    }
    out_.payload = writer_.bytes();
    out_.payload.resize(out_.payload.size() + kReadSlackBytes);
    for (const baked::ClusterRecord& record : out_.clusters) inspect(record);
    out_.payload.resize(out_.payload.size() - kReadSlackBytes);
    return std::move(out_);
  }

private:
  Clusters split() {
    corners_.reserve(triangles_.size());
    Renumbering point_numbers(3 * triangles_.size());
    std::vector<Triangle> points;
    std::vector<DVec3> centroids;
    points.reserve(triangles_.size()), centroids.reserve(triangles_.size());
    for (const SortKey& key : triangles_) {
      const Triangle& t = geometry_.triangles[key.triangle];
      Triangle vertex{}, point{};
      DVec3 sum(0.0);
      for (int corner = 0; corner < 3; ++corner) {
        vertex[corner] = vertex_numbers_(t[corner]);
        const uint32_t position = geometry_.vertices[t[corner]].position;
        point[corner] = point_numbers(position);
        for (int axis = 0; axis < 3; ++axis) {
          const auto i = static_cast<size_t>(axis);
          sum[axis] += static_cast<double>(geometry_.positions[position][i] - geometry_.origin[i]);
        }
      }
      corners_.push_back(vertex), points.push_back(point), centroids.push_back(sum);
    }
    return clusterize({corners_, points, centroids, static_cast<uint32_t>(vertex_numbers_.values.size()),
                       static_cast<uint32_t>(point_numbers.values.size())});
  }

  void encode(std::span<const uint32_t> members) {
    // Vertices get numbers within the cluster by a short search: at most 256 of them.
    local_.resize(vertex_numbers_.values.size(), 0);
    std::vector<uint32_t> used;
    std::vector<Triangle> local_triangles;
    for (const uint32_t member : members) {
      Triangle t{};
      for (int corner = 0; corner < 3; ++corner) {
        const uint32_t number = corners_[member][corner];
        uint32_t& local = local_[number];
        if (local >= used.size() || used[local] != number)
          local = static_cast<uint32_t>(used.size()), used.push_back(number);
        t[corner] = local;
      }
      local_triangles.push_back(t);
    }
    const Strips strips = find_strips(local_triangles, static_cast<uint32_t>(used.size()));

    std::vector<LatticePoint> positions;
    std::vector<uint32_t> codes;
    std::vector<UvLattice> uvs;
    for (const uint32_t local : strips.vertex_order) {
      const QuantizedVertex& v = geometry_.vertices[vertex_numbers_.values[used[local]]];
      positions.push_back(geometry_.positions[v.position]);
      if (!kind_.flat) codes.push_back(v.normal_code);
      if (kind_.uvs) uvs.push_back(v.uv);
    }
    const size_t offset = writer_.bytes().size();
    out_.clusters.push_back(encode_cluster({&strips, positions, codes, uvs, kind_.slot, geometry_.origin,
                                            geometry_.anchor_shift, geometry_.normal_encoding},
                                           writer_));
    out_.clusters.back().payload_offset = static_cast<uint32_t>(offset / 4);

    const auto vertex = [&](uint32_t local) { return vertex_numbers_.values[used[local]]; };
    for (const uint32_t local : strips.vertex_order) expected_vertices_.push_back(vertex(local));
    for (const uint32_t triangle : strips.triangle_order) {
      const Triangle& t = local_triangles[triangle];
      expected_triangles_.emplace_back(vertex(t.x), vertex(t.y), vertex(t.z));
    }
  }

  bool same_vertex(const ClusterView& view, uint32_t local, uint32_t expected) const {
    const QuantizedVertex& v = geometry_.vertices[expected];
    if (view.lattice(local) != geometry_.positions[v.position]) return false;
    if (view.has_normals() == kind_.flat || view.has_uvs() != kind_.uvs) return false;
    if (!kind_.flat && view.normal_code(local) != v.normal_code) return false;
    return !kind_.uvs || view.uv_code(local) == std::array<int64_t, 2>{v.uv[0], v.uv[1]};
  }

  /// Decodes a cluster, compares it with what went in, and adds to the totals.
  void inspect(const baked::ClusterRecord& record) {
    const ClusterView view(frame_, record, out_.payload.data());
    const uint32_t* vertices = expected_vertices_.data() + first_vertex_;
    bool same = true;
    for (uint32_t v = 0; v < view.vertex_count(); ++v) same &= same_vertex(view, v, vertices[v]);
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
  std::span<const SortKey> triangles_;
  TriangleKind kind_;
  baked::GeometryRecord frame_{};
  Renumbering vertex_numbers_;
  std::vector<Triangle> corners_;           // per triangle of the chunk, renumbered
  std::vector<uint32_t> local_;             // vertex -> number in the cluster last encoded with it
  std::vector<uint32_t> expected_vertices_; // of all clusters, in order
  std::vector<Triangle> expected_triangles_;
  size_t first_vertex_ = 0, first_triangle_ = 0;
  BitWriter writer_;
  EncodedChunk out_;
};

/// Rank of each kind: slots, which are ordered by class, so that classes are contiguous.
std::vector<uint32_t> rank_kinds(const std::vector<TriangleKind>& kinds) {
  std::vector<uint32_t> order(kinds.size()), rank(kinds.size());
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto key = [&](uint32_t i) {
    const TriangleKind& k = kinds[i];
    return std::tuple(k.slot, k.flat, k.uvs);
  };
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
  for (uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  return rank;
}

std::vector<SortKey> sort_triangles(const QuantizedGeometry& geometry, const std::vector<uint32_t>& rank) {
  int64_t extent = 0;
  for (const LatticePoint& p : geometry.positions)
    for (size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, p[axis] - geometry.origin[axis]);
  const auto bits = static_cast<uint32_t>(std::bit_width(static_cast<uint64_t>(extent) * 3)); // of a sum of corners
  const uint32_t shift = bits > kMortonBits ? bits - kMortonBits : 0;

  std::vector<SortKey> keys(geometry.triangles.size());
  tbb::parallel_for(size_t{0}, keys.size(), [&](size_t i) {
    uint64_t morton = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      uint64_t sum = 0;
      for (int corner = 0; corner < 3; ++corner) {
        const QuantizedVertex& v = geometry.vertices[geometry.triangles[i][corner]];
        sum += static_cast<uint64_t>(geometry.positions[v.position][axis] - geometry.origin[axis]);
      }
      morton |= spread(sum >> shift) << axis;
    }
    keys[i] = {rank[geometry.kind_of[i]], static_cast<uint32_t>(i), morton};
  });
  tbb::parallel_sort(keys.begin(), keys.end());
  return keys;
}

/// Chunks of nearly equal size, each of one kind.
std::vector<Chunk> split_into_chunks(std::span<const SortKey> keys) {
  std::vector<Chunk> chunks;
  for (size_t begin = 0; begin < keys.size();) {
    size_t end = begin;
    while (end < keys.size() && keys[end].rank == keys[begin].rank) ++end;
    const size_t count = (end - begin + kChunkTriangles - 1) / kChunkTriangles;
    for (size_t i = 0; i < count; ++i)
      chunks.push_back({static_cast<uint32_t>(begin + (end - begin) * i / count),
                        static_cast<uint32_t>(begin + (end - begin) * (i + 1) / count)});
    begin = end;
  }
  return chunks;
}

} // namespace

EncodedGeometry encode_geometry(const QuantizedGeometry& geometry) {
  const std::vector<SortKey> keys = sort_triangles(geometry, rank_kinds(geometry.kinds));
  const std::vector<Chunk> chunks = split_into_chunks(keys);
  std::vector<EncodedChunk> encoded(chunks.size());
  tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t i) {
    encoded[i] =
        ChunkEncoder(geometry, std::span(keys).subspan(chunks[i].begin, chunks[i].end - chunks[i].begin)).run();
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
    out.bounds_lo = glm::min(out.bounds_lo, chunk.lo);
    out.bounds_hi = glm::max(out.bounds_hi, chunk.hi);
    add(out.stream_bits, chunk.bits);
    chunk = {};
  }
  return out;
}

} // namespace packtrace
