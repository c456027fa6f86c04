#include "runtime/lod/lod_cut.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include <gtest/gtest.h>

#include "tests/runtime/lod/lod_records.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::LodRecords;

/// An instance of a geometry and a view.
struct Case {
  const LodGeometry& geometry;
  DAffine transform;
  DetailView view;

  double stretch() const { return largest_stretch(transform); }
  InstanceMetric metric() const { return {view, transform, stretch(), geometry.reach()}; }
  BallDistance ball() const {
    return ball_distance(view, {transform_point(transform, geometry.ball().center), stretch(),
                                InstanceMetric::extent(transform, stretch(), geometry.reach())});
  }
  AllowedErrors allowed() const {
    return allowed_errors(view.near, view.error_per_distance, ball(), stretch(), geometry.ball().radius);
  }
  LodRange range() const {
    return lod_range(geometry, allowed(), view.near, view.error_per_distance, ball(), stretch());
  }
  std::vector<uint64_t> cut() const {
    std::vector<uint64_t> passed(cut_words(geometry));
    cut_of_instance(geometry, metric(), allowed(), passed);
    return passed;
  }
};

/// The cut by definition: tests both groups of each cluster.
std::vector<uint32_t> brute_force(const Case& c) {
  const InstanceMetric metric = c.metric();
  const auto passes = [&](uint32_t group) {
    const uint32_t rank = c.geometry.rank_of_group(group);
    return rank != kNoRank && metric.passes(c.geometry.ranks(), rank);
  };
  std::vector<uint32_t> clusters;
  for (uint32_t i = 0; i < c.geometry.links().size(); ++i) {
    const LodLink& link = c.geometry.links()[i];
    if (!passes(link.group) && (link.generating_group == baked::kNoLodGroup || passes(link.generating_group)))
      clusters.push_back(i);
  }
  return clusters;
}

/// The cut by traversal from the groups without coarser clusters downwards, stopping where a group passes.
std::vector<uint32_t> traverse(const Case& c) {
  const InstanceMetric metric = c.metric();
  const std::span<const LodLink> links = c.geometry.links();
  std::vector<std::vector<uint32_t>> members;
  for (uint32_t i = 0; i < links.size(); ++i) {
    if (links[i].group >= members.size()) members.resize(links[i].group + 1);
    members[links[i].group].push_back(i);
  }
  std::vector<bool> visited(members.size());
  std::vector<uint32_t> clusters;
  const std::function<void(uint32_t)> visit = [&](uint32_t group) { // for groups that do not pass
    if (visited[group]) return;
    visited[group] = true;
    for (const uint32_t i : members[group]) {
      const uint32_t below = links[i].generating_group;
      if (below == baked::kNoLodGroup || metric.passes(c.geometry.ranks(), c.geometry.rank_of_group(below)))
        clusters.push_back(i);
      else
        visit(below);
    }
  };
  for (uint32_t group = 0; group < members.size(); ++group)
    if (c.geometry.rank_of_group(group) == kNoRank) visit(group); // terminal groups are the roots
  std::sort(clusters.begin(), clusters.end());
  return clusters;
}

/// Checks that every chain from a cluster of level 0, through any clusters made from its group, has one cluster in the
/// cut.
void expect_each_chain_cut_once(const LodGeometry& geometry, const std::vector<uint32_t>& cut) {
  const std::span<const LodLink> links = geometry.links();
  std::vector<std::vector<uint32_t>> made;
  std::vector<bool> taken(links.size());
  for (const uint32_t c : cut) taken[c] = true;
  for (uint32_t i = 0; i < links.size(); ++i)
    if (links[i].generating_group != baked::kNoLodGroup) {
      if (links[i].generating_group >= made.size()) made.resize(links[i].generating_group + 1);
      made[links[i].generating_group].push_back(i);
    }
  // Number of clusters of the cut at or above each cluster; must be equal along all chains.
  std::vector<int> least(links.size(), -1), most(links.size(), -1);
  const std::function<void(uint32_t)> count = [&](uint32_t i) {
    if (least[i] >= 0) return;
    int lo = 1 << 20, hi = 0;
    const uint32_t group = links[i].group;
    if (group >= made.size() || made[group].empty())
      lo = 0;
    else
      for (const uint32_t up : made[group]) count(up), lo = std::min(lo, least[up]), hi = std::max(hi, most[up]);
    least[i] = lo + (taken[i] ? 1 : 0);
    most[i] = hi + (taken[i] ? 1 : 0);
  };
  for (uint32_t i = 0; i < links.size(); ++i)
    if (links[i].generating_group == baked::kNoLodGroup) {
      count(i);
      ASSERT_EQ(least[i], 1);
      ASSERT_EQ(most[i], 1);
    }
}

