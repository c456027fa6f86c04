#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/bake/clusters/regular_blocks.h"
#include "compress/format/cluster/grid_block.h"

namespace packtrace {

/// A triangle's place in a grid of quads.
struct GridPlace {
  int32_t i = 0, j = 0; ///< column and row of its quad
  bool upper = false;
  uint8_t diagonal = 0; ///< of its quad
  uint8_t first = 0;    ///< number of the triangle's corner that is corner 0 of the QuadTriangle

  const QuadTriangle& shape() const { return kQuadTriangles[diagonal][upper ? 1 : 0]; }
  /// Returns the triangle's vertex at a corner of shape(); corners 3 to 5 are 0 to 2 again.
  uint32_t vertex(const Triangle& t, uint32_t corner) const { return t[static_cast<int>((first + corner) % 3)]; }
};

/// Squared length of the edge between two vertices, lattice steps.
double squared_edge(const QuantizedGeometry& geometry, uint32_t from, uint32_t to);

/// Returns the mean squared length of the edges along rows, along columns, and of the diagonals.
/// @param places per triangle of the geometry, valid for those of the part
std::array<double, 3> mean_squared_edges(const QuantizedGeometry& geometry, std::span<const uint32_t> part,
                                         std::span<const GridPlace> places);

/// Cuts connected parts of grids into blocks of equal size.
class BlockCutter {
public:
  /// @param places per triangle of the geometry, read by cut(); both must outlive this object
  /// @param which kMany or kMost
  BlockCutter(const QuantizedGeometry& geometry, const std::vector<GridPlace>& places, RepeatedClusters which);

  /// Appends the blocks of a part, unless they would hold too few of its triangles.
  /// @param part its triangles; their places must be valid
  /// @param alternating whether the diagonals alternate, with diagonal 0 where column + row is even
  void cut(std::span<const uint32_t> part, bool alternating, std::vector<RegularBlock>& blocks);

private:
  /// How parts are cut into blocks.
  struct Rule {
    double min_share;    ///< minimum share of a part's triangles in blocks
    double rest_cost;    ///< cost of a triangle outside all blocks
    int32_t small_quads; ///< number of quads of a small block; 0: no small blocks
  };

  struct Size {
    int32_t columns, rows;

    int32_t quads() const { return columns * rows; }
    int32_t points() const { return (columns + 1) * (rows + 1); }
  };

  static Rule rule_of(RepeatedClusters which);
  bool place_part();
  void sum_full_quads();
  std::optional<Size> choose_size() const;
  std::optional<Size> choose_offset(Size size) const;
  template <class Use>
  void for_each_full_block(Size offset, Size size, const Use& use) const;
  bool has_grid_vertices(int32_t x, int32_t y, Size size) const;
  RegularBlock block_at(int32_t x, int32_t y, Size size) const;

  /// Returns the diagonal of the cell; 0 if diagonals do not alternate.
  uint8_t diagonal(int32_t x, int32_t y) const {
    return alternating_ ? static_cast<uint8_t>(static_cast<uint32_t>(lowest_[0] + x + lowest_[1] + y) & 1u)
                        : uint8_t{0};
  }
  size_t cell_of(int32_t x, int32_t y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(area_.columns) + static_cast<size_t>(x);
  }

  const QuantizedGeometry& geometry_;
  const std::vector<GridPlace>& places_;
  const Rule rule_;
  std::span<const uint32_t> part_; ///< that is being cut
  bool alternating_ = false;
  std::array<int32_t, 2> lowest_{};            ///< least column and row of the part
  Size area_{};                                ///< of the part; cell (x, y) is quad lowest_ + (x, y)
  std::vector<std::array<uint32_t, 2>> quads_; ///< per cell: lower and upper triangle
  std::vector<uint32_t> full_;                 ///< see sum_full_quads()
};

} // namespace packtrace
