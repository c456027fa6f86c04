#include "compress/bake/clusters/regular_blocks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

namespace packtrace {
namespace {

constexpr uint32_t kNothing = ~0u;
constexpr uint32_t kRegularValence = 6;
/// Maximum number of triangles at a vertex on the border of a grid.
constexpr uint32_t kMaxBorderValence = 3;
constexpr int32_t kBlockQuads = kMaxClusterTriangles / 2;
constexpr int32_t kStripQuads = 2; ///< length of a strip
constexpr uint32_t kProbe = 512;   ///< number of triangles from which the diagonals of a grid are chosen
constexpr int32_t kMaxBlockColumns = 32;
constexpr double kMaxElongation = 2.5; ///< maximum ratio of a block's sides, from mean edge lengths
constexpr double kBlockCost = 8.0;     ///< cost of a block apart from its vertices; a vertex costs 1
constexpr double kRestCost = 1.0;      ///< cost of a triangle outside all blocks
constexpr size_t kFewBlocks = 4;       ///< minimum number of blocks, unless they fill the whole part
/// Factor of the cost where the number of columns is not a power of two. Powers of two divide symmetric shapes evenly,
/// so that the positions of their blocks also repeat.
constexpr double kOddCost = 1.05;
constexpr int32_t kMaxCoordinate = 1 << 24;

/// A triangle's place in the grid. With corners in counterclockwise order, the lower triangle of quad (i, j) is
/// (i, j), (i+1, j), (i+1, j+1), the upper one (i, j), (i+1, j+1), (i, j+1).
struct Place {
  int32_t i = 0, j = 0;
  bool upper = false;
  uint8_t first = 0; ///< number of the triangle's corner at grid point (i, j)
};

/// The edges of a triangle, named by their place in the quad. Edge e goes from corner first + e to the next corner.
enum Side : uint32_t { kBelow = 0, kRight = 1, kDiagonalOfLower = 2, kDiagonalOfUpper = 0, kAbove = 1, kLeft = 2 };

struct Neighbour {
  uint32_t triangle;
  Place place;
};

struct Size {
  int32_t columns, rows;

  int32_t quads() const { return columns * rows; }
  int32_t points() const { return (columns + 1) * (rows + 1); }
};

class BlockFinder {
public:
  explicit BlockFinder(const QuantizedGeometry& geometry)
      : geometry_(geometry), valence_(geometry.vertices.size(), 0) {}

  std::vector<RegularBlock> run() {
    for (const Triangle& t : geometry_.triangles)
      for (int corner = 0; corner < 3; ++corner) ++valence_[t[corner]];
    const auto count = static_cast<uint32_t>(geometry_.triangles.size());
    const auto regular = static_cast<uint64_t>(std::ranges::count_if(geometry_.triangles, [&](const Triangle& t) {
      return valence_[t.x] == kRegularValence && valence_[t.y] == kRegularValence && valence_[t.z] == kRegularValence;
    }));
    if (regular < kMaxClusterTriangles / 2 || 4 * regular < count) return {};
    list_triangles_of_vertices();
    places_.resize(count);
    visited_.assign(count, 0);
    for (uint32_t seed = 0; seed < count; ++seed) {
      if (visited_[seed] != 0 || !is_regular(seed)) continue;
      grow(seed, corner_off_diagonals(seed), ~0u);
      cut_blocks();
    }
    return std::move(blocks_);
  }

private:
  void list_triangles_of_vertices() {
    first_.assign(valence_.size() + 1, 0);
    for (size_t v = 0; v < valence_.size(); ++v) first_[v + 1] = first_[v] + valence_[v];
    around_.resize(3 * geometry_.triangles.size());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t t = 0; t < geometry_.triangles.size(); ++t)
      for (int corner = 0; corner < 3; ++corner) around_[next[geometry_.triangles[t][corner]]++] = t;
  }

  bool is_regular(uint32_t triangle) const {
    for (int corner = 0; corner < 3; ++corner) {
      const uint32_t valence = valence_[geometry_.triangles[triangle][corner]];
      if (valence != kRegularValence && valence > kMaxBorderValence) return false;
    }
    return true;
  }

  uint32_t corner(uint32_t triangle, uint32_t number) const {
    return geometry_.triangles[triangle][static_cast<int>(number % 3)];
  }

