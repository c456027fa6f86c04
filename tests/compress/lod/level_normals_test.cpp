// Tests how coarse the normals of levels may be, and that they are no coarser.

#include "compress/bake/lod/level_normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/angle.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Three right triangles with a longest side of 500 steps, each a cluster. The first two have normals.
struct ThreeTriangles {
  ThreeTriangles() {
    geometry.kinds = {{0, false, false}, {0, true, false}};
    for (uint32_t i = 0; i < 3; ++i) {
      for (const LatticePoint& p : {LatticePoint{0, 0, i}, LatticePoint{300, 0, i}, LatticePoint{0, 400, i}}) {
        geometry.vertices.push_back({static_cast<uint32_t>(geometry.positions.size()), 0, {}});
        geometry.positions.push_back(p);
      }
      level.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
      level.clusters.push_back({i, 1, i == 2 ? 1u : 0u});
    }
  }
  double limit(double first, double second, double flat) const {
    return level_normal_limit(geometry, level, std::array{first, second, flat});
  }

  QuantizedGeometry geometry;
  GeometryClusters level;
};

TEST(LevelNormals, TheLimitIsAQuarterOfTheAngleThatErrorsTurnTrianglesBy) {
  const ThreeTriangles three;
  EXPECT_EQ(three.limit(0, 0, 1000), 0.0); // flat triangles have no normals
  EXPECT_NEAR(three.limit(25, 25, 0), 0.25 * std::atan(4.0 * 25 / 500) * 180 / kPi, 1e-12);
  EXPECT_NEAR(three.limit(25, 100, 0), three.limit(25, 25, 0), 1e-12); // half of the surface has the smaller error
  EXPECT_LT(three.limit(1e9, 1e9, 0), 22.5 + 1e-9);
}

TEST(LevelNormals, AQuarterOfTheSurfaceMayTurnByLess) {
  ThreeTriangles three;
  EXPECT_EQ(three.limit(0, 100, 0), 0.0);
  three.geometry.positions[1] = {75, 0, 0}; // now a quarter as large as the second, a fifth of both
  EXPECT_NEAR(three.limit(0, 100, 0), three.limit(100, 100, 0), 1e-12);
  EXPECT_GT(three.limit(0, 100, 0), 0.0);
}

TEST(LevelNormals, TheEncodingOfFewestBitsWithinTheLimitIsTaken) {
  const BuiltLod built = build_lod(sphere_mesh(24));
  ASSERT_EQ(built.geometry.normal_encoding, NormalEncoding::kAxis24);
  const auto chosen = [&](double limit) {
    GeometryClusters level = built.base;
    return coarsen_normals(limit, built.geometry, level).encoding;
  };
  EXPECT_EQ(chosen(0.0), NormalEncoding::kAxis24);
  EXPECT_EQ(chosen(0.161), NormalEncoding::kAxis24);
  EXPECT_EQ(chosen(0.163), NormalEncoding::kOct20);
  EXPECT_EQ(chosen(0.631), NormalEncoding::kAxis16);
  EXPECT_EQ(chosen(2.69), NormalEncoding::kAxis12);
  GeometryClusters level = built.base;
  QuantizedGeometry coarse = built.geometry;
  coarse.normal_encoding = NormalEncoding::kAxis12;
  EXPECT_TRUE(coarsen_normals(22.0, coarse, level).vertices.empty());
}

