#include "compress/bake/lod/shared_borders.h"

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "compress/bake/lod/simplify/surface_edges.h"
#include "pbrt_import/base/weld_table.h"

namespace packtrace {
namespace {

constexpr size_t kBorderGrain = 2048;

/// A hash that is equal for equal positions on any lattice: each coordinate is reduced to an odd mantissa and an
/// exponent.
uint64_t position_hash(const LatticePoint& p, const PositionGrid& grid) {
  std::array<uint64_t, 3> axes{};
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t product = p[axis] * int64_t{grid.mantissa}; // below 2^59
    if (product == 0) continue;
    const int zeros = std::countr_zero(static_cast<uint64_t>(product));
    axes[axis] = mix_words(static_cast<uint64_t>(product >> zeros), static_cast<uint64_t>(grid.exponent + zeros));
  }
  return mix_words(axes[0], axes[1], axes[2]);
}

/// The triangles around each position.
class BorderStars {
public:
  explicit BorderStars(const QuantizedGeometry& geometry) : g_(geometry), ends_(geometry.positions.size() + 1) {
    for (const Triangle& t : g_.triangles)
      if (const Triangle p = points_of(t); has_edges(p))
        for (int i = 0; i < 3; ++i) ++ends_[p[i] + 1];
    for (size_t i = 1; i < ends_.size(); ++i) ends_[i] += ends_[i - 1];
    triangles_.resize(ends_.back());
    std::vector<uint32_t> next(ends_.begin(), ends_.end() - 1);
    for (uint32_t t = 0; t < g_.triangles.size(); ++t)
      if (const Triangle p = points_of(g_.triangles[t]); has_edges(p))
        for (int i = 0; i < 3; ++i) triangles_[next[p[i]]++] = t;
  }

  bool on_border(uint32_t position) const {
    thread_local std::vector<Use> uses;
    uses.clear();
    for (uint32_t i = ends_[position]; i < ends_[position + 1]; ++i) {
      const Triangle p = points_of(g_.triangles[triangles_[i]]);
      const int at = p.x == position ? 0 : p.y == position ? 1 : 2;
      uses.push_back({p[(at + 1) % 3], triangles_[i], true});
      uses.push_back({p[(at + 2) % 3], triangles_[i], false});
    }
    std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) { return a.end < b.end; });
    for (size_t i = 0; i < uses.size(); i += 2) {
      if (i + 1 == uses.size() || uses[i].end != uses[i + 1].end) return true; // one triangle
      if (i + 2 < uses.size() && uses[i + 2].end == uses[i].end) return true;  // more than two
      if (uses[i].outwards == uses[i + 1].outwards || folds(uses[i].triangle, uses[i + 1].triangle)) return true;
    }
    return false;
  }

private:
  /// An edge from the current position, in one triangle.
  struct Use {
    uint32_t end, triangle;
    bool outwards; ///< whether the triangle runs from the position to `end`
  };

  Triangle points_of(const Triangle& t) const {
    return {g_.vertices[t.x].position, g_.vertices[t.y].position, g_.vertices[t.z].position};
  }
  static bool has_edges(const Triangle& p) { return p.x != p.y && p.y != p.z && p.z != p.x; }

  DVec3 area_normal(uint32_t triangle) const {
    const Triangle p = points_of(g_.triangles[triangle]);
    const auto side = [&](uint32_t to) {
      DVec3 d;
      for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<size_t>(axis);
        d[axis] = static_cast<double>(g_.positions[to][i] - g_.positions[p.x][i]);
      }
      return d;
    };
    return glm::cross(side(p.y), side(p.z));
  }

  /// Whether two triangles with a common edge in opposite directions lie on the same side of it, as in a sheet of two
  /// layers.
  bool folds(uint32_t a, uint32_t b) const {
    const DVec3 m = area_normal(a), n = area_normal(b);
    const double dot = glm::dot(m, n);
    return dot < 0.0 && dot * dot > kFolded * kFolded * glm::dot(m, m) * glm::dot(n, n);
  }

  const QuantizedGeometry& g_;
  std::vector<uint32_t> ends_;      ///< per position: start of its triangles; plus an end marker
  std::vector<uint32_t> triangles_; ///< sorted by position
};

template <typename PerPosition>
void for_each_position(const QuantizedGeometry& geometry, const PerPosition& per_position) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, geometry.positions.size(), kBorderGrain),
                    [&](const tbb::blocked_range<size_t>& range) {
                      for (size_t i = range.begin(); i < range.end(); ++i) per_position(i);
                    });
}

} // namespace

std::vector<uint8_t> border_positions(const QuantizedGeometry& geometry) {
  const BorderStars stars(geometry);
  std::vector<uint8_t> result(geometry.positions.size());
  for_each_position(geometry, [&](size_t i) { result[i] = stars.on_border(static_cast<uint32_t>(i)); });
  return result;
}

void SharedBorderFinder::add(size_t number, const QuantizedGeometry& geometry) {
  const std::vector<uint8_t> border = border_positions(geometry);
  std::vector<uint64_t>& keys = keys_[number];
  keys.resize(geometry.positions.size());
  for_each_position(
      geometry, [&](size_t i) { keys[i] = (position_hash(geometry.positions[i], geometry.grid) << 1) | border[i]; });
}

SharedBorders SharedBorderFinder::finish() {
  std::vector<uint64_t> all;
  size_t count = 0;
  for (const std::vector<uint64_t>& keys : keys_) count += keys.size();
  all.reserve(count);
  for (std::vector<uint64_t>& keys : keys_) {
    all.insert(all.end(), keys.begin(), keys.end());
    keys = {};
  }
  tbb::parallel_sort(all.begin(), all.end());
  SharedBorders result;
  for (size_t i = 0, next; i < all.size(); i = next) {
    for (next = i + 1; next < all.size() && all[next] >> 1 == all[i] >> 1;) ++next;
    // Border positions sort after interior ones.
    if (next - i > 1 && (all[next - 1] & 1) != 0) result.keys_.push_back(all[i] >> 1);
  }
  return result;
}

std::vector<uint8_t> SharedBorders::locks(const QuantizedGeometry& geometry) const {
  std::vector<uint8_t> result;
  if (empty()) return result;
  result.resize(geometry.positions.size());
  for_each_position(geometry, [&](size_t i) {
    const uint64_t key = (position_hash(geometry.positions[i], geometry.grid) << 1) >> 1;
    result[i] = std::binary_search(keys_.begin(), keys_.end(), key);
  });
  if (std::find(result.begin(), result.end(), 1) == result.end()) result = {};
  return result;
}

} // namespace packtrace