  /// Returns the triangle across an edge, and the number of this edge in it. Returns nothing unless exactly one other
  /// triangle has the edge, with the opposite direction and the same kind.
  std::optional<std::pair<uint32_t, uint32_t>> across(uint32_t triangle, uint32_t edge) const {
    const uint32_t from = corner(triangle, edge), to = corner(triangle, edge + 1);
    std::optional<std::pair<uint32_t, uint32_t>> found;
    for (uint32_t k = first_[from]; k < first_[from + 1]; ++k) {
      const uint32_t other = around_[k];
      if (other == triangle) continue;
      for (uint32_t e = 0; e < 3; ++e) {
        const uint32_t begin = corner(other, e), end = corner(other, e + 1);
        if (begin == from && end == to) return std::nullopt;
        if (begin != to || end != from) continue;
        if (found) return std::nullopt;
        found = {other, e};
      }
    }
    if (found && geometry_.kind_of[found->first] != geometry_.kind_of[triangle]) return std::nullopt;
    return found;
  }

  /// Returns the triangle across a side, and its place in the grid. Returns nothing if that triangle is not regular or
  /// was visited before.
  std::optional<Neighbour> enter(uint32_t triangle, uint32_t side) const {
    const Place& from = places_[triangle];
    const auto found = across(triangle, from.first + side);
    if (!found || visited_[found->first] != 0 || !is_regular(found->first)) return std::nullopt;
    Place to{from.i, from.j, !from.upper, 0};
    uint32_t turn = 0; // in the other triangle, from the first corner of the shared edge to the corner at (i, j)
    if (!from.upper && side == kBelow) --to.j, turn = 2;
    if (!from.upper && side == kRight) ++to.i, turn = 1;
    if (from.upper && side == kDiagonalOfUpper) turn = 1;
    if (from.upper && side == kAbove) ++to.j;
    if (from.upper && side == kLeft) --to.i, turn = 2;
    to.first = static_cast<uint8_t>((found->second + turn) % 3);
    if (std::max(std::abs(to.i), std::abs(to.j)) > kMaxCoordinate) return std::nullopt;
    return Neighbour{found->first, to};
  }

  /// Visits the triangle across a side and returns it; kNothing if there is none to visit.
  uint32_t step(uint32_t triangle, uint32_t side) {
    const std::optional<Neighbour> next = enter(triangle, side);
    if (!next) return kNothing;
    visit(next->triangle, next->place);
    return next->triangle;
  }

  void visit(uint32_t triangle, const Place& place) {
    places_[triangle] = place;
    visited_[triangle] = 1;
    part_.push_back(triangle);
  }

  /// Visits the regular triangles that are connected with the seed, row by row. A closed grid, such as a tube, is
  /// therefore opened along a column. The seed becomes the lower triangle of quad (0, 0).
  /// @param first number of the seed's corner at grid point (0, 0)
  /// @param limit stops after a row if at least so many triangles were visited
  void grow(uint32_t seed, uint32_t first, uint32_t limit) {
    part_.clear();
    visit(seed, {0, 0, false, static_cast<uint8_t>(first)});
    visit_row(seed);
    for (size_t k = 0; k < part_.size() && part_.size() < limit; ++k) {
      const uint32_t next = step(part_[k], places_[part_[k]].upper ? kAbove : kBelow);
      if (next != kNothing) visit_row(next);
    }
  }

  void visit_row(uint32_t start) {
    const uint32_t other = step(start, places_[start].upper ? kDiagonalOfUpper : kDiagonalOfLower);
    const auto walk = [&](uint32_t triangle, uint32_t of_lower, uint32_t of_upper) {
      while (triangle != kNothing) triangle = step(triangle, places_[triangle].upper ? of_upper : of_lower);
    };
    const bool upper = places_[start].upper;
    walk(upper ? other : start, kRight, kDiagonalOfUpper);
    walk(upper ? start : other, kDiagonalOfLower, kLeft);
  }

  const LatticePoint& place_of(uint32_t vertex) const {
    return geometry_.positions[geometry_.vertices[vertex].position];
  }

