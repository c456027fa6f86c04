#include "runtime/lod/lod_sharing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "tests/runtime/lod/sharing_cases.h"
#include "tests/sanitized.h"

namespace packtrace::sharing_test {
namespace {

constexpr SharingScheme kSchemes[] = {SharingScheme::kOff, SharingScheme::kOneProvider, SharingScheme::kSteps};

uint32_t level_of_group(const LodGeometry& geometry, uint32_t group) {
  uint32_t level = 0;
  while (level < geometry.last_level() && geometry.levels()[level + 1].first_group <= group) ++level;
  return level;
}

/// For each cluster of level 0, and so for its triangles: the level of the cut's cluster on a chain upwards. `turn`
/// selects one of several chains.
std::vector<uint32_t> levels_of_triangles(const LodGeometry& geometry, std::span<const uint64_t> passed,
                                          uint32_t turn) {
  const std::span<const LodLink> links = geometry.links();
  std::vector<std::vector<uint32_t>> made(links.size() + 1);
  for (uint32_t i = 0; i < links.size(); ++i)
    if (links[i].generating_group != baked::kNoLodGroup) made[links[i].generating_group].push_back(i);
  std::vector<uint32_t> levels;
  for (uint32_t i = 0; i < links.size(); ++i) {
    if (links[i].generating_group != baked::kNoLodGroup) continue;
    uint32_t at = i;
    for (;;) {
      const uint32_t group = links[at].group, rank = geometry.rank_of_group(group);
      if (rank == kNoRank || !rank_passes(passed, rank) || made[group].empty()) break;
      at = made[group][(turn + i) % made[group].size()];
    }
    levels.push_back(level_of_group(geometry, links[at].group));
  }
  return levels;
}

/// For every triangle of level 0, an instance uses the level of its own cut or a finer one.
TEST(LodSharing, StrictSchemesNeverGiveLessDetailThanTheOwnCut) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const std::vector<LodGeometry> geometries = some_geometries(6);
  const std::vector<LodInstance> instances = wild_instances(600, 6, 1);
  for (const SharingScheme scheme : kSchemes)
    for (const bool merge : {false, true}) {
      SharingConfig config;
      config.scheme = scheme;
      config.merge_own_cuts = merge;
      LodSharing sharing(geometries, instances, config);
      size_t shared = 0, own = 0, finer = 0;
      for (uint32_t frame = 0; frame < 3; ++frame) {
        const DetailView view = view_from(DVec3(5.0 * frame, frame, -2.0 * frame));
        const LodPlan plan = sharing.plan(view);
        for (uint32_t i = 0; i < instances.size(); ++i) {
          const LodGeometry& geometry = geometries[instances[i].geometry];
          const std::vector<uint64_t> needed = own_cut(geometry, instances[i], view);
          const std::vector<uint64_t> used = used_cut(sharing, plan, i);
          for (size_t word = 0; word < used.size(); ++word) ASSERT_EQ(used[word] & ~needed[word], 0u);
          for (uint32_t turn = 0; turn < 2; ++turn) {
            const std::vector<uint32_t> own_levels = levels_of_triangles(geometry, needed, turn);
            const std::vector<uint32_t> used_levels = levels_of_triangles(geometry, used, turn);
            for (size_t t = 0; t < own_levels.size(); ++t) ASSERT_LE(used_levels[t], own_levels[t]);
          }
          const PlannedBlas& blas = plan.blas[plan.blas_of_instance[i]];
          shared += blas.users > 1 && blas.kind != BlasKind::kCoarsest;
          own += blas.kind == BlasKind::kOwn;
          finer += used != needed;
        }
      }
      EXPECT_GT(shared, 100u);
      EXPECT_GT(finer, 50u);
      if (scheme == SharingScheme::kOneProvider) {
        EXPECT_GT(own, 5u);
      }
    }
}

TEST(LodSharing, WithoutSharedLevelsEachHasItsOwnCut) {
  const std::vector<LodGeometry> geometries = some_geometries(4);
  const std::vector<LodInstance> instances = wild_instances(300, 4, 2);
  SharingConfig config = test::own_cuts();
  config.measure = true;
  LodSharing sharing(geometries, instances, config);
  const DetailView view = view_from(DVec3(0.0));
  const LodPlan plan = sharing.plan(view);
  uint64_t triangles = 0;
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const std::vector<uint64_t> own = own_cut(geometries[instances[i].geometry], instances[i], view);
    EXPECT_EQ(used_cut(sharing, plan, i), own);
    triangles += size_of_cut(geometries[instances[i].geometry], own).triangles;
  }
  EXPECT_EQ(plan.traced_triangles, triangles);
  EXPECT_EQ(plan.own.traced_triangles, triangles);
  EXPECT_EQ(plan.builds + plan.category_counts[0], instances.size());
  EXPECT_EQ(plan.own.builds, plan.builds);
  EXPECT_EQ(plan.own.built_triangles, plan.built_triangles);
}

