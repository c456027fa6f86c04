#include "tests/compress/extremes_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>

#include <gtest/gtest.h>

#include "compress/format/cluster/position_grid.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

/// Triangles as sorted triples of vertex numbers, in sorted order: equal lists mean equal sets of triangles.
std::vector<std::array<uint32_t, 3>> corner_sets(const std::vector<Triangle>& triangles) {
  std::vector<std::array<uint32_t, 3>> sets;
  for (const Triangle& t : triangles) {
    sets.push_back({t.x, t.y, t.z});
    std::sort(sets.back().begin(), sets.back().end());
  }
  std::sort(sets.begin(), sets.end());
  return sets;
}

/// Height of the triangle over its longest edge; 0 if that edge has no length.
double height(const Source& source, const std::array<uint32_t, 3>& triangle) {
  const DVec3 a = source.positions[triangle[0]], b = source.positions[triangle[1]], c = source.positions[triangle[2]];
  const double longest = std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
  return longest > 0.0 ? glm::length(glm::cross((b - a) / longest, c - a)) : 0.0;
}

/// Finds source vertices by position.
class SourceIndex {
public:
  explicit SourceIndex(const Source& source) : source_(source), by_x_(source.positions.size()) {
    std::iota(by_x_.begin(), by_x_.end(), 0u);
    std::sort(by_x_.begin(), by_x_.end(), [&](uint32_t a, uint32_t b) { return at(a).x < at(b).x; });
  }

  /// Returns the vertices within `bound` of p along every axis; at most two.
  std::vector<uint32_t> near(DVec3 p, double bound) const {
    std::vector<uint32_t> found;
    auto i = std::lower_bound(by_x_.begin(), by_x_.end(), p.x - bound,
                              [&](uint32_t vertex, double x) { return at(vertex).x < x; });
    for (; i != by_x_.end() && at(*i).x <= p.x + bound && found.size() < 2; ++i) {
      const DVec3 off = glm::abs(at(*i) - p);
      if (off.y <= bound && off.z <= bound) found.push_back(*i);
    }
    return found;
  }

private:
  DVec3 at(uint32_t vertex) const { return source_.positions[vertex]; }

  const Source& source_;
  std::vector<uint32_t> by_x_;
};

} // namespace

Source source_of(const Mesh& mesh, const DAffine& transform) {
  Source source;
  source.add(mesh, transform);
  return source;
}

void expect_holds(const BakedFile& file, uint32_t g, const Source& source, double flushed) {
  const baked::GeometryRecord& record = file.geometries()[g];
  const double step = PositionGrid{record.step_mantissa, record.step_exponent}.step();
  double max_abs = 0.0;
  for (const DVec3 p : source.positions) max_abs = std::max({max_abs, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  EXPECT_LE(record.position_error_bound, step / 2 + (max_abs + step) * (0x1p-24 + 0x1p-50) + 0x1p-149);
  EXPECT_LE(record.max_position_error, record.position_error_bound);
  const std::vector<std::array<uint32_t, 3>> expected = corner_sets(source.triangles);
  const auto may_collapse = [&](const std::array<uint32_t, 3>& triangle) {
    return height(source, triangle) <= 8.0 * record.position_error_bound;
  };
  ASSERT_LE(record.triangle_count, expected.size());
  const auto thin = std::count_if(expected.begin(), expected.end(), may_collapse);
  ASSERT_GE(record.triangle_count + static_cast<size_t>(thin), expected.size());

  const Decoded decoded = decode(file, g);
  const SourceIndex index(source);
  const double bound = record.position_error_bound * (1 + 1e-12) + flushed;
  std::vector<uint32_t> vertex(decoded.positions.size());
  bool told_apart = true;
  for (size_t i = 0; i < vertex.size(); ++i) {
    ASSERT_TRUE(is_finite(decoded.positions[i]));
    const auto found = index.near(DVec3(decoded.positions[i]), bound);
    ASSERT_FALSE(found.empty()) << "decoded vertex " << i << " is near no source vertex";
    vertex[i] = found[0];
    told_apart = told_apart && found.size() == 1;
  }
  if (!told_apart) return;
  std::vector<Triangle> triangles;
  for (const Triangle& t : decoded.triangles) triangles.emplace_back(vertex[t.x], vertex[t.y], vertex[t.z]);
  const std::vector<std::array<uint32_t, 3>> stored = corner_sets(triangles);
  EXPECT_TRUE(std::includes(expected.begin(), expected.end(), stored.begin(), stored.end()));
  std::vector<std::array<uint32_t, 3>> missing;
  std::set_difference(expected.begin(), expected.end(), stored.begin(), stored.end(), std::back_inserter(missing));
  EXPECT_TRUE(std::all_of(missing.begin(), missing.end(), may_collapse));
}

} // namespace packtrace::test
