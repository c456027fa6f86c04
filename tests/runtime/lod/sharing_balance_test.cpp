#include "runtime/lod/sharing_balance.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

std::vector<LodStep> halving_steps(size_t count) {
  std::vector<LodStep> steps(count);
  for (size_t i = 0; i < count; ++i) steps[i].triangles = uint64_t{1000} << (count - i);
  return steps;
}

TEST(SharingBalance, LeavesOutWhatCostsLeast) {
  const std::vector<LodStep> steps = halving_steps(4); // 16, 8, 4, 2 thousand triangles
  // omitting step 1 costs 40 thousand triangles, step 2 costs 8 thousand
  const std::vector<uint32_t> users{1, 5, 2, 100};
  const uint64_t traced = 16'000 + 40'000 + 8'000 + 200'000;
  const auto run = [&](double limit) { return balance_builds(steps, users, traced, limit, {}); };
  EXPECT_EQ(run(static_cast<double>(traced)).builds, 3u);
  const SharingBalance one = run(static_cast<double>(traced) + 8'000);
  EXPECT_EQ(one.builds, 2u);
  EXPECT_EQ(one.instead, (std::vector<uint32_t>{0, 1, 1, 3}));
  EXPECT_EQ(one.users, (std::vector<uint32_t>{1, 7, 0, 100}));
  EXPECT_EQ(run(static_cast<double>(traced) + 63'999).builds, 2u);
  const SharingBalance two = run(static_cast<double>(traced) + 64'000); // all 7 users of steps 1 and 2 move to step 0
  EXPECT_EQ(two.builds, 1u);
  EXPECT_EQ(two.instead, (std::vector<uint32_t>{0, 0, 0, 3}));
  EXPECT_EQ(two.traced, traced + 64'000);
}

TEST(SharingBalance, OneOwnCutCanSaveSeveralSteps) {
  const std::vector<LodStep> steps = halving_steps(4);
  const std::vector<uint32_t> users{1, 1, 1, 0};
  // Without the saving no step can be omitted; with it, step 1 can serve both other users.
  const std::vector<OwnCutSaving> savings{{4'000, 0, 7}};
  const SharingBalance balance = balance_builds(steps, users, 28'000, 28'000.0, savings);
  EXPECT_EQ(balance.own_cuts, 1u);
  EXPECT_EQ(balance.builds, 1u);
  EXPECT_EQ(balance.traced, 28'000u);
}

TEST(SharingBalance, KeepsToTheLimitAndCountsRight) {
  test::Random random(1);
  size_t own = 0, left_out = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::vector<LodStep> steps = halving_steps(2 + random.bits() % 8);
    std::vector<uint32_t> users(steps.size());
    std::vector<OwnCutSaving> savings;
    uint64_t traced = 0, own_triangles = 0;
    for (uint32_t k = 0; k < 30; ++k) {
      const uint32_t step = random.bits() % static_cast<uint32_t>(steps.size());
      const uint64_t saved = steps[step].triangles * (random.bits() % 60) / 100;
      ++users[step];
      traced += steps[step].triangles;
      own_triangles += steps[step].triangles - saved;
      if (saved > 0) savings.push_back({saved, step, k});
    }
    std::stable_sort(savings.begin(), savings.end(),
                     [](const auto& a, const auto& b) { return a.triangles > b.triangles; });
    const double limit = random.uniform(1.0f, 1.6f) * static_cast<double>(own_triangles);
    const SharingBalance balance = balance_builds(steps, users, traced, limit, savings);
    ASSERT_LE(static_cast<double>(balance.traced), limit);
    std::vector<uint32_t> expected = users;
    uint64_t sum = traced;
    for (size_t k = 0; k < balance.own_cuts; ++k) {
      --expected[savings[k].step];
      sum -= savings[k].triangles;
    }
    std::vector<uint32_t> moved(steps.size());
    for (size_t step = 0; step < steps.size(); ++step) {
      ASSERT_LE(balance.instead[step], step); // never coarser
      moved[balance.instead[step]] += expected[step];
      sum += expected[step] * (steps[balance.instead[step]].triangles - steps[step].triangles);
    }
    ASSERT_EQ(balance.users, moved);
    ASSERT_EQ(balance.traced, sum);
    ASSERT_EQ(balance.users.back(), expected.back()); // the last step needs no build
    ASSERT_EQ(balance.builds,
              static_cast<size_t>(std::count_if(moved.begin(), moved.end() - 1, [](uint32_t u) { return u > 0; })));
    own += balance.own_cuts;
    left_out += moved != expected;
  }
  EXPECT_GT(own, 1000u);
  EXPECT_GT(left_out, 500u);
}

/// Compares with all subsets of steps.
TEST(SharingBalance, BuildsTheFewestSteps) {
  test::Random random(2);
  size_t between = 0;
  for (int i = 0; i < 500; ++i) {
    std::vector<LodStep> steps(9);
    uint64_t triangles = 100'000;
    for (LodStep& step : steps) step.triangles = triangles = triangles * (50 + random.bits() % 45) / 100;
    std::vector<uint32_t> users(steps.size());
    uint64_t traced = 0;
    size_t used = 0;
    for (size_t k = 0; k < steps.size(); ++k) {
      users[k] = random.bits() % 3 == 0 ? 0 : random.bits() % 50;
      traced += users[k] * steps[k].triangles;
      used += k + 1 < steps.size() && users[k] > 0;
    }
    const double limit = random.uniform(1.0f, 2.0f) * static_cast<double>(traced);
    std::pair<size_t, uint64_t> fewest{~size_t{0}, 0}; // builds, then triangles
    for (uint32_t subset = 0; subset < 256; ++subset) {
      uint64_t all = 0;
      size_t finer = steps.size();
      bool covered = true;
      for (size_t k = 0; k < 8; ++k) {
        if ((subset >> k & 1) != 0) finer = k;
        if (users[k] == 0) continue;
        covered &= finer < steps.size();
        if (covered) all += users[k] * steps[finer].triangles;
      }
      all += users[8] * steps[8].triangles;
      if (covered && static_cast<double>(all) <= limit)
        fewest = std::min(fewest, {static_cast<size_t>(std::popcount(subset)), all});
    }
    const SharingBalance balance = balance_builds(steps, users, traced, limit, {});
    EXPECT_EQ(balance.builds, fewest.first);
    EXPECT_EQ(balance.traced, fewest.second);
    between += balance.builds > 1 && balance.builds < used;
  }
  EXPECT_GT(between, 100u);
}

} // namespace
} // namespace packtrace
