#include "pbrt_import/builder/instance_residuals.h"

#include <gtest/gtest.h>

namespace packtrace {
namespace {

/// A map of which every number, or only the translation, lies between two floats.
DAffine inexact(int i, bool translation_only) {
  DAffine map(1.0);
  map[3] = DVec3(0.1 * i, i + 1.0 / 3.0, -7.7);
  if (!translation_only) map[1] = DVec3(0.3, 1.0 / 7.0, 2.1 + i);
  return map;
}

TEST(InstanceResiduals, GiveBackWhatRoundingLost) {
  InstanceResiduals residuals;
  std::vector<DAffine> maps;
  for (int i = 0; i < 2000; ++i) {
    maps.push_back(i < 600 ? DAffine(1.0) : inexact(i, i < 1500));
    residuals.push_back(maps.back(), Affine(maps.back()));
  }
  for (size_t i = 0; i < maps.size(); ++i) {
    DAffine map(Affine(maps[i]));
    const DAffine expected = map + DAffine(Affine(maps[i] - map));
    residuals.add_to(map, i);
    ASSERT_EQ(map, expected) << i;
  }
}

TEST(InstanceResiduals, ExactMapsTakeNoMemory) {
  InstanceResiduals residuals;
  for (int i = 0; i < 10'000; ++i) {
    DAffine map(0.5);
    map[3] = DVec3(i, -i, 0.25 * i);
    residuals.push_back(map, Affine(map));
  }
  EXPECT_EQ(residuals.stored_bytes(), 0u);
  const DAffine map = inexact(1, true);
  residuals.push_back(map, Affine(map));
  EXPECT_GT(residuals.stored_bytes(), 0u);
  EXPECT_LE(residuals.stored_bytes(), 256 * sizeof(Vec3)); // its linear part is exact
}

TEST(InstanceResiduals, KeptOnesStayInOrder) {
  InstanceResiduals residuals;
  std::vector<uint8_t> kept;
  std::vector<DAffine> expected;
  for (int i = 0; i < 1000; ++i) {
    const DAffine exact = i % 5 == 0 ? DAffine(1.0) : inexact(i, i % 2 == 0);
    residuals.push_back(exact, Affine(exact));
    kept.push_back(i % 3 != 0);
    if (kept.back() == 0) continue;
    expected.emplace_back(0.0);
    residuals.add_to(expected.back(), static_cast<size_t>(i));
  }
  residuals.keep(kept);
  ASSERT_EQ(residuals.size(), expected.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    DAffine map(0.0);
    residuals.add_to(map, i);
    ASSERT_EQ(map, expected[i]) << i;
  }
}

} // namespace
} // namespace packtrace