TEST(LevelNormals, NormalsAreTheNearestAndEqualVerticesBecomeOne) {
  // Facets beside smooth triangles: many normals at one point become equal in 12 bits.
  const BuiltLod built = build_lod(half_faceted(sphere_mesh(24)));
  const QuantizedGeometry& fine = built.geometry;
  GeometryClusters level = built.base;
  const CoarseNormals coarse = coarsen_normals(2.7, fine, level);
  ASSERT_EQ(coarse.encoding, NormalEncoding::kAxis12);
  double largest = 0.0;
  for (size_t i = 0; i < level.triangles.size(); ++i)
    for (int corner = 0; corner < 3; ++corner) {
      const QuantizedVertex &before = fine.vertices[built.base.triangles[i][corner]],
                            &after = coarse.vertices[level.triangles[i][corner]];
      EXPECT_EQ(before.position, after.position);
      const DVec3 normal(decode_normal(fine.normal_encoding, before.normal_code));
      EXPECT_EQ(encode_normal(coarse.encoding, normal), after.normal_code);
      largest =
          std::max(largest, angle_degrees(glm::normalize(normal),
                                          glm::normalize(DVec3(decode_normal(coarse.encoding, after.normal_code)))));
    }
  EXPECT_NEAR(coarse.max_error_degrees, largest, 1e-9);
  EXPECT_GT(coarse.mean_error_degrees, 0.3 * largest);
  EXPECT_LT(coarse.mean_error_degrees, largest);
  std::vector<QuantizedVertex> distinct = coarse.vertices;
  const auto key = [](const QuantizedVertex& v) { return std::pair(v.position, v.normal_code); };
  std::sort(distinct.begin(), distinct.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  EXPECT_EQ(std::unique(distinct.begin(), distinct.end()), distinct.end());
  EXPECT_LT(coarse.vertices.size(), fine.vertices.size());
}

/// Normals by lattice point of one cluster.
std::map<LatticePoint, DVec3> normals_of(const ClusterView& cluster) {
  std::map<LatticePoint, DVec3> normals;
  for (uint32_t v = 0; v < cluster.vertex_count(); ++v)
    normals[cluster.lattice(v)] = glm::normalize(DVec3(cluster.normal(v)));
  return normals;
}

TEST(LevelNormals, BakedLevelsKeepTheirStatedErrorAndAllElse) {
  const Scene scene = scene_of(sphere_mesh(40));
  BakeConfig config = config_with_levels();
  const BakedFile coarse = BakedFile::from_bytes(bake(scene, config).bytes);
  config.normals = NormalEncoding::kAxis24;
  const BakedFile fine = BakedFile::from_bytes(bake(scene, config).bytes);
  ASSERT_EQ(coarse.geometries()[0].normal_encoding, static_cast<uint32_t>(NormalEncoding::kAxis24));
  ASSERT_EQ(coarse.geometries().size(), fine.geometries().size());
  ASSERT_GE(coarse.geometries().size(), 4u);
  for (uint32_t g = 1; g < coarse.geometries().size(); ++g) {
    const baked::GeometryRecord &one = coarse.geometries()[g], &other = fine.geometries()[g];
    EXPECT_LE(format_of(static_cast<NormalEncoding>(one.normal_encoding)).bits, 16u);
    EXPECT_EQ(other.normal_encoding, static_cast<uint32_t>(NormalEncoding::kAxis24)) << "as asked for";
    EXPECT_GT(one.max_normal_error_degrees, other.max_normal_error_degrees);
    EXPECT_LE(one.mean_normal_error_degrees, one.max_normal_error_degrees);
    EXPECT_EQ(one.triangle_count, other.triangle_count);
    ASSERT_EQ(coarse.clusters(g).size(), fine.clusters(g).size());
    for (uint32_t c = 0; c < coarse.clusters(g).size(); ++c) {
      const auto now = normals_of(coarse.cluster(g, c)), exact = normals_of(fine.cluster(g, c));
      ASSERT_EQ(now.size(), exact.size());
      for (const auto& [place, normal] : exact) {
        ASSERT_TRUE(now.contains(place));
        EXPECT_LE(angle_degrees(now.at(place), normal), double{one.max_normal_error_degrees});
      }
    }
  }
  config.normals.reset(), config.normal_error_degrees = 0.2;
  const BakedFile stated = BakedFile::from_bytes(bake(scene, config).bytes);
  for (const baked::GeometryRecord& g : stated.geometries())
    EXPECT_EQ(g.normal_encoding, static_cast<uint32_t>(NormalEncoding::kOct20));
}

} // namespace
} // namespace packtrace::test
