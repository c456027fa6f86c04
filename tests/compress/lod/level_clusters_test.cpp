// Tests how levels are split into clusters, and that small parts do not spoil the levels of large ones.

#include "compress/bake/lod/level_clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/clusters/cluster_cutter.h"
#include "compress/format/cluster/index_codec.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

/// A mesh as split_level() takes it, on a lattice with 1000 steps per unit.
struct LatticeMesh {
  explicit LatticeMesh(const Mesh& mesh) : triangles(mesh.triangles) {
    for (const Vec3& p : mesh.positions) positions.emplace_back(glm::round(DVec3(p) * 1000.0));
    for (const Triangle& t : triangles) centroids.push_back(positions[t.x] + positions[t.y] + positions[t.z]);
  }
  ClusterizeInput input() const {
    const auto points = static_cast<uint32_t>(positions.size());
    return {triangles, triangles, centroids, points, points};
  }
  Clusters grown() const { return clusterize(input()); }
  Clusters cut() const {
    std::vector<TreeBox> boxes(triangles.size());
    for (size_t i = 0; i < boxes.size(); ++i)
      for (size_t axis = 0; axis < 3; ++axis) {
        const auto at = [&](int corner) {
          return static_cast<float>(positions[triangles[i][corner]][static_cast<int>(axis)]);
        };
        boxes[i].lo[axis] = std::min({at(0), at(1), at(2)}), boxes[i].hi[axis] = std::max({at(0), at(1), at(2)});
      }
    return cut_clusters(boxes, triangles, static_cast<uint32_t>(positions.size()));
  }
  /// Bits of records and vertices.
  double bits(const Clusters& clusters, double normal_bits) const {
    double sum = 0.0;
    uint32_t begin = 0;
    for (const uint32_t end : clusters.ends) {
      std::vector<uint32_t> used;
      DVec3 lo(1e30), hi(-1e30);
      for (; begin < end; ++begin)
        for (int corner = 0; corner < 3; ++corner) {
          used.push_back(triangles[clusters.order[begin]][corner]);
          lo = glm::min(lo, positions[used.back()]), hi = glm::max(hi, positions[used.back()]);
        }
      std::sort(used.begin(), used.end());
      const auto vertices = static_cast<double>(std::unique(used.begin(), used.end()) - used.begin());
      double width = normal_bits;
      for (int axis = 0; axis < 3; ++axis) width += std::ceil(std::log2(hi[axis] - lo[axis] + 1.0));
      sum += 52 * 8 + vertices * width;
    }
    return sum;
  }

  std::vector<Triangle> triangles;
  std::vector<DVec3> positions, centroids;
};

TEST(LevelClusters, AreThoseOfFewerBitsAndHoldEachTriangleOnce) {
  uint32_t cut = 0, grown = 0;
  for (const Mesh& mesh : {torus_mesh(48, 32), torus_mesh(90, 12), grid_mesh(24), grid_mesh(29, 0.3f), sphere_mesh(20),
                           tetrahedra_mesh(300, 3), soup_mesh(700, 5)})
    for (const bool normals : {false, true}) {
      const LatticeMesh m(mesh);
      const Clusters result = split_level(m.input(), m.positions, normals);
      const double normal_bits = normals ? 15.0 : 0.0;
      const double of_cut = m.bits(m.cut(), normal_bits), of_grown = m.bits(m.grown(), normal_bits);
      EXPECT_EQ(m.bits(result, normal_bits), std::min(of_cut, of_grown)) << mesh.name;
      (of_cut < of_grown ? cut : grown) += 1;
      std::vector<uint32_t> order = result.order;
      std::sort(order.begin(), order.end());
      ASSERT_EQ(order.size(), m.triangles.size());
      for (uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
      uint32_t begin = 0;
      for (const uint32_t end : result.ends) {
        EXPECT_LE(end - begin, kMaxClusterTriangles);
        begin = end;
      }
    }
  EXPECT_GT(cut, 0u);
  EXPECT_GT(grown, 0u);
}

/// The square is last along the curve that groups follow, so it is a group of its own while the torus has several.
TEST(LevelClusters, ASquareOfTwoTrianglesDoesNotSpoilATorus) {
  Scene scene = scene_of(torus_mesh(8, 6));
  scene.materials.push_back({"square", 0, Vec3(0.5f), kNoMask, kNoMask});
  scene.meshes.push_back(torus_mesh(96, 64));
  scene.meshes.push_back(grid_mesh(1));
  DAffine beside = scaling({4, 4, 1});
  beside[3] = DVec3(2, 2, 2);
  scene.objects.push_back({"both", {Shape{1, 0, false, DAffine(1.0)}, Shape{2, 1, false, beside}}});
  scene.instances.push_back({0, Affine(1.0f)});
  const BakedFile file = BakedFile::from_bytes(bake(scene, config_with_levels()).bytes);
  const uint32_t geometry = file.instances()[1].geometry;
  const LodView lod = file.lod(geometry);
  ASSERT_GE(lod.levels.size(), 5u);
  const baked::GeometryRecord& g = file.geometries()[geometry];
  double diagonal2 = 0.0;
  for (size_t axis = 0; axis < 3; ++axis) diagonal2 += std::pow(double{g.bounds_hi[axis]} - g.bounds_lo[axis], 2);
  for (const baked::LodLevelRecord& level : lod.levels)
    if (level.triangles > 200) {
      EXPECT_LT(level.error, 0.05 * std::sqrt(diagonal2)) << level.level << ": " << level.triangles << " triangles";
    }
}

} // namespace
} // namespace packtrace::test
