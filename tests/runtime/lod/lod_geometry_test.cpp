#include "runtime/lod/lod_geometry.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/runtime/lod/lod_records.h"

namespace packtrace {
namespace {

using test::LodRecords;

constexpr float kInfinite = std::numeric_limits<float>::infinity();

uint64_t discrete_triangles(const LodRecords& records, uint32_t level) {
  uint64_t count = 0;
  for (size_t i = 0; i < records.links.size(); ++i) {
    const baked::LodGroupRecord& group = records.groups[records.links[i].group];
    if (group.level == level || (group.level < level && std::isinf(group.error))) count += records.cluster_triangles[i];
  }
  return count;
}

TEST(LodGeometry, LevelFactsAreThoseOfTheRecords) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    const LodRecords records = test::random_records(40, seed);
    const LodGeometry geometry = records.geometry();
    double below = 0.0;
    uint32_t groups = 0, clusters = 0;
    ASSERT_GT(geometry.levels().size(), 2u);
    for (uint32_t l = 0; l < geometry.levels().size(); ++l) {
      const LodLevel& level = geometry.levels()[l];
      EXPECT_EQ(level.first_group, groups);
      EXPECT_EQ(level.triangles, discrete_triangles(records, l));
      EXPECT_EQ(level.error, below);
      double largest = 0.0, smallest = kInfinite;
      for (const baked::LodGroupRecord& g : records.groups)
        if (g.level == l && std::isfinite(g.error))
          largest = std::max(largest, double{g.error}), smallest = std::min(smallest, double{g.error});
      EXPECT_EQ(level.largest_error, largest);
      EXPECT_EQ(level.smallest_error, smallest);
      below = std::max(below, largest);
      groups += level.group_count;
      clusters += level.cluster_count;
    }
    EXPECT_EQ(groups, records.groups.size());
    EXPECT_EQ(clusters, records.links.size());
  }
}

TEST(LodGeometry, BallsHoldThoseBelowAndTheWholeHoldsAll) {
  LodRecords records = test::random_records(40, 3);
  for (baked::LodGroupRecord& g : records.groups) g.radius *= 0.9f; // spheres that do not contain those below
  const LodGeometry geometry = records.geometry();
  const LodRanks& ranks = geometry.ranks();
  const auto ball = [&](uint32_t rank) {
    return LodBall{{ranks.center_x[rank], ranks.center_y[rank], ranks.center_z[rank]}, ranks.radius[rank]};
  };
  size_t pairs = 0;
  for (const LodLink& link : records.links) {
    if (link.generating_group == baked::kNoLodGroup || geometry.rank_of_group(link.group) == kNoRank) continue;
    const LodBall above = ball(geometry.rank_of_group(link.group));
    const LodBall below = ball(geometry.rank_of_group(link.generating_group));
    EXPECT_LE(glm::length(above.center - below.center) + below.radius, above.radius);
    ++pairs;
  }
  EXPECT_GT(pairs, 20u);
  for (uint32_t rank = 0; rank < geometry.rank_count(); ++rank) {
    EXPECT_LE(glm::length(geometry.ball().center - ball(rank).center) + ball(rank).radius, geometry.ball().radius);
    EXPECT_LE(glm::length(ball(rank).center) + ball(rank).radius, geometry.reach());
  }
}

TEST(LodGeometry, PrefixesHoldWhatTheirClustersHold) {
  const LodRecords records = test::random_records(30, 5);
  const LodGeometry geometry = records.geometry();
  std::vector<uint64_t> passed(cut_words(geometry));
  for (uint32_t count = 0; count <= geometry.rank_count(); ++count) {
    set_prefix(passed, count);
    uint64_t triangles = 0;
    const std::vector<uint32_t> clusters = clusters_of_cut(geometry, passed);
    for (const uint32_t c : clusters) triangles += records.cluster_triangles[c];
    EXPECT_EQ(geometry.triangles_of_prefix(count), triangles);
    EXPECT_EQ(geometry.clusters_of_prefix(count), clusters.size());
    EXPECT_EQ(size_of_cut(geometry, passed).triangles, triangles);
    EXPECT_EQ(size_of_cut(geometry, passed).clusters, clusters.size());
    EXPECT_EQ(error_of_cut(geometry, passed), count == 0 ? 0.0 : geometry.ranks().error[count - 1]);
  }
}

