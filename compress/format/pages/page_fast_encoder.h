#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/pages/page_cluster.h"
#include "compress/format/pages/page_contexts.h"
#include "compress/format/pages/page_fast_grid.h"

struct ZSTD_CCtx_s;

namespace packtrace {

/// Writes one page with codec `fast`.
class FastPageWriter {
public:
  /// Appends the page's next cluster, which must be valid.
  /// @param payload payload of the geometry
  void add(const baked::GeometryRecord& geometry, const baked::ClusterRecord& record, const uint8_t* payload);

  /// Returns the page. Nothing may be added afterwards.
  /// @param zstd compression context; its parameters are reset
  /// @param bits set to the bits per PageStream: bit fields before compression by zstd, other parts after it. Cluster
  /// headers and the sizes of parts are not included.
  std::vector<uint8_t> finish(ZSTD_CCtx_s* zstd, std::array<double, kPageStreams>& bits);

private:
  using Bytes = std::vector<uint8_t>;
  static constexpr uint32_t kCoded = page_fast::kChannels * page_fast::kChannelFields;
  struct Vertex {
    bool is_crease = false;
    uint32_t original = 0; ///< of a crease: number of an earlier vertex at the same position
    std::array<uint64_t, page_fast::kChannels> words{};
  };
  /// A residual whose value above the low bits does not fit one byte.
  struct Escape {
    uint32_t field;
    uint32_t index;
    uint64_t high; ///< all bits above the low bits
  };

  void read_vertices(const ClusterView& view);
  void find_creases(const ClusterView& view);
  bool find_grid();
  void find_neighbour(const ClusterView& view, page_fast::GridBorder border);
  void add_grid(const ClusterView& view);
  void add_topology();
  void add_corner(uint32_t vertex, bool fresh, std::array<int32_t, 3> guess);
  void add_residuals(uint32_t channel, uint32_t vertex, std::array<int32_t, 3> guess);
  void add_fields(const ClusterView& view);
  void copy_bits(const ClusterView& view, page_fast::Channel channel, uint64_t first, uint64_t count);
  void code_channel(page_fast::Channel channel);
  void put_escapes(page_fast::Channel channel);
  void put(page_fast::Channel channel, uint64_t value, uint32_t bits);
  void add_header(const baked::ClusterRecord& record);
  void count_part(uint32_t part, double part_bits, std::array<double, kPageStreams>& bits) const;

  BitWriter fields_;
  std::array<Bytes, page_fast::kParts> parts_;
  std::vector<page_fast::Header> headers_;
  std::array<double, kPageStreams> field_bits_{};
  std::array<std::array<uint64_t, page_fast::kChannels>, page_fast::kClasses> residual_counts_{};

  const baked::GeometryRecord* geometry_ = nullptr;
  baked::ClusterRecord last_{};
  uint64_t last_diagonals_ = 0; ///< of the page's last grid cluster
  page_fast::GridBorders borders_;
  /// Per kind of border: the first two points of a border that later grid clusters can share, and the number of grid
  /// clusters of the page up to the newest one that has it.
  std::array<std::map<std::array<LatticePoint, 2>, size_t>, page_fast::kGridBorders> newest_at_;

  // State of the current cluster.
  page_fast::Header header_{};
  page_fast::GridBorders::Frames frames_;
  std::unique_ptr<ClusterValues> values_ = std::make_unique<ClusterValues>();
  bool is_grid_ = false; ///< the strips are those of block_
  GridBlock block_;
  GridStrips strips_;
  std::array<uint64_t, page_fast::kChannels> prefix_bit_{}, prefix_bits_{};
  std::vector<Vertex> vertices_;
  uint32_t last_reused_ = 0;
  std::array<std::vector<uint64_t>, kCoded> residuals_; ///< zigzag codes
  std::vector<Escape> escapes_;
};

} // namespace packtrace
