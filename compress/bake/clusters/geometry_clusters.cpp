#include "compress/bake/clusters/geometry_clusters.h"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include <tbb/parallel_for.h>

#include "compress/bake/clusters/morton.h"
#include "compress/bake/clusters/regular_blocks.h"
#include "compress/bake/clusters/repeated_parts.h"
#include "compress/bake/clusters/triangle_cutter.h"
#include "compress/bake/clusters/triangle_order.h"
#include "compress/format/layout/baked_format.h"

namespace packtrace {
namespace {

constexpr uint32_t kChunkTriangles = 1u << 15; // processed independently; clusters do not cross chunks

/// A run of triangles of one kind.
struct Chunk {
  uint32_t begin = 0, end = 0; ///< range of the sorted triangles
};

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

class GeometrySplitter {
public:
  GeometrySplitter(const QuantizedGeometry& geometry, RepeatedClusters repeated)
      : g_(geometry), rank_(rank_kinds(geometry.kinds)), keys_(sort_triangles(geometry, rank_)) {
    out_.triangles.resize(geometry.triangles.size());
    if (repeated != RepeatedClusters::kNone) take_repeated(repeated);
  }

  GeometryClusters run() {
    const std::vector<Chunk> chunks = split_into_chunks(keys_);
    std::vector<uint32_t> first_of_chunk; // in GeometryClusters::triangles
    for (const Chunk& chunk : chunks) {
      add_repeated_up_to(keys_[chunk.begin].rank);
      first_of_chunk.push_back(first_);
      first_ += chunk.end - chunk.begin;
    }
    add_repeated_up_to(static_cast<uint32_t>(rank_.size()));

    std::vector<Clusters> cut(chunks.size());
    tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t i) {
      std::vector<uint32_t> triangles;
      for (uint32_t k = chunks[i].begin; k < chunks[i].end; ++k) triangles.push_back(keys_[k].triangle);
      cut[i] = cut_triangles(g_, triangles);
      for (size_t k = 0; k < triangles.size(); ++k)
        out_.triangles[first_of_chunk[i] + k] = g_.triangles[triangles[cut[i].order[k]]];
    });
    for (size_t i = 0; i < chunks.size(); ++i) {
      first_ = first_of_chunk[i];
      for (uint32_t begin = 0; const uint32_t end : cut[i].ends) {
        add(end - begin, keys_[chunks[i].begin].triangle, 0);
        begin = end;
      }
    }
    std::ranges::sort(out_.clusters, {}, &ClusterRange::first_triangle);
    return std::move(out_);
  }

private:
  uint32_t rank_of(uint32_t triangle) const { return rank_[g_.kind_of[triangle]]; }

  /// Finds blocks and parts that repeat, by rank, and removes their triangles from keys_.
  void take_repeated(RepeatedClusters which) {
    std::vector<uint8_t> taken(g_.triangles.size(), 0);
    blocks_ = find_regular_blocks(g_, which);
    for (const RegularBlock& block : blocks_)
      for (uint32_t k = 0; k < block.triangle_count; ++k) taken[block.triangles[k]] = 1;
    parts_ = find_repeated_parts(g_, taken);
    for (const RepeatedPart& part : parts_)
      for (const uint32_t t : part.triangles) taken[t] = 1;
    std::ranges::stable_sort(blocks_, {}, [&](const RegularBlock& block) { return rank_of(block.triangles[0]); });
    std::ranges::stable_sort(parts_, {}, [&](const RepeatedPart& part) { return rank_of(part.triangles[0]); });
    std::erase_if(keys_, [&](const PlacedTriangle& key) { return taken[key.triangle] != 0; });
  }

  /// Adds a cluster of the next triangles.
  /// @param triangle one of them, in QuantizedGeometry::triangles
  void add(uint32_t count, uint32_t triangle, uint32_t ordered) {
    out_.clusters.push_back({first_, count, g_.kind_of[triangle], ordered});
    first_ += count;
  }

  /// Adds the blocks and parts of the ranks up to `last` that are not added yet. Those of a kind come before its
  /// chunks.
  void add_repeated_up_to(uint32_t last) {
    for (; next_rank_ <= last; ++next_rank_) {
      for (; next_block_ < blocks_.size() && rank_of(blocks_[next_block_].triangles[0]) == next_rank_; ++next_block_)
        add(blocks_[next_block_]);
      for (; next_part_ < parts_.size() && rank_of(parts_[next_part_].triangles[0]) == next_rank_; ++next_part_)
        add(parts_[next_part_]);
    }
  }

  void add(const RegularBlock& block) {
    for (uint32_t k = 0; k < block.triangle_count; ++k) out_.triangles[first_ + k] = block.triangle(g_, k);
    add(block.triangle_count, block.triangles[0], 1);
  }

  void add(const RepeatedPart& part) {
    uint32_t k = 0;
    for (const uint32_t end : part.ends) {
      const uint32_t count = end - k;
      for (uint32_t i = 0; i < count; ++i) out_.triangles[first_ + i] = g_.triangles[part.triangles[k + i]];
      add(count, part.triangles[k], 1);
      k = end;
    }
  }

  const QuantizedGeometry& g_;
  const std::vector<uint32_t> rank_; ///< per kind
  std::vector<PlacedTriangle> keys_; ///< of the triangles that are in no block or part
  std::vector<RegularBlock> blocks_;
  std::vector<RepeatedPart> parts_;
  GeometryClusters out_;
  uint32_t first_ = 0; ///< of the next cluster, in GeometryClusters::triangles
  uint32_t next_rank_ = 0;
  size_t next_block_ = 0, next_part_ = 0;
};

} // namespace

GeometryClusters split_geometry(const QuantizedGeometry& geometry, RepeatedClusters repeated) {
  return GeometrySplitter(geometry, repeated).run();
}

} // namespace packtrace
