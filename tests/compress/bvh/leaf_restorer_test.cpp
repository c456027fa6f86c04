#include <algorithm>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/trees/leaf_restorer.h"
#include "compress/format/trees/node_writer.h"
#include "tests/compress/bvh/kernel_sets.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using baked::PackedNode;

LeafNode random_leaves(uint32_t triangle_count, test::Random& random) {
  LeafNode leaves;
  leaves.first_triangle = static_cast<uint32_t>(random.bits() % triangle_count);
  uint32_t end = leaves.first_triangle;
  for (const uint32_t wanted = 1 + random.bits() % 8; leaves.leaf_count < wanted && end < triangle_count;) {
    const auto size = std::min(static_cast<uint32_t>(1 + random.bits() % 16), triangle_count - end);
    leaves.triangles[leaves.leaf_count++] = static_cast<uint8_t>(size);
    end += size;
  }
  return leaves;
}

/// Compares restored leaf nodes with those made from triangle boxes, in trees with steps of 2^-2 to 2^2 times the
/// geometry's. Returns the largest number of position bits per vertex.
uint32_t compare(const BakedFile& file, const node_kernels::Kernels& kernels) {
  test::Random random(3);
  uint32_t widest = 0, node_count = 0;
  LeafRestorer restorer(kernels);
  const baked::GeometryRecord& geometry = file.geometries()[0];
  for (uint32_t c = 0; c < geometry.cluster_count; ++c) {
    const ClusterView cluster = file.cluster(0, c);
    const auto [x, y, z] = cluster.record().position_bits;
    widest = std::max(widest, uint32_t{x} + y + z);
    for (int32_t doublings = -2; doublings <= 2; ++doublings) {
      baked::TreeRecord tree{};
      tree.origin = {5, -7, 1 << 20};
      tree.step_mantissa = geometry.step_mantissa;
      tree.step_exponent = geometry.step_exponent - doublings;
      ClusterBoxes room;
      const auto boxes = triangle_boxes(cluster, TreeGridMap(tree, geometry), room);
      restorer.begin(geometry, tree, cluster);
      for (int round = 0; round < 8; ++round, ++node_count) {
        const LeafNode leaves = random_leaves(cluster.triangle_count(), random);
        PackedNode expected, restored;
        const TreeGridBox whole = write_leaf_node(leaves, boxes, c, 3, expected);
        const node_kernels::Box box = restorer.write(leaves, c, 3, restored);
        EXPECT_EQ(std::memcmp(&expected, &restored, sizeof expected), 0) << "cluster " << c << ", " << doublings;
        for (size_t axis = 0; axis < 3; ++axis) {
          EXPECT_EQ(box.lo[axis], whole.lo[axis]);
          EXPECT_EQ(-box.minus_hi[axis], whole.hi[axis]);
        }
      }
    }
  }
  EXPECT_GT(node_count, 100u);
  return widest;
}

BakedFile bake_precisely(const Mesh& mesh, double precision) {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = precision;
  return BakedFile::from_bytes(test::bake(test::scene_of(mesh), config).bytes);
}

TEST(LeafRestorer, MakesTheNodesThatBoxesOfTrianglesGive) {
  for (const auto* kernels : test::kernel_sets(node_kernels::kPortable, node_kernels::kernels())) {
    EXPECT_LE(compare(bake_precisely(test::sphere_mesh(30), 1e-4), *kernels), 57u);
    EXPECT_LE(compare(bake_precisely(test::soup_mesh(3000, 5), 1e-3), *kernels), 57u);
  }
}

TEST(LeafRestorer, ReadsVerticesWiderThanAWord) {
  for (const auto* kernels : test::kernel_sets(node_kernels::kPortable, node_kernels::kernels()))
    EXPECT_GT(compare(bake_precisely(test::soup_mesh(2000, 6), 1e-7), *kernels), 57u);
}

} // namespace
} // namespace packtrace
