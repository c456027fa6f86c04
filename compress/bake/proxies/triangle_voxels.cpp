#include "compress/bake/proxies/triangle_voxels.h"

#include <algorithm>

namespace packtrace {
namespace {

using WideInt = __int128;

WideInt magnitude(WideInt value) { return value < 0 ? -value : value; }

WideInt floor_div(WideInt a, WideInt b) {
  const WideInt quotient = a / b;
  return quotient * b != a && (a < 0) != (b < 0) ? quotient - 1 : quotient;
}

int64_t floor_div_small(int64_t a, int64_t b) { return static_cast<int64_t>(floor_div(a, b)); }

std::array<WideInt, 3> difference(const FinePoint& a, const FinePoint& b) {
  return {WideInt{a[0]} - b[0], WideInt{a[1]} - b[1], WideInt{a[2]} - b[2]};
}

std::array<WideInt, 3> cross(const std::array<WideInt, 3>& a, const std::array<WideInt, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

WideInt dot(const std::array<WideInt, 3>& a, const FinePoint& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

} // namespace

TriangleVoxels::TriangleVoxels(const FineTriangle& triangle, int64_t edge, VoxelIndex size, VoxelRule rule) {
  bool one_voxel = true;
  for (size_t a = 0; a < 3; ++a) {
    const auto [low, high] = std::minmax({triangle[0][a], triangle[1][a], triangle[2][a]});
    // Closed voxels: a point on a border belongs to both sides.
    const int64_t first = std::max<int64_t>(floor_div_small(low + edge - 1, edge) - 1, 0),
                  last = std::min<int64_t>(floor_div_small(high, edge), int64_t{size[a]} - 1);
    if (first > last) return;
    lo_[a] = static_cast<uint32_t>(first), hi_[a] = static_cast<uint32_t>(last);
    one_voxel &= first == last;
  }
  empty_ = false;
  if (one_voxel && rule == VoxelRule::kConservative) return;
  const std::array<std::array<Int128, 3>, 3> edges = {
      difference(triangle[1], triangle[0]), difference(triangle[2], triangle[1]), difference(triangle[0], triangle[2])};
  add_axis(cross(edges[0], edges[1]), triangle, edge, rule);
  for (const std::array<Int128, 3>& e : edges) {
    add_axis({0, -e[2], e[1]}, triangle, edge, rule);
    add_axis({e[2], 0, -e[0]}, triangle, edge, rule);
    add_axis({-e[1], e[0], 0}, triangle, edge, rule);
  }
}

void TriangleVoxels::add_axis(const std::array<Int128, 3>& direction, const FineTriangle& triangle, int64_t edge,
                              VoxelRule rule) {
  const auto [low, high] =
      std::minmax({dot(direction, triangle[0]), dot(direction, triangle[1]), dot(direction, triangle[2])});
  Int128 sum = 0, reach = 0;
  for (const Int128 d : direction) {
    sum += d;
    reach = rule == VoxelRule::kSeparating ? std::max(reach, magnitude(d)) : reach + magnitude(d);
  }
  if (reach == 0) return;
  // Twice the centre's place along the direction is 2 edge direction . (x, y, z) + edge sum; it may differ from twice
  // the triangle's range by edge reach.
  const Int128 scale = 2 * Int128{edge};
  HalfSpace& above = half_spaces_[count_++];
  above = {{scale * direction[0], scale * direction[1], scale * direction[2]}, edge * (sum + reach) - 2 * low};
  HalfSpace& below = half_spaces_[count_++];
  below = {{-scale * direction[0], -scale * direction[1], -scale * direction[2]}, 2 * high - edge * (sum - reach)};
}

bool TriangleVoxels::row(uint32_t y, uint32_t z, int64_t& first, int64_t& last) const {
  for (uint32_t h = 0; h < count_; ++h) {
    const HalfSpace& half = half_spaces_[h];
    const Int128 rest = half.axis[1] * y + half.axis[2] * z + half.constant, slope = half.axis[0];
    if (slope == 0) {
      if (rest < 0) return false;
      continue;
    }
    // Most rows have one to three voxels: testing both ends is cheaper than a division.
    while (first <= last && slope > 0 && slope * first + rest < 0) {
      if (last - first > 2) {
        first = static_cast<int64_t>(std::min<Int128>(-floor_div(rest, slope), Int128{last} + 1));
        break;
      }
      ++first;
    }
    while (first <= last && slope < 0 && slope * last + rest < 0) {
      if (last - first > 2) {
        last = static_cast<int64_t>(std::max<Int128>(floor_div(rest, -slope), Int128{first} - 1));
        break;
      }
      --last;
    }
    if (first > last) return false;
  }
  return true;
}

void add_crossings(const FineTriangle& triangle, int64_t edge, VoxelSet& crossings) {
  // In halves of the unit, so that centres are integers.
  std::array<std::array<WideInt, 3>, 3> v;
  for (size_t i = 0; i < 3; ++i)
    v[i] = {2 * WideInt{triangle[i][0]}, 2 * WideInt{triangle[i][1]}, 2 * WideInt{triangle[i][2]}};
  const auto sub = [](const std::array<WideInt, 3>& a, const std::array<WideInt, 3>& b) {
    return std::array<WideInt, 3>{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  };
  std::array<WideInt, 3> normal = cross(sub(v[1], v[0]), sub(v[2], v[0]));
  if (normal[0] == 0) return; // seen edge-on by the rows
  if (normal[0] < 0) {
    std::swap(v[1], v[2]);
    for (WideInt& n : normal) n = -n;
  }
  const VoxelIndex size = crossings.size();
  const auto range = [&](size_t axis) {
    const auto [low, high] = std::minmax({v[0][axis], v[1][axis], v[2][axis]});
    const WideInt first = -floor_div(-(low - edge), 2 * WideInt{edge}),
                  last = floor_div(high - edge, 2 * WideInt{edge});
    return std::array<int64_t, 2>{static_cast<int64_t>(std::max<WideInt>(first, 0)),
                                  static_cast<int64_t>(std::min<WideInt>(last, WideInt{size[axis]} - 1))};
  };
  const auto [y_first, y_last] = range(1);
  const auto [z_first, z_last] = range(2);
  const WideInt plane = normal[0] * v[0][0] + normal[1] * v[0][1] + normal[2] * v[0][2];
  for (int64_t z = z_first; z <= z_last; ++z)
    for (int64_t y = y_first; y <= y_last; ++y) {
      const WideInt cy = (2 * WideInt{y} + 1) * edge, cz = (2 * WideInt{z} + 1) * edge;
      bool inside = true;
      for (size_t i = 0; i < 3 && inside; ++i) {
        const auto &a = v[i], &b = v[(i + 1) % 3];
        const WideInt dy = b[1] - a[1], dz = b[2] - a[2], side = dy * (cz - a[2]) - dz * (cy - a[1]);
        inside = side > 0 || (side == 0 && (dz < 0 || (dz == 0 && dy > 0))); // one of two triangles owns an edge
      }
      if (!inside) continue;
      // The first x with normal . centre >= plane; the x of a centre is (2 x + 1) edge.
      const WideInt rest = plane - normal[1] * cy - normal[2] * cz - normal[0] * edge, slope = 2 * normal[0] * edge;
      const WideInt x = std::max<WideInt>(-floor_div(-rest, slope), 0);
      if (x >= size[0]) continue;
      const auto at = static_cast<uint32_t>(x);
      crossings.row(static_cast<uint32_t>(y), static_cast<uint32_t>(z))[at / 64] ^= uint64_t{1} << (at % 64);
    }
}

void prefix_parity(VoxelSet& crossings) {
  const VoxelIndex size = crossings.size();
  for (uint32_t z = 0; z < size[2]; ++z)
    for (uint32_t y = 0; y < size[1]; ++y) {
      uint64_t* const row = crossings.row(y, z);
      uint64_t carry = 0; // all ones: odd so far
      for (uint32_t w = 0; w < crossings.row_words(); ++w) {
        uint64_t word = row[w];
        for (uint32_t shift = 1; shift < 64; shift *= 2) word ^= word << shift;
        row[w] = word ^= carry;
        carry = (word >> 63) != 0 ? ~uint64_t{0} : 0;
      }
      if (const uint32_t tail = size[0] % 64; tail != 0) row[crossings.row_words() - 1] &= (uint64_t{1} << tail) - 1;
    }
}

} // namespace packtrace
