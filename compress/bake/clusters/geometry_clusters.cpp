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

GeometryClusters split_geometry(const QuantizedGeometry& geometry, bool equal_blocks) {
  const std::vector<uint32_t> rank = rank_kinds(geometry.kinds);
  const auto rank_of = [&](uint32_t triangle) { return rank[geometry.kind_of[triangle]]; };
  std::vector<RegularBlock> blocks;
  if (equal_blocks) blocks = find_regular_blocks(geometry);
  std::ranges::stable_sort(blocks, {}, [&](const RegularBlock& block) { return rank_of(block.triangles[0]); });
  std::vector<PlacedTriangle> keys = sort_triangles(geometry, rank);
  if (!blocks.empty()) {
    std::vector<uint8_t> in_block(geometry.triangles.size(), 0);
    for (const RegularBlock& block : blocks)
      for (uint32_t k = 0; k < block.triangle_count; ++k) in_block[block.triangles[k]] = 1;
    std::erase_if(keys, [&](const PlacedTriangle& key) { return in_block[key.triangle] != 0; });
  }
  const std::vector<Chunk> chunks = split_into_chunks(keys);
  std::vector<Clusters> split(chunks.size());
  std::vector<Triangle> rest(keys.size());
  tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t i) {
    const Chunk& chunk = chunks[i];
    split[i] = split_chunk(geometry, std::span(keys).subspan(chunk.begin, chunk.end - chunk.begin));
    for (uint32_t k = 0; k < chunk.end - chunk.begin; ++k)
      rest[chunk.begin + k] = geometry.triangles[keys[chunk.begin + split[i].order[k]].triangle];
  });

  GeometryClusters result;
  result.triangles.reserve(geometry.triangles.size());
  const auto add = [&](std::span<const Triangle> triangles, uint32_t kind, uint32_t regular) {
    const auto first = static_cast<uint32_t>(result.triangles.size());
    result.triangles.insert(result.triangles.end(), triangles.begin(), triangles.end());
    result.clusters.push_back({first, static_cast<uint32_t>(triangles.size()), kind, regular});
  };
  size_t block = 0;
  const auto add_blocks_up_to = [&](uint32_t last_rank) {
    for (; block < blocks.size() && rank_of(blocks[block].triangles[0]) <= last_rank; ++block) {
      std::array<Triangle, kMaxClusterTriangles> triangles;
      const uint32_t count = blocks[block].triangle_count;
      for (uint32_t k = 0; k < count; ++k) triangles[k] = blocks[block].triangle(geometry, k);
      add(std::span(triangles).first(count), geometry.kind_of[blocks[block].triangles[0]], 1);
    }
  };
  for (size_t i = 0; i < chunks.size(); ++i) {
    const uint32_t first = keys[chunks[i].begin].triangle;
    add_blocks_up_to(rank_of(first));
    for (uint32_t begin = 0; const uint32_t end : split[i].ends) {
      add(std::span(rest).subspan(chunks[i].begin + begin, end - begin), geometry.kind_of[first], 0);
      begin = end;
    }
  }
  add_blocks_up_to(static_cast<uint32_t>(rank.size()));
  return result;
}

} // namespace packtrace