/// What own cuts would cost does not depend on how BLASes are shared.
TEST(LodSharing, AllSchemesStateTheSameOwnCuts) {
  const std::vector<LodGeometry> geometries = some_geometries(4);
  const std::vector<LodInstance> instances = wild_instances(300, 4, 2);
  const DetailView view = view_from(DVec3(0.0));
  SharingConfig config = test::own_cuts();
  config.measure = true;
  const OwnCuts expected = LodSharing(geometries, instances, config).plan(view).own;
  EXPECT_GT(expected.builds, 20u);
  EXPECT_LT(expected.built_triangles, expected.traced_triangles);
  for (const SharingScheme scheme : kSchemes) {
    SharingConfig shared;
    shared.scheme = scheme;
    shared.measure = true;
    const OwnCuts own = LodSharing(geometries, instances, shared).plan(view).own;
    EXPECT_EQ(own.builds, expected.builds);
    EXPECT_EQ(own.built_triangles, expected.built_triangles);
    EXPECT_EQ(own.traced_triangles, expected.traced_triangles);
  }
}

/// The totals of a plan match its contents, and each BLAS has the stated size.
TEST(LodSharing, PlansAddUp) {
  const std::vector<LodGeometry> geometries = some_geometries(5);
  const std::vector<LodInstance> instances = wild_instances(500, 5, 3);
  for (const SharingScheme scheme : kSchemes) {
    SharingConfig config;
    config.scheme = scheme;
    LodSharing sharing(geometries, instances, config);
    const LodPlan plan = sharing.plan(view_from(DVec3(1.0)));
    std::vector<uint32_t> users(plan.blas.size());
    std::array<uint64_t, 4> categories{};
    for (uint32_t i = 0; i < instances.size(); ++i) {
      ++users[plan.blas_of_instance[i]];
      ++categories[static_cast<size_t>(plan.category_of_instance[i])];
      EXPECT_EQ(plan.blas[plan.blas_of_instance[i]].geometry, instances[i].geometry);
    }
    EXPECT_EQ(categories, plan.category_counts);
    uint64_t builds = 0, built = 0, clusters = 0, traced = 0;
    for (size_t b = 0; b < plan.blas.size(); ++b) {
      const PlannedBlas& blas = plan.blas[b];
      const LodGeometry& geometry = geometries[blas.geometry];
      EXPECT_EQ(blas.users, users[b]);
      EXPECT_GT(blas.users, 0u);
      const CutSize size = size_of_cut(geometry, passed_of_blas(geometry, sharing.steps(blas.geometry), plan, blas));
      EXPECT_EQ(blas.triangles, size.triangles);
      EXPECT_EQ(blas.clusters, size.clusters);
      traced += blas.triangles * blas.users;
      if (blas.kind == BlasKind::kCoarsest) continue;
      ++builds, built += blas.triangles, clusters += blas.clusters;
    }
    EXPECT_EQ(plan.builds, builds);
    EXPECT_EQ(plan.built_triangles, built);
    EXPECT_EQ(plan.built_clusters, clusters);
    EXPECT_EQ(plan.traced_triangles, traced);
    EXPECT_EQ(plan.category_counts[1] + plan.category_counts[3], plan.builds);
  }
}

