// Tests that stated LOD errors are never below measured distances.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "tests/compress/lod/lod_class_meshes.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/lod/surface_distance.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

/// Allows for rounding in the measurement.
double with_rounding(double error) { return error * (1.0 + 1e-6) + 1e-6; }

class LodSurfaces {
public:
  explicit LodSurfaces(BuiltLod built) : built_(std::move(built)) {
    for (const LatticePoint& q : built_.lod.positions) {
      DVec3 p;
      for (size_t axis = 0; axis < 3; ++axis)
        p[static_cast<int>(axis)] = static_cast<double>(q[axis] - built_.geometry.origin[axis]);
      points_.push_back(p);
    }
  }

  const ClusterLod& lod() const { return built_.lod; }

  double diagonal() const {
    DVec3 lo(points_.at(0)), hi(lo);
    for (const DVec3& p : points_) lo = glm::min(lo, p), hi = glm::max(hi, p);
    return glm::length(hi - lo);
  }

  std::vector<Triangle> triangles_of(const std::vector<uint32_t>& clusters) const {
    std::vector<Triangle> result;
    const ClusterLod& lod = built_.lod;
    for (const uint32_t number : clusters) {
      const ClusterRange& range = lod.clusters[number].range;
      for (uint32_t i = 0; i < range.triangle_count; ++i) {
        const Triangle& t = lod.triangles[range.first_triangle + i];
        result.emplace_back(lod.vertices[t.x].position, lod.vertices[t.y].position, lod.vertices[t.z].position);
      }
    }
    return result;
  }

  double two_sided(const std::vector<Triangle>& a, const std::vector<Triangle>& b, size_t samples) const {
    const SurfaceDistance to_a(points_, a), to_b(points_, b);
    return std::max(surface_distance(points_, a, to_b, samples).max, surface_distance(points_, b, to_a, samples).max);
  }

protected:
  const BuiltLod built_;
  std::vector<DVec3> points_;
};

class LodErrorOf : public LodSurfaces, public testing::TestWithParam<NamedMesh> {
protected:
  LodErrorOf() : LodSurfaces(built_lod(GetParam())) {}
};

/// Tested in this direction only: the clusters of level 0 that a group was made from extend beyond the group.
TEST_P(LodErrorOf, IsNotBelowTheDistanceOfEachGroupFromItsPartOfLevelZero) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const ClusterLod& lod = built_.lod;
  // The level 0 clusters that each group stands for.
  std::vector<std::vector<uint32_t>> stands_for(lod.groups.size()), made(lod.groups.size());
  for (uint32_t i = 0; i < lod.clusters.size(); ++i) {
    const LodCluster& c = lod.clusters[i];
    std::vector<uint32_t>& all = stands_for[c.group];
    if (c.generating_group == kNoGroup) {
      all.push_back(i);
    } else {
      made[c.generating_group].push_back(i);
      all.insert(all.end(), stands_for[c.generating_group].begin(), stands_for[c.generating_group].end());
    }
  }
  for (size_t i = 0; i < lod.groups.size(); ++i) {
    if (lod.groups[i].terminal) continue;
    std::sort(stands_for[i].begin(), stands_for[i].end());
    stands_for[i].erase(std::unique(stands_for[i].begin(), stands_for[i].end()), stands_for[i].end());
    const std::vector<Triangle> base = triangles_of(stands_for[i]);
    const SurfaceDistance to_base(points_, base);
    EXPECT_LE(surface_distance(points_, triangles_of(made[i]), to_base, 1000).max, with_rounding(lod.groups[i].error))
        << "group " << i << " of level " << lod.groups[i].level;
  }
}

TEST_P(LodErrorOf, IsNotBelowTheDistanceOfCuts) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const ClusterLod& lod = built_.lod;
  const std::vector<Triangle> base = triangles_of(cut_clusters(lod, 0.0));
  for (uint32_t level = 0; level + 1 < lod.level_count; ++level) {
    double threshold = 0.0;
    for (const LodGroup& group : lod.groups)
      if (group.level == level && !group.terminal) threshold = std::max(threshold, group.error);
    EXPECT_LE(two_sided(base, triangles_of(cut_clusters(lod, threshold)), 4000), with_rounding(threshold));
  }
}

