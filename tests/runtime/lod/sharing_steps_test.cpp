// Tests the steps scheme: which BLASes instances share, and which instances get an own cut.

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "tests/runtime/lod/sharing_cases.h"

namespace packtrace::sharing_test {
namespace {

TEST(LodSharing, TracedTrianglesStayWithinTheRatio) {
  const std::vector<LodGeometry> geometries = some_geometries(5);
  for (const double ratio : {1.0, 1.1, 1.25, 2.0})
    for (const double step_ratio : {1.15, 4.0}) {
      SharingConfig config;
      config.step_ratio = step_ratio;
      config.traced_ratio = ratio;
      config.measure = true;
      LodSharing sharing(geometries, wild_instances(800, 5, 4), config);
      const LodPlan plan = sharing.plan(view_from(DVec3(0.0)));
      EXPECT_LE(static_cast<double>(plan.traced_triangles), ratio * static_cast<double>(plan.own.traced_triangles));
      EXPECT_GT(plan.builds, 0u);
    }
}

/// If the limit requires own cuts, they go to the instances with the largest savings.
TEST(LodSharing, OwnCutsGoToThoseThatSaveMost) {
  const std::vector<LodGeometry> geometries = some_geometries(4);
  const std::vector<LodInstance> instances = wild_instances(400, 4, 11);
  const DetailView view = view_from(DVec3(0.0));
  SharingConfig config;
  config.step_ratio = 4.0; // far apart, so that the limit requires own cuts
  config.own_cut_ratio = 1e9;
  config.traced_ratio = 1.05;
  config.share_equal_cuts = false;
  LodSharing sharing(geometries, instances, config);
  const LodPlan plan = sharing.plan(view);
  std::vector<uint64_t> least_of_own(4, ~uint64_t{0}), most_of_others(4);
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t g = instances[i].geometry;
    const std::span<const LodStep> steps = sharing.steps(g);
    const uint64_t shared = steps[plan.step_of_instance[i]].triangles;
    const uint64_t saved = shared - size_of_cut(geometries[g], own_cut(geometries[g], instances[i], view)).triangles;
    if (plan.category_of_instance[i] == InstanceCategory::kOwn)
      least_of_own[g] = std::min(least_of_own[g], saved);
    else
      most_of_others[g] = std::max(most_of_others[g], saved);
  }
  EXPECT_GT(plan.category_counts[static_cast<size_t>(InstanceCategory::kOwn)], 5u);
  for (size_t g = 0; g < 4; ++g) EXPECT_GE(least_of_own[g], most_of_others[g]);
}

TEST(LodSharing, SharesMoreTheMoreMayBeTraced) {
  const std::vector<LodGeometry> geometries = some_geometries(5);
  const std::vector<LodInstance> instances = test::random_instances(3000, 5, 100.0, 2.0, 1);
  uint64_t before = ~uint64_t{0};
  for (const double ratio : {1.0, 1.25, 2.0, 1e9}) {
    SharingConfig config;
    config.traced_ratio = ratio;
    config.own_cut_ratio = 1e9;
    const uint64_t builds = LodSharing(geometries, instances, config).plan(view_from(DVec3(0.0))).builds;
    EXPECT_LT(builds, before);
    before = builds;
  }
  EXPECT_LE(before, geometries.size()); // no limit: one build per geometry
}

TEST(LodSharing, ToleranceIsKeptToItsLevels) {
  const std::vector<LodGeometry> geometries = some_geometries(4);
  const std::vector<LodInstance> instances = wild_instances(600, 4, 6);
  const DetailView view = view_from(DVec3(0.0));
  SharingConfig config;
  config.tolerant_levels = 2;
  config.traced_ratio = 1.0;
  LodSharing sharing(geometries, instances, config);
  const LodPlan plan = sharing.plan(view);
  size_t coarser = 0;
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const PlannedBlas& blas = plan.blas[plan.blas_of_instance[i]];
    if (blas.kind == BlasKind::kOwn) continue;
    const std::span<const LodStep> steps = sharing.steps(instances[i].geometry);
    const uint32_t needed = plan.step_of_instance[i];
    EXPECT_LE(blas.index, needed + 2);
    coarser += blas.index > needed;
  }
  EXPECT_GT(coarser, 50u);
}

TEST(LodSharing, OnlyEnabledLevelsAreShared) {
  const std::vector<LodGeometry> geometries = some_geometries(4);
  const std::vector<LodInstance> instances = wild_instances(600, 4, 7);
  const DetailView view = view_from(DVec3(0.0));
  for (const SharingScheme scheme : {SharingScheme::kOneProvider, SharingScheme::kSteps}) {
    SharingConfig config;
    config.scheme = scheme;
    config.share_equal_cuts = false;
    config.shared_levels = 0;
    const LodPlan none = LodSharing(geometries, instances, config).plan(view);
    EXPECT_EQ(none.category_counts[static_cast<size_t>(InstanceCategory::kShares)], 0u);
    EXPECT_EQ(none.builds + none.category_counts[0], instances.size());
    config.shared_levels = 3;
    const LodPlan some = LodSharing(geometries, instances, config).plan(view);
    EXPECT_LT(some.builds, none.builds);
    config.shared_levels = 32;
    EXPECT_LT(LodSharing(geometries, instances, config).plan(view).builds, some.builds);
  }
}

} // namespace
} // namespace packtrace::sharing_test
