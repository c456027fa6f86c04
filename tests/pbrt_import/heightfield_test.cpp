#include "pbrt_import/shapes/heightfield.h"

#include <array>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/shapes/mesh_cleanup.h"

namespace packtrace {
namespace {

TEST(Heightfield, SamplesSpanTheUnitSquareRowByRow) {
  const std::array<float, 6> heights{0, 1, 2, 3, 4, 5};
  const Mesh mesh = make_heightfield(3, 2, heights);
  EXPECT_EQ(mesh.positions,
            (std::vector<Vec3>{{0, 0, 0}, {0.5f, 0, 1}, {1, 0, 2}, {0, 1, 3}, {0.5f, 1, 4}, {1, 1, 5}}));
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {0.5f, 0}, {1, 0}, {0, 1}, {0.5f, 1}, {1, 1}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}}));
  EXPECT_TRUE(mesh.normals.empty());
}

TEST(Heightfield, SamplesThatAreNotFiniteCostOnlyTheirTriangles) {
  const std::array<float, 4> heights{0, 0, 0, std::numeric_limits<float>::infinity()};
  Mesh mesh = make_heightfield(2, 2, heights);
  EXPECT_EQ(clean_up_mesh(mesh, {}), 2u);
}

TEST(Heightfield, CountsThatDoNotFitAreErrors) {
  const std::array<float, 4> heights{};
  EXPECT_THROW(make_heightfield(1, 4, heights), Error);
  EXPECT_THROW(make_heightfield(4, 1, heights), Error);
  EXPECT_THROW(make_heightfield(2, 3, heights), Error);
  EXPECT_THROW(make_heightfield(65536, 65536, heights), Error);
  EXPECT_THROW(make_heightfield(4294967295u, 4294967295u, heights), Error);
}

} // namespace
} // namespace packtrace
