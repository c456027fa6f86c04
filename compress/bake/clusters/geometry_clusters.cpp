#include "compress/bake/clusters/geometry_clusters.h"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include <tbb/parallel_for.h>

#include "compress/bake/clusters/cluster_cutter.h"
#include "compress/bake/clusters/morton.h"
#include "compress/bake/clusters/regular_blocks.h"
#include "compress/bake/clusters/renumbering.h"
#include "compress/bake/clusters/triangle_order.h"
#include "compress/format/layout/baked_format.h"

namespace packtrace {
namespace {

constexpr uint32_t kChunkTriangles = 1u << 15; // processed independently; clusters do not cross chunks

/// A run of triangles of one kind.
struct Chunk {
  uint32_t begin = 0, end = 0; ///< range of the sorted triangles
};

/// Splits a chunk of sorted triangles into clusters. Their `order` indexes the chunk.
Clusters split_chunk(const QuantizedGeometry& geometry, std::span<const PlacedTriangle> keys) {
  Renumbering vertex_numbers(keys.size());
  std::vector<Triangle> vertices;
  std::vector<TreeBox> boxes;
  vertices.reserve(keys.size()), boxes.reserve(keys.size());
  for (const PlacedTriangle& key : keys) {
    const Triangle& t = geometry.triangles[key.triangle];
    Triangle vertex{};
    for (int corner = 0; corner < 3; ++corner) {
      vertex[corner] = vertex_numbers(t[corner]);
      const LatticePoint& position = geometry.positions[geometry.vertices[t[corner]].position];
      TreeBox point;
      for (size_t axis = 0; axis < 3; ++axis)
        point.lo[axis] = point.hi[axis] = static_cast<float>(position[axis] - geometry.origin[axis]);
      corner == 0 ? boxes.push_back(point) : boxes.back().extend(point);
    }
    vertices.push_back(vertex);
  }
  return cut_clusters(boxes, vertices, static_cast<uint32_t>(vertex_numbers.values.size()));
}

/// Ranks the kinds by slot first. Slots are ordered by class, so the triangles of a class are contiguous.
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

std::vector<PlacedTriangle> sort_triangles(const QuantizedGeometry& geometry, const std::vector<uint32_t>& rank) {
  int64_t extent = 0;
  for (const LatticePoint& p : geometry.positions)
    for (size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, p[axis] - geometry.origin[axis]);
  // Bits of the sum of three corners.
  const auto bits = static_cast<uint32_t>(std::bit_width(static_cast<uint64_t>(extent) * 3));
  const uint32_t shift = bits > kMortonBits ? bits - kMortonBits : 0;

  std::vector<PlacedTriangle> keys(geometry.triangles.size());
  tbb::parallel_for(size_t{0}, keys.size(), [&](size_t i) {
    std::array<uint64_t, 3> place{};
    for (size_t axis = 0; axis < 3; ++axis) {
      uint64_t sum = 0;
      for (int corner = 0; corner < 3; ++corner) {
        const QuantizedVertex& v = geometry.vertices[geometry.triangles[i][corner]];
        sum += static_cast<uint64_t>(geometry.positions[v.position][axis] - geometry.origin[axis]);
      }
      place[axis] = sum >> shift;
    }
    keys[i] = {morton_code(place[0], place[1], place[2]), static_cast<uint32_t>(i), rank[geometry.kind_of[i]]};
  });
  sort_by_place(keys, static_cast<uint32_t>(rank.size()));
  return keys;
}

/// Splits the sorted triangles into chunks of one kind and nearly equal size.
std::vector<Chunk> split_into_chunks(std::span<const PlacedTriangle> keys) {
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

GeometryClusters split_geometry(const QuantizedGeometry& geometry, GridBlocks grid_blocks) {
  const std::vector<uint32_t> rank = rank_kinds(geometry.kinds);
  const auto rank_of = [&](uint32_t triangle) { return rank[geometry.kind_of[triangle]]; };
  std::vector<RegularBlock> blocks;
  if (grid_blocks != GridBlocks::kNone) blocks = find_regular_blocks(geometry, grid_blocks);
  std::ranges::stable_sort(blocks, {}, [&](const RegularBlock& block) { return rank_of(block.triangles[0]); });
  std::vector<PlacedTriangle> keys = sort_triangles(geometry, rank);
  if (!blocks.empty()) {
    std::vector<uint8_t> in_block(geometry.triangles.size(), 0);
    for (const RegularBlock& block : blocks)
      for (uint32_t k = 0; k < block.triangle_count; ++k) in_block[block.triangles[k]] = 1;
    std::erase_if(keys, [&](const PlacedTriangle& key) { return in_block[key.triangle] != 0; });
  }
  const std::vector<Chunk> chunks = split_into_chunks(keys);

  GeometryClusters result;
  result.triangles.resize(geometry.triangles.size());
  uint32_t first = 0; // index in result.triangles
  const auto add = [&](uint32_t count, uint32_t kind, uint32_t regular) {
    result.clusters.push_back({first, count, kind, regular});
    first += count;
  };
  size_t next_block = 0;
  const auto add_blocks_up_to = [&](uint32_t last_rank) {
    for (; next_block < blocks.size() && rank_of(blocks[next_block].triangles[0]) <= last_rank; ++next_block) {
      const RegularBlock& block = blocks[next_block];
      for (uint32_t k = 0; k < block.triangle_count; ++k) result.triangles[first + k] = block.triangle(geometry, k);
      add(block.triangle_count, geometry.kind_of[block.triangles[0]], 1);
    }
  };
  // Reserve the range of every chunk. The blocks of a kind come before its chunks.
  std::vector<uint32_t> first_of_chunk;
  for (const Chunk& chunk : chunks) {
    add_blocks_up_to(keys[chunk.begin].rank);
    first_of_chunk.push_back(first);
    first += chunk.end - chunk.begin;
  }
  add_blocks_up_to(static_cast<uint32_t>(rank.size()));

  std::vector<Clusters> split(chunks.size());
  tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t i) {
    const std::span<const PlacedTriangle> part =
        std::span(keys).subspan(chunks[i].begin, chunks[i].end - chunks[i].begin);
    split[i] = split_chunk(geometry, part);
    for (size_t k = 0; k < part.size(); ++k)
      result.triangles[first_of_chunk[i] + k] = geometry.triangles[part[split[i].order[k]].triangle];
  });
  for (size_t i = 0; i < chunks.size(); ++i) {
    first = first_of_chunk[i];
    for (uint32_t begin = 0; const uint32_t end : split[i].ends) {
      add(end - begin, geometry.kind_of[keys[chunks[i].begin].triangle], 0);
      begin = end;
    }
  }
  std::ranges::sort(result.clusters, {}, &ClusterRange::first_triangle);
  return result;
}

} // namespace packtrace