/// Guards against errors that only add up over levels.
TEST(LodError, OfCoarseLevelsIsNotFarAboveTheDistance) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const LodSurfaces surfaces(build_lod(torus_mesh(200, 120)));
  const ClusterLod& lod = surfaces.lod();
  ASSERT_GE(lod.level_count, 4u);
  const std::vector<Triangle> base = surfaces.triangles_of(cut_clusters(lod, 0.0));
  for (uint32_t level = 0; level + 1 < lod.level_count; ++level) {
    double threshold = 0.0;
    for (const LodGroup& group : lod.groups)
      if (group.level == level && !group.terminal) threshold = std::max(threshold, group.error);
    const double measured = surfaces.two_sided(base, surfaces.triangles_of(cut_clusters(lod, threshold)), 4000);
    EXPECT_LE(threshold, 2.0 * measured) << "level " << level + 1;
  }
}

/// If tips of thin parts recede, the cuts of all coarser levels are far off.
TEST(LodError, OfFinsIsSmall) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const LodSurfaces surfaces(build_lod(fins_mesh(150, 20, 7)));
  const ClusterLod& lod = surfaces.lod();
  ASSERT_GE(lod.level_count, 5u);
  const std::vector<Triangle> base = surfaces.triangles_of(cut_clusters(lod, 0.0));
  const double size = surfaces.diagonal();
  const std::array<double, 3> limits = {0.001, 0.0085, 0.0125}; // 0.0075, 0.016 and 0.035 where tips recede
  for (uint32_t level = 0; level < limits.size(); ++level) {
    double stated = 0.0;
    for (const LodGroup& group : lod.groups)
      if (group.level == level && !group.terminal) stated = std::max(stated, group.error);
    const double measured = surfaces.two_sided(base, surfaces.triangles_of(cut_clusters(lod, stated)), 4000);
    EXPECT_LE(stated, 2.0 * measured) << "level " << level + 1;
    EXPECT_LE(measured, limits[level] * size) << "level " << level + 1;
  }
}

/// Spheres with long spikes, down to a few triangles: images there are far from their preimages.
TEST(LodError, OfTheLastTrianglesIsNotBelowTheDistance) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  Random random(11);
  for (int body = 0; body < 30; ++body) {
    Mesh mesh = sphere_mesh(20);
    for (int horn = 0; horn < 6; ++horn) {
      const DVec3 at = glm::normalize(DVec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
      const double length = random.uniform(0.5, 3.0);
      for (Vec3& p : mesh.positions) {
        const double off = glm::length(glm::normalize(DVec3(p)) - at);
        p *= static_cast<float>(1.0 + length * std::exp(-20.0 * off * off));
      }
    }
    const LodSurfaces surfaces(build_lod(mesh));
    const ClusterLod& lod = surfaces.lod();
    ASSERT_GE(lod.level_count, 2u);
    const std::vector<Triangle> base = surfaces.triangles_of(cut_clusters(lod, 0.0));
    for (const LodGroup& group : lod.groups) {
      if (group.terminal) continue;
      EXPECT_LE(surfaces.two_sided(base, surfaces.triangles_of(cut_clusters(lod, group.error)), 2000),
                with_rounding(group.error))
          << "body " << body << ", group of level " << group.level;
    }
  }
}

/// Small meshes of the classes that lod_benchmark measures.
std::vector<NamedMesh> small_class_meshes() {
  return {
      {"bent plate", [] { return plate_mesh(30, 1e-3, 0.15); }, true},
      {"very thin plate", [] { return plate_mesh(30, 1e-4, 0.05); }, true},
      {"sponge", [] { return sponge_mesh(2); }, true},
      {"strands", [] { return strands_mesh(20, 25, 4, 0.004, 5); }, true},
  };
}
INSTANTIATE_TEST_SUITE_P(Classes, LodErrorOf, testing::ValuesIn(small_class_meshes()),
                         [](const auto& tested) { return identifier(tested.param.name); });
INSTANTIATE_TEST_SUITE_P(StressMeshes, LodErrorOf, testing::ValuesIn(stress_meshes()),
                         [](const auto& tested) { return identifier(tested.param.name); });

} // namespace
} // namespace packtrace::test