/// Histograms match the ranges, and the plan does not depend on the number of threads.
TEST(LodSharing, IsTheSameForAnyNumberOfThreads) {
  const std::vector<LodGeometry> geometries = some_geometries(7);
  const std::vector<LodInstance> instances = wild_instances(5000, 7, 5);
  for (const SharingScheme scheme : kSchemes) {
    SharingConfig config;
    config.scheme = scheme;
    config.measure = true;
    std::vector<LodPlan> plans;
    for (const size_t threads : {size_t{1}, size_t{2}, size_t{5}}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      LodSharing sharing(geometries, instances, config);
      sharing.plan(view_from(DVec3(100.0))); // earlier frames must not matter
      plans.push_back(sharing.plan(view_from(DVec3(0.5))));
    }
    std::vector<uint32_t> starts(7), ends(7);
    for (size_t g = 0; g < 7; ++g)
      for (uint32_t level = 0; level < baked::kMaxLodLevels; ++level) {
        const LevelHistogram& h = plans[0].histograms[g];
        starts[g] += h.starts[level];
        ends[g] += h.ends[level];
        if (h.ends[level] == 0) continue;
        const uint32_t provider = h.provider[level] & (kMaxLodInstances - 1);
        EXPECT_EQ(instances[provider].geometry, g);
        EXPECT_LE(h.provider[level] >> 27, level);
      }
    for (size_t g = 0; g < 7; ++g) {
      const auto of_geometry = [&](const LodInstance& i) { return i.geometry == g; };
      EXPECT_EQ(starts[g], std::count_if(instances.begin(), instances.end(), of_geometry));
      EXPECT_EQ(ends[g], starts[g]);
    }
    for (size_t p = 1; p < plans.size(); ++p) {
      EXPECT_EQ(plans[p].blas_of_instance, plans[0].blas_of_instance);
      EXPECT_EQ(plans[p].category_of_instance, plans[0].category_of_instance);
      EXPECT_EQ(plans[p].allowed_error_of_instance, plans[0].allowed_error_of_instance);
      EXPECT_EQ(plans[p].step_of_instance, plans[0].step_of_instance);
      EXPECT_EQ(plans[p].passed, plans[0].passed);
      EXPECT_EQ(plans[p].traced_triangles, plans[0].traced_triangles);
      EXPECT_EQ(plans[p].own.traced_triangles, plans[0].own.traced_triangles);
      ASSERT_EQ(plans[p].blas.size(), plans[0].blas.size());
      for (size_t g = 0; g < 7; ++g) EXPECT_EQ(plans[p].histograms[g].provider, plans[0].histograms[g].provider);
    }
  }
}

/// Of identical instances, the one with the highest number provides, in every frame.
TEST(LodSharing, TheProviderIsStable) {
  const std::vector<LodGeometry> geometries = some_geometries(1);
  const std::vector<LodInstance> instances(50, {0, DAffine(DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1), DVec3(8))});
  SharingConfig config;
  config.scheme = SharingScheme::kOneProvider;
  LodSharing sharing(geometries, instances, config);
  double error_px = 0.01; // an error for which first and last level are the same, and not the coarsest
  LodPlan plan;
  do plan = sharing.plan(view_from(DVec3(0.0), error_px *= 1.2));
  while (plan.category_counts[static_cast<size_t>(InstanceCategory::kShares)] == 0 && error_px < 1e6);
  ASSERT_EQ(plan.category_counts[static_cast<size_t>(InstanceCategory::kShares)], 49u);
  EXPECT_EQ(plan.category_of_instance[49], InstanceCategory::kProvider);
  EXPECT_EQ(plan.builds, 1u);
}

TEST(LodSharing, CulledInstancesAreCoarserAndOthersAsTheyWere) {
  const std::vector<LodGeometry> geometries = some_geometries(4);
  const std::vector<LodInstance> instances = wild_instances(600, 4, 8);
  const DetailView view = view_from(DVec3(0.0));
  std::vector<uint8_t> culled(instances.size());
  for (size_t i = 0; i < culled.size(); i += 2) culled[i] = 1;
  SharingConfig config = test::own_cuts();
  const LodPlan before = LodSharing(geometries, instances, config).plan(view, culled);
  for (const bool by_level : {false, true}) {
    config.culled_coarser_levels = by_level ? 1 : 0;
    config.culled_error_scale = by_level ? 1.0 : 4.0;
    LodSharing sharing(geometries, instances, config);
    const LodPlan plan = sharing.plan(view, culled);
    size_t coarser = 0;
    for (uint32_t i = 0; i < instances.size(); ++i) {
      const uint64_t now = plan.blas[plan.blas_of_instance[i]].triangles;
      const uint64_t then = before.blas[before.blas_of_instance[i]].triangles;
      if (culled[i] != 0) {
        EXPECT_LE(now, then);
      } else {
        EXPECT_EQ(now, then);
      }
      coarser += now < then;
      if (by_level || culled[i] == 0) continue;
      EXPECT_EQ(used_cut(sharing, plan, i),
                own_cut(geometries[instances[i].geometry], instances[i], view_from(DVec3(0.0), 4.0)));
    }
    EXPECT_GT(coarser, 100u);
  }
  EXPECT_THROW(LodSharing(geometries, instances, config).plan(view, std::vector<uint8_t>(3)), Error);
}

