#include "compress/bake/clusters/regular_blocks.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "compress/bake/clusters/block_cutter.h"
#include "compress/format/cluster/grid_block.h"

namespace packtrace {
namespace {

constexpr uint32_t kNothing = ~0u;
/// Number of triangles at a vertex inside a grid whose quads all have the same diagonal.
constexpr uint32_t kRegularValence = 6;
/// Numbers of triangles at the vertices inside a grid with alternating diagonals: where four diagonals end, and where
/// none does.
constexpr uint32_t kDiagonalValence = 8, kPlainValence = 4;
/// Maximum number of triangles at a vertex on the border of a grid.
constexpr uint32_t kMaxBorderValence = 3, kMaxDiagonalBorderValence = 4, kMaxPlainBorderValence = 2;
constexpr uint32_t kProbe = 512; ///< number of triangles from which the diagonals of a grid are chosen
/// Twice the number of quad edges at a vertex inside a grid, and its maximum on the border. An edge of a single
/// triangle counts half.
constexpr uint32_t kInnerSides = 8, kMaxBorderSides = 4;
/// Limits of c^2 / (a^2 + b^2), where c is the longest edge of a triangle. The ratio is 1 in half of a rectangle.
constexpr double kMinRightAngle = 0.8, kMaxRightAngle = 1.25;
constexpr int32_t kMaxCoordinate = 1 << 24;

/// How the diagonals of a grid lie: all alike, alternating, or each on the longest edge of its two triangles.
enum class Diagonals { kEqual, kAlternating, kLongestEdges };

/// Returns how the triangle on the other side of an edge names it.
QuadEdge opposite(QuadEdge edge) {
  switch (edge) {
  case QuadEdge::kBelow:
    return QuadEdge::kAbove;
  case QuadEdge::kAbove:
    return QuadEdge::kBelow;
  case QuadEdge::kLeft:
    return QuadEdge::kRight;
  case QuadEdge::kRight:
    return QuadEdge::kLeft;
  case QuadEdge::kDiagonal:
    break;
  }
  return QuadEdge::kDiagonal;
}

struct Neighbour {
  uint32_t triangle;
  GridPlace place;
};

class BlockFinder {
public:
  BlockFinder(const QuantizedGeometry& geometry, RepeatedClusters which)
      : geometry_(geometry), valence_(geometry.vertices.size(), 0), cutter_(geometry, places_, which) {}

  std::vector<RegularBlock> run() {
    for (const Triangle& t : geometry_.triangles)
      for (int corner = 0; corner < 3; ++corner) ++valence_[t[corner]];
    const auto count = static_cast<uint32_t>(geometry_.triangles.size());
    const auto regular = static_cast<uint64_t>(std::ranges::count_if(
        geometry_.triangles, [&](const Triangle& t) { return is_inside_uniform(t) || plain_corner(t); }));
    if (regular >= kMaxClusterTriangles / 2 && 4 * regular >= count)
      find_blocks([&](uint32_t seed) { return begin_by_valence(seed); });
    if (const size_t found = triangles_in_blocks(); 2 * found < count && find_longest_edges()) {
      std::vector<RegularBlock> by_valence = std::exchange(blocks_, {});
      find_blocks([&](uint32_t seed) { return begin_by_longest_edge(seed); });
      if (triangles_in_blocks() <= found) blocks_ = std::move(by_valence);
    }
    return std::move(blocks_);
  }

private:
  /// Finds the blocks of all parts.
  /// @param begin called for each triangle that was not visited. Sets diagonals_, and returns the corner at grid point
  /// (0, 0), or nothing if the triangle is not in a grid.
  template <class Begin>
  void find_blocks(const Begin& begin) {
    const size_t count = geometry_.triangles.size();
    if (first_.empty()) list_triangles_of_vertices();
    places_.resize(count);
    visited_.assign(count, 0);
    for (uint32_t seed = 0; seed < count; ++seed) {
      if (visited_[seed] != 0) continue;
      const std::optional<uint32_t> first = begin(seed);
      if (!first) continue;
      grow(seed, *first, ~0u);
      cutter_.cut(part_, diagonals_ == Diagonals::kAlternating, blocks_);
    }
  }

  size_t triangles_in_blocks() const {
    size_t count = 0;
    for (const RegularBlock& block : blocks_) count += block.triangle_count;
    return count;
  }

  void list_triangles_of_vertices() {
    first_.assign(valence_.size() + 1, 0);
    for (size_t v = 0; v < valence_.size(); ++v) first_[v + 1] = first_[v] + valence_[v];
    around_.resize(3 * geometry_.triangles.size());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t t = 0; t < geometry_.triangles.size(); ++t)
      for (int corner = 0; corner < 3; ++corner) around_[next[geometry_.triangles[t][corner]]++] = t;
  }

