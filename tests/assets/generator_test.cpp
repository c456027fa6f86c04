#include <cmath>
#include <csignal>
#include <functional>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include "assets/generator/asteroids.h"
#include "assets/generator/displaced_mesh.h"
#include "assets/generator/extreme.h"
#include "assets/generator/forest.h"
#include "assets/generator/leaf_mask.h"
#include "assets/generator/meadow.h"
#include "assets/generator/placement.h"
#include "assets/generator/town.h"
#include "pbrt_import/base/error.h"
#include "tests/assets/folder_content.h"
#include "tests/sanitized.h"
#include "tests/temporary_folder.h"

namespace packtrace::scenegen {
namespace {

const std::filesystem::path kAssets = std::filesystem::path(PACKTRACE_SOURCE_DIR) / "assets";

ErrorKind kind_of_error(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.kind();
  }
  ADD_FAILURE() << "no Error was thrown";
  return ErrorKind::kUnsupported;
}

std::map<std::string, std::string> generate_all(const std::filesystem::path& folder, uint64_t seed) {
  generate_town({seed, 3000}, {folder / "town", false});
  generate_forest({seed, 200'000, 0}, {folder / "forest", false});
  generate_displaced_mesh({seed, 40'000}, {folder / "mesh", false});
  generate_extreme({seed}, {folder / "extreme", false});
  generate_asteroids({seed, 5, 300}, {folder / "asteroids", false});
  generate_meadow({.seed = seed, .patches = 400, .blades = 100, .tile = 2, .frames = 3}, {folder / "meadow", false});
  generate_leaf_mask({folder / "leaf", false});
  return files_under(folder);
}

TEST(Generators, SameSeedGivesTheSameBytes) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const TemporaryFolder folder;
  EXPECT_TRUE(same_files(generate_all(folder / "a", 42), generate_all(folder / "b", 42)));
}

TEST(Generators, AnotherSeedGivesAnotherScene) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const TemporaryFolder folder;
  const auto a = generate_all(folder / "a", 42), b = generate_all(folder / "b", 43);
  for (const char* name : {"town/town_instances.pbrt", "forest/forest_instances.pbrt", "mesh/geometry/ring.ply",
                           "extreme/extreme_instances.pbrt", "asteroids/asteroids_instances.pbrt",
                           "meadow/meadow_instances.pbrt", "meadow/geometry/grass_0_0_0000.ply"}) {
    EXPECT_NE(a.at(name), b.at(name)) << name;
  }
}

TEST(Generators, ThreadCountDoesNotShow) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const TemporaryFolder folder;
  for (const size_t threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    generate_displaced_mesh({3, 900'000}, {folder / std::to_string(threads), false});
  }
  EXPECT_TRUE(same_files(files_under(folder / "1"), files_under(folder / "4")));
}

TEST(CommittedScenes, AreWhatTheGeneratorWritesToday) {
  const TemporaryFolder folder;
  generate_town({}, {folder / "town", false});
  generate_extreme({}, {folder / "extreme", false});
  generate_meadow({}, {folder / "meadow", false});
  generate_leaf_mask({folder / "leaf", false});
  EXPECT_TRUE(same_files(files_under(kAssets / "meadow"), files_under(folder / "meadow")));
  EXPECT_TRUE(same_files(files_under(kAssets / "town"), files_under(folder / "town")));
  EXPECT_TRUE(same_files(files_under(kAssets / "extreme"), files_under(folder / "extreme")));
  EXPECT_EQ(files_under(kAssets / "room").at("leaf.png"), files_under(folder / "leaf").at("leaf.png"));
}

TEST(CommittedScenes, MeadowIsSmall) {
  uint64_t bytes = 0;
  for (const auto& [name, content] : files_under(kAssets / "meadow")) bytes += content.size();
  EXPECT_GT(bytes, 1u << 20);
  EXPECT_LE(bytes, 4u << 20);
}

TEST(CommittedScenes, TownIsSmallAndFull) {
  uint64_t bytes = 0;
  for (const auto& [name, content] : files_under(kAssets / "town")) bytes += content.size();
  EXPECT_LE(bytes, 3u << 20);
  const TemporaryFolder folder;
  EXPECT_GE(generate_town({}, {folder / "town", false}).instances, 3000u);
}

TEST(Generators, TownPlacesAsManyInstancesAsAsked) {
  const TemporaryFolder folder;
  const SceneTotals totals = generate_town({7, 20'000}, {folder / "town", false});
  EXPECT_EQ(totals.instances, 20'000u);
}

TEST(Generators, ForestReachesItsTriangleCountWithinOneTree) {
  const TemporaryFolder folder;
  const SceneTotals totals = generate_forest({1, 3'000'000, 0}, {folder / "forest", false});
  EXPECT_GE(totals.placed_triangles, 3'000'000u);
  EXPECT_LT(totals.placed_triangles, 3'000'000u + 100'000u);
  EXPECT_EQ(generate_forest({1, 3'000'000, 777}, {folder / "counted", false}).instances, 777u);
}

TEST(Generators, AsteroidsAreAsManyAsAskedAndEachOfThemIsPlaced) {
  const TemporaryFolder folder;
  const SceneTotals totals = generate_asteroids({2, 7, 400}, {folder / "asteroids", false});
  EXPECT_EQ(totals.instances, 400u);
  EXPECT_EQ(totals.unique_triangles, 7u * 3'888u);
  EXPECT_EQ(totals.placed_triangles, 400u * 3'888u);
}

TEST(Generators, MeshHasAtLeastTheTrianglesAsked) {
  const TemporaryFolder folder;
  for (const uint64_t wanted : {100u, 12'345u, 500'000u}) {
    const SceneTotals totals = generate_displaced_mesh({1, wanted}, {folder / std::to_string(wanted), false});
    EXPECT_GE(totals.unique_triangles, wanted);
    EXPECT_LE(static_cast<double>(totals.unique_triangles), 1.2 * static_cast<double>(wanted) + 60.0);
  }
}

TEST(Generators, OptionsOutOfRangeAreRejectedBeforeAnythingIsWritten) {
  const TemporaryFolder folder;
  const OutputConfig output{folder / "out", false};
  EXPECT_EQ(kind_of_error([&] { generate_town({1, 2999}, output); }), ErrorKind::kUsage);
  EXPECT_EQ(kind_of_error([&] { generate_forest({1, 99'999, 0}, output); }), ErrorKind::kUsage);
  EXPECT_EQ(kind_of_error([&] { generate_forest({1, 1'000'000, 50'000'001}, output); }), ErrorKind::kUsage);
  EXPECT_EQ(kind_of_error([&] { generate_displaced_mesh({1, 2'000'000'001}, output); }), ErrorKind::kUsage);
  EXPECT_EQ(kind_of_error([&] { generate_asteroids({1, 0, 10}, output); }), ErrorKind::kUsage);
  EXPECT_EQ(kind_of_error([&] { generate_asteroids({1, 11, 10}, output); }), ErrorKind::kUsage);
  EXPECT_EQ(kind_of_error([&] { generate_asteroids({1, 5'001, 10'000}, output); }), ErrorKind::kUsage);
  for (const MeadowConfig& config :
       {MeadowConfig{.patches = 0}, MeadowConfig{.patches = 5001}, MeadowConfig{.blades = 0},
        MeadowConfig{.blades = 1001}, MeadowConfig{.blades = 1'002'001}, MeadowConfig{.tile = 0},
        MeadowConfig{.tile = 17}, MeadowConfig{.frames = 0}, MeadowConfig{.frames_per_second = 0.5},
        MeadowConfig{.frames = 4000, .frames_per_second = 1.0}, MeadowConfig{.wind = 4.1},
        MeadowConfig{.wind = std::nan("")}}) {
    EXPECT_EQ(kind_of_error([&] { generate_meadow(config, output); }), ErrorKind::kUsage);
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(BufferedFile, ExistingFilesStayUnlessForced) {
  const TemporaryFolder folder;
  const OutputConfig gentle{folder / "x", false}, forced{folder / "x", true};
  generate_extreme({1}, gentle);
  const auto first = files_under(folder / "x");
  EXPECT_EQ(kind_of_error([&] { generate_extreme({2}, gentle); }), ErrorKind::kIo);
  EXPECT_TRUE(same_files(first, files_under(folder / "x")))
      << "a refused run must leave everything, and nothing of its own";
  generate_extreme({2}, forced);
  EXPECT_FALSE(same_files(first, files_under(folder / "x")));
}

TEST(BufferedFile, WhatIsNotClosedLeavesNothing) {
  const TemporaryFolder folder;
  {
    BufferedFile file(folder / "a.txt", false);
    file.write("half");
  }
  EXPECT_TRUE(files_under(folder / "").empty());
}

TEST(BufferedFile, AFullDiskIsAnError) {
  const TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1u << 20, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_EQ(kind_of_error([&] {
              BufferedFile file(folder / "full.txt", false);
              file.write(std::string(3u << 20, 'x'));
              file.close();
            }),
            ErrorKind::kIo);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(folder.files(), 0u);
}

TEST(Placement, SineAndCosineAgreeWithTheLibraryOverTheStatedRange) {
  double worst = 0.0;
  Random random(1);
  for (int i = 0; i < 200'000; ++i) {
    const double angle = i < 1000 ? (i - 500) * kPi / 8.0 : random.uniform(-1e6, 1e6);
    const auto [s, c] = sin_cos(angle);
    worst = std::max({worst, std::abs(s - std::sin(angle)), std::abs(c - std::cos(angle))});
  }
  EXPECT_LE(worst, 2e-15);
}

TEST(Placement, RandomNumbersAreTheSameEverywhere) {
  Random random(1, 2);
  EXPECT_EQ(hash_bits(1), 0x5692161d100b05e5u); // fixed: a change here changes every committed scene
  double sum = 0.0;
  uint32_t histogram[8] = {};
  for (int i = 0; i < 80'000; ++i) sum += random.uniform(), ++histogram[random.below(8)];
  EXPECT_NEAR(sum / 80'000, 0.5, 0.005);
  for (const uint32_t count : histogram) EXPECT_NEAR(count, 10'000, 500);
}

} // namespace
} // namespace packtrace::scenegen
