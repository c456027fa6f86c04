#include "compress/bake/clusters/block_cutter.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace packtrace {
namespace {

constexpr uint32_t kEmpty = ~0u; // no triangle, no vertex
constexpr int32_t kBlockQuads = kMaxGridQuads;
constexpr int32_t kMaxBlockColumns = 32;
constexpr double kMaxElongation = 2.5; ///< maximum ratio of a block's sides, from mean edge lengths
constexpr double kBlockCost = 8.0;     ///< cost of a block apart from its vertices; a vertex costs 1
/// Fewer blocks than kFewBlocks must fill their part. Exactly kFewBlocks must hold kMinShareOfFew of its triangles.
constexpr size_t kFewBlocks = 4;
constexpr double kMinShareOfFew = 0.6;
/// Factor of the cost where the number of columns is not a power of two. Powers of two divide symmetric shapes evenly,
/// so that the positions of their blocks also repeat.
constexpr double kOddCost = 1.05;

} // namespace

double squared_edge(const QuantizedGeometry& geometry, uint32_t from, uint32_t to) {
  const LatticePoint& a = geometry.positions[geometry.vertices[from].position];
  const LatticePoint& b = geometry.positions[geometry.vertices[to].position];
  double sum = 0.0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto d = static_cast<double>(b[axis] - a[axis]);
    sum += d * d;
  }
  return sum;
}

std::array<double, 3> mean_squared_edges(const QuantizedGeometry& geometry, std::span<const uint32_t> part,
                                         std::span<const GridPlace> places) {
  std::array<double, 3> sums{};
  double count = 0.0;
  for (const uint32_t t : part) {
    const GridPlace& place = places[t];
    if (place.upper) continue;
    ++count;
    for (uint32_t e = 0; e < 3; ++e) {
      const QuadEdge edge = place.shape().edges[e];
      sums[edge == QuadEdge::kDiagonal ? 2
           : edge == QuadEdge::kBelow  ? 0
                                       : 1] +=
          squared_edge(geometry, place.vertex(geometry.triangles[t], e), place.vertex(geometry.triangles[t], e + 1));
    }
  }
  for (double& sum : sums) sum /= std::max(count, 1.0);
  return sums;
}

BlockCutter::BlockCutter(const QuantizedGeometry& geometry, const std::vector<GridPlace>& places,
                         RepeatedClusters which)
    : geometry_(geometry), places_(places), rule_(rule_of(which)) {}

BlockCutter::Rule BlockCutter::rule_of(RepeatedClusters which) {
  return which == RepeatedClusters::kMost ? Rule{0.3, 1.5, kBlockQuads / 2} : Rule{0.6, 1.0, 0};
}

void BlockCutter::cut(std::span<const uint32_t> part, bool alternating, std::vector<RegularBlock>& blocks) {
  part_ = part, alternating_ = alternating;
  if (part_.size() < kMaxClusterTriangles || !place_part()) return;
  sum_full_quads();
  const std::optional<Size> size = choose_size();
  if (!size) return;
  const std::optional<Size> offset = choose_offset(*size);
  if (!offset) return;
  for_each_full_block(*offset, *size, [&](int32_t x, int32_t y) {
    if (has_grid_vertices(x, y, *size)) blocks.push_back(block_at(x, y, *size));
  });
}

/// Sets the part's area and quads. Returns whether these fill enough of their box.
bool BlockCutter::place_part() {
  GridPlace lo = places_[part_[0]], hi = lo;
  for (const uint32_t t : part_) {
    lo.i = std::min(lo.i, places_[t].i), lo.j = std::min(lo.j, places_[t].j);
    hi.i = std::max(hi.i, places_[t].i), hi.j = std::max(hi.j, places_[t].j);
  }
  lowest_ = {lo.i, lo.j};
  area_ = {hi.i - lo.i + 1, hi.j - lo.j + 1};
  const uint64_t cells = static_cast<uint64_t>(area_.columns) * static_cast<uint64_t>(area_.rows);
  if (cells > 16 * part_.size()) return false;
  quads_.assign(static_cast<size_t>(cells), {kEmpty, kEmpty});
  for (const uint32_t t : part_) {
    const GridPlace& place = places_[t];
    uint32_t& cell = quads_[cell_of(place.i - lo.i, place.j - lo.j)][place.upper ? 1 : 0];
    if (cell == kEmpty) cell = t; // else the grid winds over itself
  }
  return true;
}

/// Computes full_[x, y]: the number of quads left of column x and below row y that have both triangles.
void BlockCutter::sum_full_quads() {
  const size_t stride = static_cast<size_t>(area_.columns) + 1;
  full_.assign(stride * (static_cast<size_t>(area_.rows) + 1), 0);
  for (int32_t y = 0; y < area_.rows; ++y) {
    uint32_t row = 0;
    for (int32_t x = 0; x < area_.columns; ++x) {
      const auto& quad = quads_[cell_of(x, y)];
      row += quad[0] != kEmpty && quad[1] != kEmpty;
      const size_t at = static_cast<size_t>(y) * stride + static_cast<size_t>(x);
      full_[at + stride + 1] = full_[at + 1] + row;
    }
  }
}

