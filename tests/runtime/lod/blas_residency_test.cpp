#include "runtime/lod/blas_residency.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/runtime/lod/lod_records.h"

namespace packtrace {
namespace {

/// A few geometries in all directions, and a camera that flies through them.
class Flight : public testing::TestWithParam<SharingConfig> {
protected:
  Flight() {
    for (uint32_t i = 0; i < 4; ++i) geometries.push_back(test::random_records(10 + 10 * i, i + 1).geometry());
    instances = test::random_instances(300, 4, 60.0, 4.0, 1);
  }

  static DetailView view_at(double t) {
    return make_detail_view(DVec3(50.0 * std::cos(3.0 * t), 30.0 * std::sin(5.0 * t), 40.0 * std::sin(2.0 * t)), 0.01,
                            1.0, 1080.0, 1.0);
  }

  std::vector<LodGeometry> geometries;
  std::vector<LodInstance> instances;
  const SharingConfig config = GetParam();
};

SharingConfig scheme(SharingScheme which) {
  SharingConfig config;
  config.scheme = which;
  return config;
}

/// Identifies what an instance uses, independent of its handle.
using Content = std::tuple<uint32_t, BlasKind, uint32_t, std::vector<uint64_t>>;
Content content(const ResidentBlas& blas) { return {blas.geometry, blas.kind, blas.step, blas.passed}; }
Content content(const LodSharing& sharing, const LodPlan& plan, const PlannedBlas& blas) {
  if (blas.kind != BlasKind::kOwn) return {blas.geometry, blas.kind, blas.index, {}};
  return {blas.geometry, blas.kind, 0, passed_of_blas(sharing.geometries()[blas.geometry], {}, plan, blas)};
}

/// Tracks builds and drops, as a renderer would.
class Follower {
public:
  explicit Follower(size_t lowest) {
    for (BlasHandle h = 0; h < lowest; ++h) live_.insert(h);
  }
  void follow(const BlasResidency& residency, const ResidencyFrame& frame) {
    uint64_t triangles = 0;
    for (const BlasHandle h : frame.built) {
      EXPECT_TRUE(live_.insert(h).second) << "built over another";
      triangles += residency.blas(h).triangles;
    }
    EXPECT_EQ(triangles, frame.built_triangles);
    for (const BlasHandle h : frame.dropped) EXPECT_EQ(live_.erase(h), 1u);
    for (const BlasHandle h : frame.blas_of_instance) EXPECT_TRUE(live_.contains(h)) << "uses what is not there";
    EXPECT_EQ(live_.size(), residency.live_count());
  }

private:
  std::set<BlasHandle> live_;
};

std::vector<uint64_t> passed_of(const LodSharing& sharing, const ResidentBlas& blas) {
  if (blas.kind == BlasKind::kOwn) return blas.passed;
  std::vector<uint64_t> passed(cut_words(sharing.geometries()[blas.geometry]));
  set_prefix(passed, sharing.steps(blas.geometry)[blas.step].passed);
  return passed;
}

TEST_P(Flight, EndsInThePlanFromScratch) {
  for (const uint64_t budget : {uint64_t{1}, uint64_t{20'000}, uint64_t{1} << 62}) {
    LodSharing sharing(geometries, instances, config);
    ResidencyConfig residency_config;
    residency_config.triangles_per_frame = budget;
    residency_config.keep_step_frames = 10;
    BlasResidency residency(sharing, residency_config);
    Follower follower(geometries.size());
    LodPlan plan;
    uint64_t waited = 0;
    for (int frame = 0; frame < 300; ++frame) {
      sharing.plan(view_at(frame / 300.0), {}, plan);
      const ResidencyFrame& result = residency.update(plan);
      follower.follow(residency, result);
      EXPECT_TRUE(result.built.size() == 1 || result.built_triangles <= budget);
      waited += result.waiting_builds;
    }
    if (budget == 1 && config.scheme != SharingScheme::kOff) {
      EXPECT_GT(waited, 0u);
    }
    if (budget > 1'000'000) {
      EXPECT_EQ(waited, 0u);
    }
    size_t frames = 0;
    for (; frames < 5000; ++frames) { // the camera has stopped
      const ResidencyFrame& result = residency.update(plan);
      follower.follow(residency, result);
      if (result.waiting_builds == 0 && frames > 20) break;
    }
    LodSharing fresh(geometries, instances, config);
    const LodPlan expected = fresh.plan(view_at(299 / 300.0));
    const ResidencyFrame& last = residency.update(plan);
    EXPECT_EQ(last.waiting_builds + last.waiting_instances + last.coarse_instances, 0u);
    EXPECT_EQ(last.largest_error_ratio, 1.0);
    for (uint32_t i = 0; i < instances.size(); ++i)
      EXPECT_EQ(content(residency.blas(last.blas_of_instance[i])),
                content(fresh, expected, expected.blas[expected.blas_of_instance[i]]));
    std::set<Content> needed; // only the coarsest cuts and what is used are kept
    for (uint32_t g = 0; g < geometries.size(); ++g)
      needed.insert({g, BlasKind::kCoarsest, static_cast<uint32_t>(fresh.steps(g).size()) - 1, {}});
    for (const PlannedBlas& blas : expected.blas) needed.insert(content(fresh, expected, blas));
    EXPECT_EQ(residency.live_count(), needed.size());
  }
}

TEST_P(Flight, AStillCameraChangesNothing) {
  LodSharing sharing(geometries, instances, config);
  BlasResidency residency(sharing, {});
  const LodPlan plan = sharing.plan(view_at(0.3));
  const std::vector<BlasHandle> first = residency.update(plan).blas_of_instance;
  for (int frame = 0; frame < 400; ++frame) {
    const LodPlan again = sharing.plan(view_at(0.3));
    const ResidencyFrame& result = residency.update(again);
    EXPECT_TRUE(result.built.empty());
    EXPECT_TRUE(result.dropped.empty());
    EXPECT_EQ(result.blas_of_instance, first);
  }
}

/// While builds wait, instances that are not counted as coarse have enough detail everywhere, and no instance exceeds
/// its error by more than the stated ratio.
TEST_P(Flight, SaysHonestlyWhereDetailIsMissing) {
  if (config.scheme == SharingScheme::kOff) GTEST_SKIP() << "without sharing all instances have level 0";
  LodSharing sharing(geometries, instances, config);
  ResidencyConfig residency_config;
  residency_config.triangles_per_frame = 3'000;
  residency_config.keep_step_frames = 3;
  BlasResidency residency(sharing, residency_config);
  uint64_t coarse_frames = 0, waiting = 0, coarse_then_fine = 0;
  for (int frame = 0; frame < 200; ++frame) {
    const DetailView view = view_at(std::min(frame, 150) / 150.0);
    const LodPlan plan = sharing.plan(view);
    const ResidencyFrame& result = residency.update(plan);
    uint64_t coarse = 0;
    for (uint32_t i = 0; i < instances.size(); ++i) {
      const LodGeometry& geometry = geometries[instances[i].geometry];
      const InstanceMetric metric(view, instances[i].world_from_object, largest_stretch(instances[i].world_from_object),
                                  geometry.reach());
      const std::vector<uint64_t> used = passed_of(sharing, residency.blas(result.blas_of_instance[i]));
      bool enough = true;
      for (uint32_t rank = 0; rank < geometry.rank_count(); ++rank) {
        if (!rank_passes(used, rank)) continue;
        enough &= metric.passes(geometry.ranks(), rank);
        InstanceMetric relaxed = metric;
        relaxed.error_per_distance *= result.largest_error_ratio * (1.0 + 1e-9);
        EXPECT_TRUE(relaxed.passes(geometry.ranks(), rank));
      }
      coarse += !enough;
    }
    EXPECT_LE(coarse, result.coarse_instances); // bounds from the whole sphere may count more instances
    EXPECT_EQ(result.largest_error_ratio > 1.0, result.coarse_instances > 0);
    coarse_frames += coarse > 0;
    waiting += result.waiting_instances;
    coarse_then_fine = result.coarse_instances;
  }
  EXPECT_GT(coarse_frames, 0u); // otherwise nothing was tested
  EXPECT_GT(waiting, 0u);
  EXPECT_EQ(coarse_then_fine, 0u);
}

INSTANTIATE_TEST_SUITE_P(Schemes, Flight,
                         testing::Values(scheme(SharingScheme::kOff), test::own_cuts(),
                                         scheme(SharingScheme::kOneProvider), scheme(SharingScheme::kSteps)));

TEST(BlasResidency, KeepsUnusedStepsAsLongAsItSays) {
  const std::vector<LodGeometry> geometries{test::random_records(30, 1).geometry()};
  const std::vector<LodInstance> instances{{0, DAffine(1.0)}};
  SharingConfig config;
  config.own_cut_ratio = config.traced_ratio = std::numeric_limits<double>::infinity();
  LodSharing sharing(geometries, instances, config);
  ResidencyConfig residency_config;
  residency_config.keep_step_frames = 5;
  BlasResidency residency(sharing, residency_config);
  const LodPlan near = sharing.plan(make_detail_view(DVec3(0, 0, 3), 0.01, 1.0, 1080.0, 1.0));
  const LodPlan far = sharing.plan(make_detail_view(DVec3(0, 0, 1e6), 0.01, 1.0, 1080.0, 1.0));
  ASSERT_EQ(near.blas[0].kind, BlasKind::kStep);
  ASSERT_EQ(far.blas[0].kind, BlasKind::kCoarsest);
  ASSERT_EQ(residency.update(near).built.size(), 1u);
  for (int frame = 1; frame <= 5; ++frame) ASSERT_TRUE(residency.update(far).dropped.empty());
  EXPECT_EQ(residency.update(near).built.size(), 0u); // was still resident
  for (int frame = 1; frame <= 5; ++frame) ASSERT_TRUE(residency.update(far).dropped.empty());
  EXPECT_EQ(residency.update(far).dropped.size(), 1u);
  EXPECT_EQ(residency.update(near).built.size(), 1u);
}

TEST(BlasResidency, BadInputIsRejected) {
  const std::vector<LodGeometry> geometries{test::random_records(10, 1).geometry()};
  LodSharing sharing(geometries, std::vector<LodInstance>{{0, DAffine(1.0)}}, {});
  ResidencyConfig config;
  config.triangles_per_frame = 0;
  EXPECT_THROW(BlasResidency(sharing, config), Error);
  config = {};
  config.keep_own_frames = 1'000'001;
  EXPECT_THROW(BlasResidency(sharing, config), Error);
  config = {};
  config.keep_step_frames = 1'000'001;
  EXPECT_THROW(BlasResidency(sharing, config), Error);
  BlasResidency residency(sharing, {});
  EXPECT_THROW(residency.update({}), Error);
}

} // namespace
} // namespace packtrace