  /// Chooses diagonals by the numbers of triangles at vertices.
  std::optional<uint32_t> begin_by_valence(uint32_t seed) {
    const std::optional<uint32_t> plain = plain_corner(geometry_.triangles[seed]);
    diagonals_ = plain ? Diagonals::kAlternating : Diagonals::kEqual;
    if (plain) return (*plain + 2) % 3; // no diagonal ends at corner 1
    if (!is_uniform(seed)) return std::nullopt;
    return corner_off_diagonals(seed);
  }

  /// Makes diagonals of the longest edges.
  std::optional<uint32_t> begin_by_longest_edge(uint32_t seed) {
    diagonals_ = Diagonals::kLongestEdges;
    if (!is_half_quad(seed)) return std::nullopt;
    return (longest_[seed] + 1u) % 3; // the diagonal is edge 2
  }

  /// Finds the longest edge of each triangle. Returns whether three quarters of the triangles are about right-angled,
  /// and a quarter satisfy has_grid_sides().
  bool find_longest_edges() {
    const size_t count = geometry_.triangles.size();
    if (count < kMaxClusterTriangles) return false;
    longest_.resize(count);
    size_t right_angled = 0;
    for (size_t t = 0; t < count; ++t) {
      const Triangle& triangle = geometry_.triangles[t];
      std::array<double, 3> squares{};
      for (int e = 0; e < 3; ++e)
        squares[static_cast<size_t>(e)] = squared_edge(geometry_, triangle[e], triangle[(e + 1) % 3]);
      const auto longest = std::ranges::max_element(squares);
      longest_[t] = static_cast<uint8_t>(longest - squares.begin());
      const double others = squares[0] + squares[1] + squares[2] - *longest;
      right_angled += *longest > kMinRightAngle * others && *longest < kMaxRightAngle * others;
    }
    if (4 * right_angled < 3 * count) return false;
    // Each triangle counts half of its two edges at a vertex; the longest edge is the diagonal and not counted.
    sides_.assign(valence_.size(), 0);
    for (size_t v = 0; v < valence_.size(); ++v) sides_[v] = 2 * valence_[v];
    for (uint32_t t = 0; t < count; ++t) --sides_[corner(t, longest_[t])], --sides_[corner(t, longest_[t] + 1u)];
    const auto regular = static_cast<uint64_t>(
        std::ranges::count_if(geometry_.triangles, [&](const Triangle& t) { return has_grid_sides(t); }));
    return 4 * regular >= count;
  }

  /// Returns whether as many quad edges meet at each corner as inside or on the border of a grid.
  bool has_grid_sides(const Triangle& t) const {
    const auto fits = [&](uint32_t vertex) {
      return sides_[vertex] == kInnerSides || sides_[vertex] <= kMaxBorderSides;
    };
    return fits(t.x) && fits(t.y) && fits(t.z);
  }

  /// Returns whether the triangle may be half of a quad in a grid whose diagonals are longest edges. Its longest edge
  /// must also be that of the triangle across.
  bool is_half_quad(uint32_t triangle) const {
    if (!has_grid_sides(geometry_.triangles[triangle])) return false;
    const auto other = across(triangle, longest_[triangle]);
    return other && longest_[other->first] == other->second;
  }

  bool is_inside_uniform(const Triangle& t) const {
    return valence_[t.x] == kRegularValence && valence_[t.y] == kRegularValence && valence_[t.z] == kRegularValence;
  }

  /// Returns the corner where no diagonal ends, if the triangle is inside a grid with alternating diagonals.
  std::optional<uint32_t> plain_corner(const Triangle& t) const {
    for (uint32_t c = 0; c < 3; ++c) {
      const auto at = [&](uint32_t k) { return valence_[t[static_cast<int>((c + k) % 3)]]; };
      if (at(0) == kPlainValence && at(1) == kDiagonalValence && at(2) == kDiagonalValence) return c;
    }
    return std::nullopt;
  }

  /// Returns whether the triangle may be in a grid whose quads all have the same diagonal.
  bool is_uniform(uint32_t triangle) const {
    for (int corner = 0; corner < 3; ++corner) {
      const uint32_t valence = valence_[geometry_.triangles[triangle][corner]];
      if (valence != kRegularValence && valence > kMaxBorderValence) return false;
    }
    return true;
  }

  /// Returns whether the triangle fits its place: its longest edge is the diagonal, or its corners have the numbers of
  /// triangles that a grid with these diagonals has there.
  bool is_regular(uint32_t triangle, const GridPlace& place) const {
    if (diagonals_ == Diagonals::kEqual) return is_uniform(triangle);
    if (diagonals_ == Diagonals::kLongestEdges)
      return (place.first + place.shape().find(QuadEdge::kDiagonal)) % 3 == longest_[triangle] &&
             is_half_quad(triangle);
    const QuadTriangle& shape = place.shape();
    for (uint32_t c = 0; c < 3; ++c) {
      const uint32_t valence = valence_[corner(triangle, place.first + c)];
      const bool diagonals_end = (place.i + place.j + shape.corners[c][0] + shape.corners[c][1]) % 2 == 0;
      if (diagonals_end ? valence != kDiagonalValence && valence > kMaxDiagonalBorderValence
                        : valence != kPlainValence && valence > kMaxPlainBorderValence)
        return false;
    }
    return true;
  }