/// Returns the block size of the least estimated cost. Returns nothing if all sizes exceed kMaxElongation.
std::optional<BlockCutter::Size> BlockCutter::choose_size() const {
  const std::array<double, 3> squares = mean_squared_edges(geometry_, part_, places_);
  std::optional<Size> best;
  double least = 0.0;
  const auto consider = [&](Size size) {
    if (alternating_ && size.columns % 2 != 0) return; // odd sizes would give blocks of two kinds
    if (alternating_) size.rows -= size.rows % 2;
    const double width = size.columns * std::sqrt(squares[0]), height = size.rows * std::sqrt(squares[1]);
    if (size.rows < 2 || width > kMaxElongation * height || height > kMaxElongation * width) return;
    uint32_t blocks = 0;
    for_each_full_block({static_cast<int32_t>(diagonal(0, 0)), 0}, size, [&](int32_t, int32_t) { ++blocks; });
    const double rest = static_cast<double>(part_.size()) - 2.0 * size.quads() * blocks;
    const bool odd = !std::has_single_bit(static_cast<uint32_t>(size.columns));
    const double cost = (rule_.rest_cost * rest + blocks * (kBlockCost + size.points())) * (odd ? kOddCost : 1.0);
    if (!best || cost < least) best = size, least = cost;
  };
  for (int32_t columns = 2; columns <= kMaxBlockColumns; ++columns) consider({columns, kBlockQuads / columns});
  // Small blocks save little where the part is too narrow for two of them side by side.
  for (int32_t columns = 2; columns <= rule_.small_quads / 2; ++columns) {
    const Size size{columns, rule_.small_quads / columns};
    if (area_.columns >= 2 * size.columns && area_.rows >= 2 * size.rows) consider(size);
  }
  return best;
}

/// Returns the cell where the first block begins, so that most blocks are full; nothing if they hold too few triangles.
std::optional<BlockCutter::Size> BlockCutter::choose_offset(Size size) const {
  Size best{0, 0};
  size_t most = 0;
  for (int32_t y = 0; y < size.rows; ++y)
    for (int32_t x = 0; x < size.columns; ++x) {
      if (diagonal(x, y) != 0) continue; // a block begins with diagonal 0
      size_t count = 0;
      for_each_full_block({x, y}, size, [&](int32_t, int32_t) { ++count; });
      if (count > most) most = count, best = {x, y};
    }
  // The triangles between blocks make poor clusters, and a few blocks save too little to make up for it.
  const double share = 2.0 * static_cast<double>(most) * size.quads() / static_cast<double>(part_.size());
  const double min_share = most > kFewBlocks ? rule_.min_share : most == kFewBlocks ? kMinShareOfFew : 1.0;
  return share < min_share ? std::nullopt : std::optional(best);
}

/// Calls use(x, y) for the lowest cell of each full block.
template <class Use>
void BlockCutter::for_each_full_block(Size offset, Size size, const Use& use) const {
  const size_t stride = static_cast<size_t>(area_.columns) + 1;
  const auto full = [&](int32_t x, int32_t y) {
    return full_[static_cast<size_t>(y) * stride + static_cast<size_t>(x)];
  };
  for (int32_t y = offset.rows; y + size.rows <= area_.rows; y += size.rows)
    for (int32_t x = offset.columns; x + size.columns <= area_.columns; x += size.columns) {
      const int32_t right = x + size.columns, top = y + size.rows;
      if (full(right, top) - full(x, top) - full(right, y) + full(x, y) == static_cast<uint32_t>(size.quads()))
        use(x, y);
    }
}

/// Returns whether all triangles of the block that meet at a grid point share one vertex there.
bool BlockCutter::has_grid_vertices(int32_t x, int32_t y, Size size) const {
  std::array<uint32_t, size_t{3} * (kMaxBlockColumns + 1)> vertices; // a block of 2 x 32 quads has the most points
  vertices.fill(kEmpty);
  for (int32_t j = 0; j < size.rows; ++j)
    for (int32_t i = 0; i < size.columns; ++i)
      for (const uint32_t t : quads_[cell_of(x + i, y + j)]) {
        const QuadTriangle& shape = places_[t].shape();
        for (uint32_t c = 0; c < 3; ++c) {
          const int32_t column = i + shape.corners[c][0], row = j + shape.corners[c][1];
          uint32_t& known = vertices[static_cast<size_t>(row * (size.columns + 1) + column)];
          const uint32_t vertex = places_[t].vertex(geometry_.triangles[t], c);
          if (known != kEmpty && known != vertex) return false;
          known = vertex;
        }
      }
  return true;
}

RegularBlock BlockCutter::block_at(int32_t x, int32_t y, Size size) const {
  RegularBlock block;
  GridBlock shape{static_cast<uint32_t>(size.columns), static_cast<uint32_t>(size.rows), 0};
  for (int32_t j = 0; j < size.rows; ++j)
    for (int32_t i = 0; i < size.columns; ++i)
      shape.diagonals |= uint64_t{places_[quads_[cell_of(x + i, y + j)][0]].diagonal} << (j * size.columns + i);
  for (const GridTriangle& one : strip_order(shape)) {
    const uint32_t t =
        quads_[cell_of(x + static_cast<int32_t>(one.x), y + static_cast<int32_t>(one.y))][one.upper ? 1 : 0];
    block.triangles[block.triangle_count] = t;
    block.first_corner[block.triangle_count++] = places_[t].first;
  }
  return block;
}

} // namespace packtrace
