#include "compress/bake/lod/cluster_lod.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/bake/clusters/clusterize.h"
#include "compress/format/cluster/index_codec.h"
#include "tests/compress/lod/lod_class_meshes.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

/// Cluster numbers per generating group.
std::vector<std::vector<uint32_t>> clusters_made_by(const ClusterLod& lod) {
  std::vector<std::vector<uint32_t>> made(lod.groups.size());
  for (uint32_t i = 0; i < lod.clusters.size(); ++i)
    if (lod.clusters[i].generating_group != kNoGroup) made[lod.clusters[i].generating_group].push_back(i);
  return made;
}

std::vector<std::vector<uint32_t>> clusters_in(const ClusterLod& lod) {
  std::vector<std::vector<uint32_t>> in(lod.groups.size());
  for (uint32_t i = 0; i < lod.clusters.size(); ++i) in[lod.clusters[i].group].push_back(i);
  return in;
}

class ClusterLodOf : public testing::TestWithParam<NamedMesh> {
protected:
  const BuiltLod& built_ = built_lod(GetParam());
  const ClusterLod& lod_ = built_.lod;
};

TEST_P(ClusterLodOf, KeepsItsLimits) {
  ASSERT_EQ(lod_.clusters.empty(), built_.geometry.triangles.empty()); // none are left if all triangles are degenerate
  EXPECT_LE(lod_.level_count, baked::kMaxLodLevels);
  for (const LodCluster& c : lod_.clusters) {
    EXPECT_GE(c.range.triangle_count, 1u);
    EXPECT_LE(c.range.triangle_count, kMaxClusterTriangles);
    std::set<uint32_t> vertices;
    for (uint32_t i = 0; i < c.range.triangle_count; ++i)
      for (int corner = 0; corner < 3; ++corner) {
        const uint32_t v = lod_.triangles[c.range.first_triangle + i][corner];
        ASSERT_LT(v, lod_.vertices.size());
        ASSERT_LT(lod_.vertices[v].position, lod_.positions.size());
        vertices.insert(v);
      }
    EXPECT_LE(vertices.size(), kMaxClusterVertices);
    ASSERT_LT(c.group, lod_.groups.size());
    EXPECT_EQ(lod_.groups[c.group].level, c.level);
    if (c.level == 0) {
      EXPECT_EQ(c.generating_group, kNoGroup);
    } else {
      EXPECT_EQ(lod_.groups[c.generating_group].level, c.level - 1);
    }
  }
  for (const auto& members : clusters_in(lod_)) EXPECT_LE(members.size(), 32u);
}

TEST_P(ClusterLodOf, LevelZeroIsWhatWasGiven) {
  std::vector<Triangle> triangles;
  for (const LodCluster& c : lod_.clusters)
    for (uint32_t i = 0; i < c.range.triangle_count && c.level == 0; ++i)
      triangles.push_back(lod_.triangles[c.range.first_triangle + i]);
  EXPECT_EQ(triangles, built_.base.triangles);
}

TEST_P(ClusterLodOf, EveryChainIsCutOnce) {
  const auto made = clusters_made_by(lod_);
  const std::vector<double> all = thresholds(lod_);
  Random random(5);
  std::vector<uint32_t> base;
  for (uint32_t i = 0; i < lod_.clusters.size(); ++i)
    if (lod_.clusters[i].level == 0) base.push_back(i);
  if (base.empty()) GTEST_SKIP() << "no triangle has an area";
  for (int repeat = 0; repeat < 2000; ++repeat) {
    const double threshold = all[random.bits() % all.size()];
    uint32_t cluster = base[random.bits() % base.size()], selected = 0;
    for (;;) {
      const LodCluster& c = lod_.clusters[cluster];
      const LodGroup& group = lod_.groups[c.group];
      const double own = c.generating_group == kNoGroup ? 0.0 : lod_.groups[c.generating_group].error;
      selected += group.error > threshold && own <= threshold;
      if (group.terminal) break;
      ASSERT_FALSE(made[c.group].empty());
      cluster = made[c.group][random.bits() % made[c.group].size()];
    }
    EXPECT_EQ(selected, 1u) << "at " << threshold;
  }
}

