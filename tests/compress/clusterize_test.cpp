#include "compress/bake/clusters/clusterize.h"

#include <algorithm>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "compress/bake/clusters/cluster_cutter.h"
#include "compress/format/cluster/index_codec.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

Clusters run(const Mesh& mesh) {
  std::vector<DVec3> centroids;
  for (const Triangle& t : mesh.triangles)
    centroids.emplace_back(DVec3(mesh.positions[t.x]) + DVec3(mesh.positions[t.y]) + DVec3(mesh.positions[t.z]));
  const auto vertices = static_cast<uint32_t>(mesh.positions.size());
  return clusterize({mesh.triangles, mesh.triangles, centroids, vertices, vertices});
}

Clusters cut(const Mesh& mesh) {
  std::vector<TreeBox> boxes;
  for (const Triangle& t : mesh.triangles) {
    constexpr float kInf = std::numeric_limits<float>::infinity();
    TreeBox box{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}};
    for (int corner = 0; corner < 3; ++corner) {
      const Vec3 p = mesh.positions[t[corner]];
      box.extend({{p.x, p.y, p.z}, {p.x, p.y, p.z}});
    }
    boxes.push_back(box);
  }
  return cut_clusters(boxes, mesh.triangles, static_cast<uint32_t>(mesh.positions.size()));
}

/// Sum of the areas of the clusters' boxes in x and y.
double covered_area(const Mesh& mesh, const Clusters& clusters) {
  double area = 0.0;
  uint32_t begin = 0;
  for (const uint32_t end : clusters.ends) {
    Bounds box;
    for (uint32_t i = begin; i < end; ++i)
      for (int corner = 0; corner < 3; ++corner)
        box.extend(DVec3(mesh.positions[mesh.triangles[clusters.order[i]][corner]]));
    area += box.extent().x * box.extent().y;
    begin = end;
  }
  return area;
}

void expect_valid(const Mesh& mesh, const Clusters& clusters) {
  std::vector<uint32_t> sorted = clusters.order;
  std::sort(sorted.begin(), sorted.end());
  ASSERT_EQ(sorted.size(), mesh.triangles.size());
  for (uint32_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
  uint32_t begin = 0;
  for (const uint32_t end : clusters.ends) {
    ASSERT_GT(end, begin);
    EXPECT_LE(end - begin, kMaxClusterTriangles);
    std::set<uint32_t> vertices;
    for (uint32_t i = begin; i < end; ++i)
      for (int corner = 0; corner < 3; ++corner) vertices.insert(mesh.triangles[clusters.order[i]][corner]);
    EXPECT_LE(vertices.size(), kMaxClusterVertices);
    begin = end;
  }
  EXPECT_EQ(begin, mesh.triangles.size());
}

TEST(Clusterize, EveryTriangleIsInOneClusterWithinTheLimits) {
  for (const Mesh& mesh : {test::grid_mesh(1), test::grid_mesh(60), test::sphere_mesh(40), test::soup_mesh(1000, 1)})
    expect_valid(mesh, run(mesh));
  expect_valid({}, run({}));
}

TEST(Clusterize, ClustersAreNinetyPercentFull) {
  for (const Mesh& mesh : {test::grid_mesh(100), test::sphere_mesh(70)})
    EXPECT_GE(static_cast<double>(mesh.triangles.size()) / static_cast<double>(run(mesh).ends.size()), 115.0);
}

TEST(Clusterize, ClustersAreCompact) {
  const Mesh mesh = test::grid_mesh(100);
  EXPECT_LT(covered_area(mesh, run(mesh)), 2.5); // perfectly square boxes would cover the unit square exactly once
}

TEST(Clusterize, EdgesOfManyTrianglesAreNoTrouble) {
  Mesh fan; // 500 triangles around one edge
  fan.positions = {Vec3(0), Vec3(0, 0, 1)};
  for (uint32_t i = 0; i < 500; ++i) {
    fan.positions.emplace_back(1.0f, static_cast<float>(i), 0.0f);
    fan.triangles.emplace_back(0, 1, i + 2);
  }
  fan.triangles.emplace_back(7, 7, 7);
  expect_valid(fan, run(fan));
}

TEST(CutClusters, EveryTriangleIsInOneClusterWithinTheLimits) {
  for (const Mesh& mesh : {test::grid_mesh(1), test::grid_mesh(8), test::grid_mesh(60), test::sphere_mesh(40)})
    expect_valid(mesh, cut(mesh));
  expect_valid({}, cut({}));
}

/// Three vertices per triangle: a cluster holds 85 triangles, so parts must be cut, and neighbours cannot be joined.
TEST(CutClusters, KeepsTheLimitOfVertices) {
  Mesh loose;
  for (uint32_t i = 0; i < 1000; ++i) {
    const auto x = static_cast<float>(i % 37), y = static_cast<float>(i / 37);
    for (const Vec3& corner : {Vec3(x, y, 0), Vec3(x + 0.5f, y, 0), Vec3(x, y + 0.5f, 0)})
      loose.positions.push_back(corner);
    loose.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  const Clusters clusters = cut(loose);
  expect_valid(loose, clusters);
  EXPECT_LT(clusters.ends.size(), 1000u / 85 * 3);
  Mesh same = loose; // equal boxes, so the heuristic has no preference
  for (size_t i = 0; i < same.positions.size(); ++i) same.positions[i] = same.positions[i % 3];
  expect_valid(same, cut(same));
}

TEST(CutClusters, ClustersAreMoreThanHalfFull) {
  for (const Mesh& mesh : {test::grid_mesh(100), test::sphere_mesh(70)})
    EXPECT_GE(static_cast<double>(mesh.triangles.size()) / static_cast<double>(cut(mesh).ends.size()), 70.0);
}

TEST(CutClusters, ClustersAreCompact) {
  const Mesh mesh = test::grid_mesh(100);
  EXPECT_LT(covered_area(mesh, cut(mesh)), 1.5);
}

TEST(CutClusters, PartsAreNotSplitToFillTheClusterBefore) {
  // Two heaps of loose triangles, 120 and 60: a cluster holds the vertices of 85.
  test::Random random(6);
  Mesh mesh;
  for (uint32_t i = 0; i < 180; ++i) {
    const Vec3 at(i < 120 ? 0.0f : 1000.0f, 0.0f, 0.0f);
    for (int corner = 0; corner < 3; ++corner)
      mesh.positions.push_back(at + Vec3(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)));
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  const Clusters clusters = cut(mesh);
  expect_valid(mesh, clusters);
  EXPECT_EQ(clusters.ends, (std::vector<uint32_t>{85, 120, 180}));
}

} // namespace
} // namespace packtrace