TEST(LodSharing, MergedCutsAreOneAGeometry) {
  const std::vector<LodGeometry> geometries = some_geometries(4);
  const std::vector<LodInstance> instances = wild_instances(600, 4, 9);
  SharingConfig config = test::own_cuts();
  config.merge_own_cuts = true;
  const LodPlan plan = LodSharing(geometries, instances, config).plan(view_from(DVec3(0.0)));
  EXPECT_EQ(plan.builds, 4u);
}

TEST(LodSharing, MovedInstancesAreSeenWhereTheyAre) {
  const std::vector<LodGeometry> geometries = some_geometries(3);
  std::vector<LodInstance> instances = wild_instances(200, 3, 10);
  LodSharing sharing(geometries, instances, {});
  const DetailView view = view_from(DVec3(0.0));
  const LodPlan before = sharing.plan(view);
  test::Random random(1);
  for (uint32_t i = 0; i < instances.size(); i += 3) {
    instances[i].world_from_object = test::random_affine(random, 30.0);
    sharing.set_transform(i, instances[i].world_from_object);
  }
  const LodPlan after = sharing.plan(view);
  const LodPlan expected = LodSharing(geometries, instances, {}).plan(view);
  EXPECT_EQ(after.blas_of_instance, expected.blas_of_instance);
  EXPECT_EQ(after.allowed_error_of_instance, expected.allowed_error_of_instance);
  EXPECT_NE(after.allowed_error_of_instance, before.allowed_error_of_instance);
}

TEST(LodSharing, NothingIsNothing) {
  const LodPlan plan = LodSharing({}, {}, {}).plan(view_from(DVec3(0.0)));
  EXPECT_TRUE(plan.blas.empty());
  const std::vector<LodGeometry> geometries = some_geometries(2);
  EXPECT_TRUE(LodSharing(geometries, {}, {}).plan(view_from(DVec3(0.0))).blas.empty());
}

TEST(LodSharing, BadInputIsRejected) {
  const std::vector<LodGeometry> geometries = some_geometries(2);
  const auto make = [&](const LodInstance& instance, const SharingConfig& config) {
    LodSharing sharing(geometries, {&instance, 1}, config);
  };
  const SharingConfig good;
  EXPECT_NO_THROW(make({1, DAffine(1.0)}, good));
  EXPECT_THROW(make({2, DAffine(1.0)}, good), Error);
  DAffine infinite(1.0);
  infinite[3][1] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(make({0, infinite}, good), Error);
  const auto reject = [&](const auto& change) {
    SharingConfig config;
    change(config);
    EXPECT_THROW(make({0, DAffine(1.0)}, config), Error);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  reject([](SharingConfig& c) { c.step_ratio = 1.0; });
  reject([&](SharingConfig& c) { c.step_ratio = nan; });
  reject([](SharingConfig& c) { c.traced_ratio = 0.99; });
  reject([&](SharingConfig& c) { c.own_cut_ratio = nan; });
  reject([](SharingConfig& c) { c.shared_levels = 33; });
  reject([](SharingConfig& c) { c.tolerant_levels = 33; });
  reject([](SharingConfig& c) { c.culled_coarser_levels = 33; });
  reject([](SharingConfig& c) { c.culled_error_scale = 0.5; });
  reject([](SharingConfig& c) { c.scheme = static_cast<SharingScheme>(3); });
}

} // namespace
} // namespace packtrace::sharing_test