/// Eyes at random positions, inside the sphere, on its surface, and where one group just passes.
std::vector<Case> cases_of(const LodGeometry& geometry, uint32_t count, uint32_t seed) {
  test::Random random(seed);
  std::vector<Case> cases;
  for (uint32_t i = 0; i < count; ++i) {
    const DAffine m = test::random_affine(random, 5.0);
    const double s = largest_stretch(m);
    const DVec3 direction =
        glm::normalize(DVec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) + DVec3(1e-3, 0, 0));
    const double distances[] = {0.0, 1.0, double(random.uniform(0.0f, 1.0f)), std::exp2(random.uniform(0, 14))};
    const DVec3 eye = transform_point(m, geometry.ball().center) +
                      direction * (s * geometry.ball().radius * distances[random.bits() % 4]);
    DetailView view =
        make_detail_view(eye, std::exp2(random.uniform(-20, 3)), 1.0, 1080.0, std::exp2(random.uniform(-2, 6)));
    if (i % 5 == 0 && geometry.rank_count() > 0) {
      const uint32_t rank = random.bits() % geometry.rank_count();
      const LodRanks& r = geometry.ranks();
      const InstanceMetric metric(view, m, s, geometry.reach());
      view.error_per_distance =
          r.error[rank] * s /
          metric.distance(r.center_x[rank], r.center_y[rank], r.center_z[rank], r.radius[rank], r.level[rank]);
    }
    cases.push_back({geometry, m, view});
  }
  return cases;
}

TEST(LodCut, EqualsBruteForceAndTraversal) {
  size_t mixed = 0;
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    const LodGeometry geometry = test::random_records(10 * seed, seed).geometry();
    for (const Case& c : cases_of(geometry, 300, seed)) {
      const std::vector<uint64_t> passed = c.cut();
      const std::vector<uint32_t> cut = clusters_of_cut(geometry, passed);
      ASSERT_EQ(cut, brute_force(c));
      ASSERT_EQ(cut, traverse(c));
      uint64_t triangles = 0;
      for (const uint32_t i : cut) triangles += geometry.cluster_triangles()[i];
      const CutCount count = count_cut(geometry, c.metric(), c.allowed());
      ASSERT_EQ(count.triangles, triangles);
      uint32_t prefix = 0;
      while (prefix < geometry.rank_count() && rank_passes(passed, prefix)) ++prefix;
      ASSERT_EQ(count.prefix, prefix);
      mixed += c.range().min < c.range().max;
    }
  }
  EXPECT_GT(mixed, 500u);
}

TEST(LodCut, CutsEachChainOnce) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    const LodGeometry geometry = test::random_records(50, seed).geometry();
    for (const Case& c : cases_of(geometry, 200, seed + 100))
      expect_each_chain_cut_once(geometry, clusters_of_cut(geometry, c.cut()));
    std::vector<uint64_t> passed(cut_words(geometry)); // also for steps
    for (const LodStep& step : ratio_steps(geometry, 1.1)) {
      set_prefix(passed, step.passed);
      expect_each_chain_cut_once(geometry, clusters_of_cut(geometry, passed));
    }
  }
}

/// The range against actual cuts, with non-uniform, sheared and mirrored transforms.
TEST(LodCut, StaysWithinTheRange) {
  size_t cases = 0, tight_min = 0, tight_max = 0;
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    const LodGeometry geometry = test::random_records(5 + 2 * seed, seed).geometry();
    for (const Case& c : cases_of(geometry, 500, seed)) {
      const LodRange range = c.range();
      uint32_t least = geometry.last_level(), most = 0;
      for (const uint32_t i : clusters_of_cut(geometry, c.cut())) {
        const uint32_t group = geometry.links()[i].group;
        uint32_t level = 0;
        while (level < geometry.last_level() && geometry.levels()[level + 1].first_group <= group) ++level;
        most = std::max(most, level);
        if (geometry.rank_of_group(group) != kNoRank) least = std::min(least, level);
      }
      ASSERT_GE(least, range.min);
      ASSERT_LE(most, range.max);
      ++cases;
      tight_min += least == range.min;
      tight_max += most == range.max;
    }
  }
  EXPECT_GE(cases, 20'000u);
  EXPECT_GT(tight_min, cases / 2); // the range must also be tight
  EXPECT_GT(tight_max, cases / 4);
}

TEST(LodCut, AllowedErrorsBracketEveryGroup) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    const LodGeometry geometry = test::random_records(40, seed).geometry();
    for (const Case& c : cases_of(geometry, 500, seed + 50)) {
      const AllowedErrors allowed = c.allowed();
      const InstanceMetric metric = c.metric();
      for (uint32_t rank = 0; rank < geometry.rank_count(); ++rank) {
        const double error = geometry.ranks().error[rank];
        if (error <= allowed.near) {
          ASSERT_TRUE(metric.passes(geometry.ranks(), rank));
        }
        if (error > allowed.far) {
          ASSERT_FALSE(metric.passes(geometry.ranks(), rank));
        }
      }
    }
  }
}

TEST(LodCut, OfAClosedMeshIsClosedFromAnyEye) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const test::BuiltLod built = test::build_lod(test::half_faceted(test::torus_mesh(100, 60)));
  const LodGeometry geometry = test::records_of(built).geometry();
  std::set<std::vector<uint64_t>> seen;
  size_t levels_used = 0;
  for (const Case& c : cases_of(geometry, 1000, 4)) {
    const std::vector<uint64_t> passed = c.cut();
    if (seen.insert(passed).second) {
      ASSERT_TRUE(test::boundary(built.lod, clusters_of_cut(geometry, passed)).empty());
    }
    levels_used += c.range().min < c.range().max;
  }
  EXPECT_GT(levels_used, 50u);
  EXPECT_GT(seen.size(), 20u);
}

} // namespace
} // namespace packtrace