  /// Returns the diagonal of quad (i, j); 0 if diagonals are longest edges, which do not follow from the place.
  uint8_t diagonal(int32_t i, int32_t j) const {
    return diagonals_ == Diagonals::kAlternating ? static_cast<uint8_t>(static_cast<uint32_t>(i + j) & 1u) : uint8_t{0};
  }
  bool has(uint32_t triangle, QuadEdge edge) const { return places_[triangle].shape().find(edge) < 3; }

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

  /// Returns the triangle across an edge, and its place in the grid. Returns nothing if that triangle is not regular or
  /// was visited before.
  std::optional<Neighbour> enter(uint32_t triangle, QuadEdge edge) const {
    const GridPlace& from = places_[triangle];
    const auto found = across(triangle, from.first + from.shape().find(edge));
    if (!found || visited_[found->first] != 0) return std::nullopt;
    GridPlace to{from.i, from.j, edge == QuadEdge::kDiagonal && !from.upper, from.diagonal, 0};
    if (edge == QuadEdge::kRight) ++to.i;
    if (edge == QuadEdge::kLeft) --to.i;
    if (edge == QuadEdge::kAbove) ++to.j;
    if (edge == QuadEdge::kBelow) --to.j;
    if (std::max(std::abs(to.i), std::abs(to.j)) > kMaxCoordinate) return std::nullopt;
    const auto place_with = [&](uint8_t diagonal) {
      if (edge != QuadEdge::kDiagonal) {
        to.diagonal = diagonal;
        to.upper = false;
        to.upper = to.shape().find(opposite(edge)) == 3; // else the lower one has it
      }
      to.first = static_cast<uint8_t>((found->second + 3 - to.shape().find(opposite(edge))) % 3);
      return is_regular(found->first, to);
    };
    if (!place_with(diagonal(to.i, to.j)) && (diagonals_ != Diagonals::kLongestEdges || !place_with(1)))
      return std::nullopt;
    return Neighbour{found->first, to};
  }

  /// Visits the triangle across an edge and returns it; kNothing if there is none to visit.
  uint32_t step(uint32_t triangle, QuadEdge edge) {
    const std::optional<Neighbour> next = enter(triangle, edge);
    if (!next) return kNothing;
    visit(next->triangle, next->place);
    return next->triangle;
  }

  void visit(uint32_t triangle, const GridPlace& place) {
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
    visit(seed, {0, 0, false, 0, static_cast<uint8_t>(first)});
    visit_row(seed);
    for (size_t k = 0; k < part_.size() && part_.size() < limit; ++k) {
      const uint32_t next = step(part_[k], places_[part_[k]].upper ? QuadEdge::kAbove : QuadEdge::kBelow);
      if (next != kNothing) visit_row(next);
    }
  }

  void visit_row(uint32_t start) {
    const uint32_t other = step(start, QuadEdge::kDiagonal);
    for (const QuadEdge direction : {QuadEdge::kRight, QuadEdge::kLeft}) {
      uint32_t triangle = has(start, direction) ? start : other;
      while (triangle != kNothing)
        triangle = step(triangle, has(triangle, direction) ? direction : QuadEdge::kDiagonal);
    }
  }

  /// Returns the corner of the seed that must come first to make diagonals of the longest of the three edge directions
  /// around the seed. Returns nothing if its part is too small for a block.
  std::optional<uint32_t> corner_off_diagonals(uint32_t seed) {
    grow(seed, 0, kProbe);
    if (part_.size() < kMaxClusterTriangles) return std::nullopt;
    const std::array<double, 3> squares = mean_squared_edges(geometry_, part_, places_);
    for (const uint32_t t : part_) visited_[t] = 0;
    const auto longest = static_cast<uint32_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
    return (longest + 1) % 3; // the diagonal is edge 2
  }

  const QuantizedGeometry& geometry_;
  std::vector<uint32_t> valence_;        ///< per vertex: number of triangles
  std::vector<uint32_t> first_, around_; ///< triangles of vertex v: around_[first_[v]..first_[v+1])
  std::vector<GridPlace> places_;        ///< per triangle, valid if visited
  std::vector<uint8_t> visited_;
  std::vector<uint32_t>
      sides_; ///< per vertex: twice its number of edges other than diagonals, if these are longest edges
  std::vector<uint8_t> longest_; ///< per triangle: number of its longest edge; empty unless diagonals are longest edges
  std::vector<uint32_t> part_;   ///< triangles of the connected part being cut
  Diagonals diagonals_ = Diagonals::kEqual; ///< of the part
  BlockCutter cutter_;
  std::vector<RegularBlock> blocks_;
};

} // namespace

std::vector<RegularBlock> find_regular_blocks(const QuantizedGeometry& geometry, RepeatedClusters which) {
  return BlockFinder(geometry, which).run();
}

} // namespace packtrace