  /// Returns the mean squared length of the part's edges along rows, along columns, and of the diagonals.
  std::array<double, 3> mean_squares() const {
    std::array<double, 3> sums{};
    double count = 0.0;
    for (const uint32_t t : part_) {
      if (places_[t].upper) continue;
      ++count;
      for (uint32_t e = 0; e < 3; ++e) {
        const LatticePoint &a = place_of(corner(t, places_[t].first + e)),
                           &b = place_of(corner(t, places_[t].first + e + 1));
        for (size_t axis = 0; axis < 3; ++axis) {
          const auto d = static_cast<double>(b[axis] - a[axis]);
          sums[e] += d * d;
        }
      }
    }
    for (double& sum : sums) sum /= std::max(count, 1.0);
    return sums;
  }

  /// Returns the corner of the seed that must come first to make diagonals of the longest of the three edge directions
  /// around the seed.
  uint32_t corner_off_diagonals(uint32_t seed) {
    grow(seed, 0, kProbe);
    const std::array<double, 3> squares = mean_squares();
    for (const uint32_t t : part_) visited_[t] = 0;
    const auto longest = static_cast<uint32_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
    return (longest + 1) % 3; // the diagonal is edge 2
  }

  /// Returns the block size of the least estimated cost. Returns nothing if all sizes exceed kMaxElongation.
  std::optional<Size> choose_size() const {
    const std::array<double, 3> squares = mean_squares();
    std::optional<Size> best;
    double least = 0.0;
    for (int32_t columns = 2; columns <= kMaxBlockColumns; ++columns) {
      const Size size{columns, kBlockQuads / columns};
      const double width = columns * std::sqrt(squares[0]), height = size.rows * std::sqrt(squares[1]);
      if (width > kMaxElongation * height || height > kMaxElongation * width) continue;
      uint32_t blocks = 0;
      for_each_full_block({0, 0}, size, [&](int32_t, int32_t) { ++blocks; });
      const double rest = static_cast<double>(part_.size()) - 2.0 * size.quads() * blocks;
      const bool odd = !std::has_single_bit(static_cast<uint32_t>(columns));
      const double cost = (kRestCost * rest + blocks * (kBlockCost + size.points())) * (odd ? kOddCost : 1.0);
      if (!best || cost < least) best = size, least = cost;
    }
    return best;
  }

  /// Cuts the part into blocks. Leaves it whole if blocks would hold less than three fifths of it, or if fewer than
  /// kFewBlocks would not fill it.
  void cut_blocks() {
    if (part_.size() < kMaxClusterTriangles) return;
    Place lo = places_[part_[0]], hi = lo;
    for (const uint32_t t : part_) {
      lo.i = std::min(lo.i, places_[t].i), lo.j = std::min(lo.j, places_[t].j);
      hi.i = std::max(hi.i, places_[t].i), hi.j = std::max(hi.j, places_[t].j);
    }
    area_ = {hi.i - lo.i + 1, hi.j - lo.j + 1};
    const uint64_t cells = static_cast<uint64_t>(area_.columns) * static_cast<uint64_t>(area_.rows);
    if (cells > 16 * part_.size()) return;
    quads_.assign(static_cast<size_t>(cells), {kNothing, kNothing});
    for (const uint32_t t : part_) {
      const Place& place = places_[t];
      uint32_t& cell = quads_[cell_of(place.i - lo.i, place.j - lo.j)][place.upper ? 1 : 0];
      if (cell == kNothing) cell = t; // else the grid winds over itself
    }
    sum_full_quads();
    const std::optional<Size> chosen = choose_size();
    if (!chosen) return;
    const Size size = *chosen;
    Size best{0, 0};
    size_t most = 0;
    for (int32_t y = 0; y < size.rows; ++y)
      for (int32_t x = 0; x < size.columns; ++x) {
        size_t count = 0;
        for_each_full_block({x, y}, size, [&](int32_t, int32_t) { ++count; });
        if (count > most) most = count, best = {x, y};
      }
    const size_t quads = most * static_cast<size_t>(size.quads());
    // The triangles between blocks make poor clusters, and a few blocks save too little to make up for it.
    if (10 * quads < 3 * part_.size() || (most < kFewBlocks && 2 * quads < part_.size())) return;
    for_each_full_block(best, size, [&](int32_t x, int32_t y) { add_block(x, y, size); });
  }

