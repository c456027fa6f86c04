#include "compress/bake/grid/collapsed_triangles.h"
#include "pbrt_import/base/disjoint_sets.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <utility>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

namespace packtrace {
namespace {

enum TriangleShape : uint8_t { kArea, kEqualCorners, kSliver };

/// An edge as its lower and its higher point.
using Edge = std::pair<uint32_t, uint32_t>;

Edge edge_of(const Triangle& t, int side) {
  const uint32_t a = t[side], b = t[side == 2 ? 0 : side + 1];
  return {std::min(a, b), std::max(a, b)};
}

/// Decides per piece which slivers can be removed.
class SliverPieces {
public:
  SliverPieces(std::span<const Triangle> triangles, std::span<const uint8_t> shapes, size_t point_count)
      : triangles_(triangles), shapes_(shapes), at_sliver_(point_count) {
    for (uint32_t i = 0; i < shapes.size(); ++i)
      if (shapes[i] == kSliver) slivers_.push_back(i);
  }

  /// Clears the flags of slivers that must be kept.
  void unflag_needed_slivers(std::vector<uint8_t>& collapsed) {
    if (slivers_.empty()) return;
    gather_edges();
    find_neighbours();
    // Per piece: outline edges shared with triangles with area, capped at two.
    std::vector<uint8_t> borders(slivers_.size());
    for (size_t i = 0; i < edges_.size(); ++i)
      if (odd_[i] != 0 && has_neighbour_[i] != 0) {
        uint8_t& count = borders[pieces_.root(sliver_at_[i])];
        count = std::min<uint8_t>(count + 1, 2);
      }
    for (uint32_t i = 0; i < slivers_.size(); ++i)
      if (borders[pieces_.root(i)] > 1) collapsed[slivers_[i]] = 0;
  }

private:
  /// Joins slivers that share an edge.
  void gather_edges() {
    std::vector<std::pair<Edge, uint32_t>> sides; // edge and sliver
    sides.reserve(3 * slivers_.size());
    for (uint32_t i = 0; i < slivers_.size(); ++i)
      for (int side = 0; side < 3; ++side) {
        sides.emplace_back(edge_of(triangles_[slivers_[i]], side), i);
        at_sliver_[triangles_[slivers_[i]][side]] = 1;
      }
    tbb::parallel_sort(sides.begin(), sides.end());
    pieces_ = DisjointSets(slivers_.size());
    for (size_t i = 0; i < sides.size(); ++i) {
      if (i == 0 || sides[i].first != sides[i - 1].first) {
        edges_.push_back(sides[i].first), sliver_at_.push_back(sides[i].second), odd_.push_back(0);
      } else {
        pieces_.join(sides[i].second, sides[i - 1].second);
      }
      odd_.back() ^= 1;
    }
  }

  /// Finds the sliver edges that also belong to triangles with area.
  void find_neighbours() {
    has_neighbour_.resize(edges_.size());
    tbb::parallel_for(size_t{0}, triangles_.size(), [&](size_t i) {
      if (shapes_[i] != kArea) return;
      for (int side = 0; side < 3; ++side) {
        const Edge edge = edge_of(triangles_[i], side);
        if (at_sliver_[edge.first] == 0 || at_sliver_[edge.second] == 0) continue;
        const auto found = std::lower_bound(edges_.begin(), edges_.end(), edge);
        if (found == edges_.end() || *found != edge) continue;
        std::atomic_ref(has_neighbour_[static_cast<size_t>(found - edges_.begin())])
            .store(1, std::memory_order_relaxed);
      }
    });
  }

  const std::span<const Triangle> triangles_;
  const std::span<const uint8_t> shapes_;
  std::vector<uint8_t> at_sliver_;     // per point: whether it is a corner of a sliver
  std::vector<uint32_t> slivers_;      // triangle numbers
  DisjointSets pieces_;                // of slivers
  std::vector<Edge> edges_;            // edges of slivers, ascending
  std::vector<uint32_t> sliver_at_;    // per edge: a sliver with this edge
  std::vector<uint8_t> odd_;           // per edge: whether it belongs to an odd number of slivers
  std::vector<uint8_t> has_neighbour_; // per edge: whether it belongs to a triangle with area
};

} // namespace

bool has_area(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  __extension__ using Int128 = __int128; // differences take 57 bits, their products 113
  std::array<Int128, 3> ab, ac;
  for (size_t axis = 0; axis < 3; ++axis) ab[axis] = b[axis] - a[axis], ac[axis] = c[axis] - a[axis];
  return ab[0] * ac[1] != ab[1] * ac[0] || ab[1] * ac[2] != ab[2] * ac[1] || ab[2] * ac[0] != ab[0] * ac[2];
}

std::vector<uint8_t> find_collapsed(std::span<const LatticePoint> points, std::span<const Triangle> triangles) {
  std::vector<uint8_t> shapes(triangles.size()), collapsed(triangles.size());
  tbb::parallel_for(size_t{0}, triangles.size(), [&](size_t i) {
    const Triangle& t = triangles[i];
    if (t.x == t.y || t.y == t.z || t.z == t.x)
      shapes[i] = kEqualCorners;
    else
      shapes[i] = has_area(points[t.x], points[t.y], points[t.z]) ? kArea : kSliver;
    collapsed[i] = shapes[i] != kArea;
  });
  SliverPieces(triangles, shapes, points.size()).unflag_needed_slivers(collapsed);
  return collapsed;
}

} // namespace packtrace