TEST(LodGeometry, RatioStepsHoldLessThanTheRatioTimesTheCoarsestCut) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    const LodGeometry geometry = test::random_records(60, seed).geometry();
    const std::vector<LodStep> steps = ratio_steps(geometry, 1.25);
    ASSERT_GT(steps.size(), 3u);
    EXPECT_EQ(steps.front().error, 0.0);
    EXPECT_EQ(steps.back().passed, geometry.rank_count());
    std::vector<double> errors{0.0, 1e30};
    for (const double e : geometry.ranks().error)
      for (const double around : {std::nextafter(e, 0.0), e, std::nextafter(e, 1e30)}) errors.push_back(around);
    for (const double error : errors) {
      const LodStep& step = steps[coarsest_step(steps, error)];
      EXPECT_LE(step.error, error);
      const uint64_t coarsest = geometry.triangles_of_prefix(geometry.ranks_up_to(error));
      EXPECT_GE(step.triangles, coarsest);
      EXPECT_LT(static_cast<double>(step.triangles), 1.25 * static_cast<double>(coarsest) + 1e-9);
    }
  }
}

TEST(LodGeometry, GeometryOfOneLevelHasOneStep) {
  const baked::LodGroupRecord group{{0, 0, 0}, 1.0f, kInfinite, 0};
  const LodLink link{0, baked::kNoLodGroup};
  const uint32_t triangles = 12;
  const LodGeometry geometry({&group, 1}, {&link, 1}, {&triangles, 1});
  EXPECT_EQ(geometry.last_level(), 0u);
  EXPECT_EQ(geometry.rank_count(), 0u);
  const std::vector<LodStep> steps = ratio_steps(geometry, 2.0);
  ASSERT_EQ(steps.size(), 1u);
  EXPECT_EQ(steps[0].triangles, 12u);
}

struct Damage {
  const char* name;
  void (*apply)(LodRecords&);
};
void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.name; }

class DamagedLodRecords : public testing::TestWithParam<Damage> {};

TEST_P(DamagedLodRecords, AreRejected) {
  LodRecords records = test::random_records(20, 9);
  ASSERT_NO_THROW(records.geometry());
  GetParam().apply(records);
  EXPECT_THROW(records.geometry(), Error);
}

size_t link_above_level_0(const LodRecords& r) {
  size_t i = 0;
  while (r.links[i].generating_group == baked::kNoLodGroup) ++i;
  return i;
}

INSTANTIATE_TEST_SUITE_P(
    LodGeometry, DamagedLodRecords,
    testing::Values(
        Damage{"no_groups", [](LodRecords& r) { r.groups.clear(); }},
        Damage{"no_clusters", [](LodRecords& r) { r.links.clear(), r.cluster_triangles.clear(); }},
        Damage{"a_count_short", [](LodRecords& r) { r.cluster_triangles.pop_back(); }},
        Damage{"center_nan", [](LodRecords& r) { r.groups[1].center[2] = NAN; }},
        Damage{"radius_infinite", [](LodRecords& r) { r.groups[1].radius = kInfinite; }},
        Damage{"radius_negative", [](LodRecords& r) { r.groups[1].radius = -1.0f; }},
        Damage{"error_nan", [](LodRecords& r) { r.groups[1].error = NAN; }},
        Damage{"error_negative", [](LodRecords& r) { r.groups[1].error = -1e-9f; }},
        Damage{"first_level_missing",
               [](LodRecords& r) {
                 for (auto& g : r.groups) ++g.level;
               }},
        Damage{"level_gap",
               [](LodRecords& r) {
                 for (auto& g : r.groups) g.level *= 2;
               }},
        Damage{"levels_mixed", [](LodRecords& r) { std::swap(r.groups.front(), r.groups.back()); }},
        Damage{"too_many_levels",
               [](LodRecords& r) {
                 while (r.groups.back().level < 32) r.groups.push_back(r.groups.back()), ++r.groups.back().level;
               }},
        Damage{"group_out_of_range", [](LodRecords& r) { r.links[2].group = static_cast<uint32_t>(r.groups.size()); }},
        Damage{"generating_out_of_range",
               [](LodRecords& r) {
                 r.links[link_above_level_0(r)].generating_group = static_cast<uint32_t>(r.groups.size());
               }},
        Damage{"made_from_nothing",
               [](LodRecords& r) { r.links[link_above_level_0(r)].generating_group = baked::kNoLodGroup; }},
        Damage{"made_from_its_own_group",
               [](LodRecords& r) {
                 auto& link = r.links[link_above_level_0(r)];
                 link.generating_group = link.group;
               }},
        Damage{"made_from_a_terminal_group",
               [](LodRecords& r) { r.groups[r.links[link_above_level_0(r)].generating_group].error = kInfinite; }},
        Damage{"error_shrinks",
               [](LodRecords& r) {
                 const auto& link = r.links[link_above_level_0(r)];
                 r.groups[link.group].error = 0.5f * r.groups[link.generating_group].error;
               }}),
    [](const auto& test) { return test.param.name; });

} // namespace
} // namespace packtrace