  size_t cell_of(int32_t x, int32_t y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(area_.columns) + static_cast<size_t>(x);
  }

  /// Computes full_[x, y]: the number of quads left of column x and below row y that have both triangles.
  void sum_full_quads() {
    const size_t stride = static_cast<size_t>(area_.columns) + 1;
    full_.assign(stride * (static_cast<size_t>(area_.rows) + 1), 0);
    for (int32_t y = 0; y < area_.rows; ++y) {
      uint32_t row = 0;
      for (int32_t x = 0; x < area_.columns; ++x) {
        const auto& quad = quads_[cell_of(x, y)];
        row += quad[0] != kNothing && quad[1] != kNothing;
        const size_t at = static_cast<size_t>(y) * stride + static_cast<size_t>(x);
        full_[at + stride + 1] = full_[at + 1] + row;
      }
    }
  }

  template <class Use>
  void for_each_full_block(Size offset, Size size, const Use& use) const {
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

  /// Adds the block whose lowest cell is (x, y). Its strips are kStripQuads long and lie side by side, so that 2 x 2
  /// quads can form a leaf of a tree. Leaves of longer strips are narrow, and have large boxes where the grid is not
  /// aligned to the axes.
  void add_block(int32_t x, int32_t y, Size size) {
    if (!has_grid_vertices(x, y, size)) return;
    RegularBlock& block = blocks_.emplace_back();
    const auto add = [&](uint32_t t) {
      block.triangles[block.triangle_count] = t;
      block.first_corner[block.triangle_count++] = places_[t].first;
    };
    // Transposing the grid exchanges lower and upper triangles.
    const bool along_columns = size.columns < size.rows;
    const int32_t length = along_columns ? size.rows : size.columns, strips = size.quads() / length;
    for (int32_t end = length; end > 0; end -= kStripQuads)
      for (int32_t strip = 0; strip < strips; ++strip)
        for (int32_t i = end - 1; i >= std::max(0, end - kStripQuads); --i) {
          const auto& quad = quads_[along_columns ? cell_of(x + strip, y + i) : cell_of(x + i, y + strip)];
          add(quad[along_columns ? 1 : 0]);
          add(quad[along_columns ? 0 : 1]);
        }
  }

  /// Returns whether all triangles of the block that meet at a grid point share one vertex there.
  bool has_grid_vertices(int32_t x, int32_t y, Size size) const {
    std::array<uint32_t, size_t{3} * (kMaxBlockColumns + 1)> vertices; // a block of 2 x 32 quads has the most points
    vertices.fill(kNothing);
    const auto put = [&](int32_t column, int32_t row, uint32_t vertex) {
      uint32_t& known = vertices[static_cast<size_t>(row * (size.columns + 1) + column)];
      if (known == kNothing) known = vertex;
      return known == vertex;
    };
    for (int32_t j = 0; j < size.rows; ++j)
      for (int32_t i = 0; i < size.columns; ++i) {
        const auto [lower, upper] = quads_[cell_of(x + i, y + j)];
        const uint32_t a = places_[lower].first, b = places_[upper].first;
        if (!put(i, j, corner(lower, a)) || !put(i + 1, j, corner(lower, a + 1)) ||
            !put(i + 1, j + 1, corner(lower, a + 2)) || !put(i, j, corner(upper, b)) ||
            !put(i + 1, j + 1, corner(upper, b + 1)) || !put(i, j + 1, corner(upper, b + 2)))
          return false;
      }
    return true;
  }

  const QuantizedGeometry& geometry_;
  std::vector<uint32_t> valence_;        ///< per vertex: number of triangles
  std::vector<uint32_t> first_, around_; ///< triangles of vertex v: around_[first_[v]..first_[v+1])
  std::vector<Place> places_;            ///< per triangle, valid if visited
  std::vector<uint8_t> visited_;
  std::vector<uint32_t> part_; ///< triangles of the connected part being cut
  Size area_{};
  std::vector<std::array<uint32_t, 2>> quads_; ///< per cell: lower and upper triangle
  std::vector<uint32_t> full_;
  std::vector<RegularBlock> blocks_;
};

} // namespace

std::vector<RegularBlock> find_regular_blocks(const QuantizedGeometry& geometry) { return BlockFinder(geometry).run(); }

} // namespace packtrace