TEST_P(ClusterLodOf, ErrorsGrowAndSpheresHoldWhatIsBelow) {
  for (const LodCluster& c : lod_.clusters) {
    const LodGroup& group = lod_.groups[c.group];
    EXPECT_EQ(group.terminal, std::isinf(group.error));
    if (!group.terminal) {
      EXPECT_LE(group.error, 2.0 * group.sphere.radius);
    }
    const LodSphere& made_in = (c.generating_group == kNoGroup ? group : lod_.groups[c.generating_group]).sphere;
    for (uint32_t i = 0; i < c.range.triangle_count; ++i)
      for (int corner = 0; corner < 3; ++corner) {
        const LatticePoint& q =
            lod_.positions[lod_.vertices[lod_.triangles[c.range.first_triangle + i][corner]].position];
        DVec3 p;
        for (size_t axis = 0; axis < 3; ++axis)
          p[static_cast<int>(axis)] = static_cast<double>(q[axis] - built_.geometry.origin[axis]);
        EXPECT_LE(glm::length(p - made_in.center), made_in.radius);
      }
    if (c.generating_group == kNoGroup) continue;
    const LodGroup& below = lod_.groups[c.generating_group];
    EXPECT_GE(group.error, below.error);
    EXPECT_LT(glm::length(group.sphere.center - below.sphere.center) + below.sphere.radius, group.sphere.radius);
  }
}

