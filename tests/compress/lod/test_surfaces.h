#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/lod/bound/triangle_overlay.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {

inline DVec3 random_point(Random& random) {
  return 100.0 * DVec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

/// A surface for overlays.
struct Surface {
  std::vector<DVec3> points;
  std::vector<LodTriangle> triangles;
  OverlaySurface view() const { return {points, triangles}; }
  std::vector<uint32_t> all() const {
    std::vector<uint32_t> numbers(triangles.size());
    for (uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
    return numbers;
  }
  std::array<DVec3, 3> corners(size_t i) const {
    const Triangle& t = triangles[i].points;
    return {points[t.x], points[t.y], points[t.z]};
  }
};

/// A square [0, 100]^2 of cells x cells, with points displaced vertically by up to `height`.
inline Surface bumpy_square(uint32_t cells, float height, uint32_t seed) {
  Random random(seed);
  Surface s;
  for (uint32_t y = 0; y <= cells; ++y)
    for (uint32_t x = 0; x <= cells; ++x)
      s.points.emplace_back(100.0 * x / cells, 100.0 * y / cells, random.uniform(-height, height));
  for (uint32_t y = 0; y < cells; ++y)
    for (uint32_t x = 0; x < cells; ++x) {
      const uint32_t a = y * (cells + 1) + x, b = a + cells + 1;
      s.triangles.push_back({Triangle(a, a + 1, b + 1), Triangle(Wedge::kNone), 0, 0.0});
      s.triangles.push_back({Triangle(a, b + 1, b), Triangle(Wedge::kNone), 0, 0.0});
    }
  return s;
}

inline Surface random_triangles(uint32_t count, uint32_t seed) {
  Random random(seed);
  Surface s;
  for (uint32_t i = 0; i < count; ++i) {
    const DVec3 a = random_point(random), b = i % 9 == 0 ? a : random_point(random);
    const DVec3 c = i % 7 == 0 ? a + 0.5 * (b - a) : random_point(random);
    for (const DVec3& p : {a, b, c}) s.points.push_back(p);
    s.triangles.push_back({Triangle(3 * i, 3 * i + 1, 3 * i + 2), Triangle(Wedge::kNone), 0, 0.0});
  }
  return s;
}

} // namespace packtrace::test