TEST_P(ClusterLodOf, LevelsHoldTheTerminalGroupsBelow) {
  for (uint32_t level = 0; level < lod_.level_count; ++level) {
    uint64_t triangles = 0;
    for (const LodCluster& c : lod_.clusters)
      triangles += c.level == level || (c.level < level && lod_.groups[c.group].terminal) ? c.range.triangle_count : 0;
    EXPECT_EQ(triangles, level_triangles(lod_, level));
    EXPECT_GT(triangles, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(StressMeshes, ClusterLodOf, testing::ValuesIn(stress_meshes()),
                         [](const auto& tested) { return identifier(tested.param.name); });

/// Open borders may be simplified; closed meshes have none.
class ClosedClusterLodOf : public ClusterLodOf {};

TEST_P(ClosedClusterLodOf, GroupsKeepTheirBorders) {
  const auto in = clusters_in(lod_), made = clusters_made_by(lod_);
  for (size_t group = 0; group < in.size(); ++group)
    if (!lod_.groups[group].terminal) {
      EXPECT_EQ(boundary(lod_, in[group]), boundary(lod_, made[group]));
    }
}

TEST_P(ClosedClusterLodOf, EveryCutOfAClosedMeshIsClosed) {
  ASSERT_TRUE(boundary(lod_, cut_clusters(lod_, -0.0)).empty());
  std::vector<double> all = thresholds(lod_);
  const size_t step = std::max<size_t>(all.size() / 200, 1); // all of them if there are few
  for (size_t i = 0; i < all.size(); i += step) {
    const std::vector<uint32_t> cut = cut_clusters(lod_, all[i]);
    EXPECT_FALSE(cut.empty());
    EXPECT_TRUE(boundary(lod_, cut).empty()) << "at " << all[i];
  }
}

INSTANTIATE_TEST_SUITE_P(ClosedMeshes, ClosedClusterLodOf, testing::ValuesIn(closed_stress_meshes()),
                         [](const auto& tested) { return identifier(tested.param.name); });

TEST(ClusterLod, EveryLevelHasLittleLessThanHalfOfTheOneBelow) {
  const ClusterLod lod = build_lod(torus_mesh(200, 120)).lod;
  for (uint32_t level = 0; level + 1 < lod.level_count && level_triangles(lod, level) > 2000; ++level)
    EXPECT_LT(static_cast<double>(level_triangles(lod, level + 1)),
              0.48 * static_cast<double>(level_triangles(lod, level)));
  EXPECT_LE(level_triangles(lod, lod.level_count - 1), 128u);
}

TEST(ClusterLod, OneClusterIsSimplifiedOn) {
  const BuiltLod built = build_lod(torus_mesh(12, 5)); // 120 triangles in one cluster
  ASSERT_EQ(level_triangles(built.lod, 0), 120u);
  EXPECT_GT(built.lod.level_count, 1u);
  EXPECT_LE(level_triangles(built.lod, built.lod.level_count - 1), 16u);
}

TEST(ClusterLod, TheCoarsestLevelOfLoosePiecesIsSmall) {
  const BuiltLod built = build_lod(tetrahedra_mesh(2000, 4));
  EXPECT_LE(level_triangles(built.lod, built.lod.level_count - 1), 80u); // 1 %
}

TEST(ClusterLod, SeamsOfNormalsDoNotHinderIt) {
  const ClusterLod lod = build_lod(half_faceted(torus_mesh(200, 120))).lod;
  EXPECT_LE(level_triangles(lod, 3), 8000u); // of 48,000
}

TEST(ClusterLod, APlaneHasNoErrorThatMatters) {
  const BuiltLod built = build_lod(grid_mesh(100));
  uint32_t tested = 0;
  for (const LodGroup& group : built.lod.groups)
    if (!group.terminal && group.level < 4) {
      EXPECT_LT(group.error, 2.0); // steps
      ++tested;
    }
  EXPECT_GT(tested, 4u);
}

TEST(ClusterLod, SheetsOfSeveralLayersKeepTheirOutline) {
  for (const bool other_side : {false, true})
    for (const float cut : {0.1f, 0.5f}) {
      const BuiltLod built = build_lod(twice(chamfered_sheet(cut), other_side));
      ASSERT_FALSE(built.lod.groups.empty());
      const double width = built.lod.groups[0].sphere.radius;
      uint32_t tested = 0;
      for (const LodGroup& group : built.lod.groups)
        if (!group.terminal && group.level < 2) {
          EXPECT_LT(group.error, 0.02 * width) << "level " << group.level;
          ++tested;
        }
      EXPECT_GT(tested, 0u);
    }
}

/// The borders between groups of such meshes are long; locks that never move would hold up the coarse levels.
TEST(ClusterLod, SpongesSimplifyToAFewTriangles) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  for (const ClassMesh& mesh : class_meshes()) {
    if (mesh.of_class != "sponge") continue;
    const ClusterLod lod = build_lod(mesh.make()).lod;
    EXPECT_LE(level_triangles(lod, lod.level_count - 1), 64u) << mesh.name;
  }
}

TEST(ClusterLod, SameForAnyThreadCount) {
  const Mesh mesh = half_faceted(torus_mesh(150, 90));
  const auto with_threads = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return build_lod(mesh).lod;
  };
  const ClusterLod one = with_threads(1), four = with_threads(4);
  EXPECT_EQ(one.positions, four.positions);
  EXPECT_EQ(one.vertices, four.vertices);
  EXPECT_EQ(one.triangles, four.triangles);
  ASSERT_EQ(one.clusters.size(), four.clusters.size());
  for (size_t i = 0; i < one.clusters.size(); ++i) {
    const LodCluster &a = one.clusters[i], &b = four.clusters[i];
    EXPECT_EQ(std::tie(a.range.first_triangle, a.range.triangle_count, a.range.kind, a.level, a.group),
              std::tie(b.range.first_triangle, b.range.triangle_count, b.range.kind, b.level, b.group));
    EXPECT_EQ(a.generating_group, b.generating_group);
  }
  ASSERT_EQ(one.groups.size(), four.groups.size());
  for (size_t i = 0; i < one.groups.size(); ++i) {
    EXPECT_EQ(one.groups[i].level, four.groups[i].level);
    EXPECT_EQ(one.groups[i].terminal, four.groups[i].terminal);
    EXPECT_EQ(one.groups[i].error, four.groups[i].error);
    EXPECT_EQ(one.groups[i].sphere.center, four.groups[i].sphere.center);
    EXPECT_EQ(one.groups[i].sphere.radius, four.groups[i].sphere.radius);
  }
}

} // namespace
} // namespace packtrace::test
