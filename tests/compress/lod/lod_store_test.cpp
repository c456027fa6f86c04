// Tests levels stored by an interrupted bake, which may be damaged or forged.

#include "compress/bake/write/lod_store.h"

#include <array>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "tests/compress/file_hashes.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

/// The header of a stored file.
struct StoreHeader {
  std::array<uint8_t, 8> magic;
  uint32_t version, header_bytes;
  uint64_t file_bytes;
  std::array<uint64_t, 2> content_hash;
  uint32_t section_count, reserved;
  std::array<baked::SectionRecord, 5> sections;
  LodKey key;
  uint64_t header_hash;
};
enum Part : size_t { kLevels, kClusters, kPayload, kGroups, kLinks };

/// A geometry, and the file that a bake stores for it.
class KeptLevels {
public:
  KeptLevels() {
    config_.lod = LodUse::kAll;
    config_.lod_min_triangles = 1;
    whole_ = bake(scene_, config_).bytes;
    config_.resume = folder_.path() / "levels";
    (void)bake(scene_, config_);
    path_ = std::filesystem::directory_iterator(config_.resume)->path();
    good_ = read_file_bytes(path_);
    std::memcpy(&header_, good_.data(), sizeof header_);
  }

  const std::vector<std::byte>& good() const { return good_; }
  const std::vector<std::byte>& whole() const { return whole_; }
  size_t offset(Part part, size_t byte = 0) const { return static_cast<size_t>(header_.sections[part].offset) + byte; }
  size_t bytes(Part part) const { return static_cast<size_t>(header_.sections[part].bytes); }

  /// Bakes with these bytes in the folder, after making their hashes valid. Must not fail.
  BakedScene bake_with(std::vector<std::byte> kept) const {
    rehash<StoreHeader>(kept);
    return bake_with_exactly(kept);
  }
  BakedScene bake_with_exactly(std::span<const std::byte> kept) const {
    write_file_bytes(path_, kept);
    return bake(scene_, config_);
  }

  /// Whether a change is detected, so that the levels are built again.
  template <typename T>
  bool refuses(Part part, size_t byte, T value) const {
    std::vector<std::byte> damaged = good_;
    std::memcpy(damaged.data() + offset(part, byte), &value, sizeof value);
    const BakedScene after = bake_with(std::move(damaged));
    return after.report.resumed_geometries == 0 && after.bytes == whole_;
  }

private:
  const SceneFolder folder_;
  const Scene scene_ = scene_of(torus_mesh(16, 12)); // few triangles, because it is baked hundreds of times
  BakeConfig config_;
  std::vector<std::byte> whole_, good_;
  std::filesystem::path path_;
  StoreHeader header_{};
};

TEST(LodStore, DamagedLevelsAreMadeAgain) {
  const KeptLevels kept;
  const size_t step = sanitized() ? 2 : 8;
  EXPECT_EQ(kept.bake_with(kept.good()).report.resumed_geometries, 1u);
  const auto made_again = [&](std::span<const std::byte> bytes) {
    const BakedScene after = kept.bake_with_exactly(bytes);
    return after.report.resumed_geometries == 0 && after.bytes == kept.whole();
  };
  for (size_t size = 0; size < kept.good().size(); size += 1 + size / step)
    EXPECT_TRUE(made_again(std::span(kept.good()).first(size))) << size;
  std::vector<std::byte> damaged = kept.good();
  for (size_t i = 0; i < damaged.size(); i += 1 + i / step) {
    damaged[i] ^= std::byte{4};
    EXPECT_TRUE(made_again(damaged)) << i;
    damaged[i] = kept.good()[i];
  }
}

/// The hashes are valid, the contents are not.
TEST(LodStore, LevelsThatNoFileMayHoldAreMadeAgain) {
  const KeptLevels kept;
  const size_t cluster = sizeof(baked::ClusterRecord); // the second
  const auto field = [&](size_t offset) { return cluster + offset; };
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, payload_offset)), 0x7fffffffu));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, first_triangle)), 1u));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, first_vertex)), ~0u));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, material_slot)), 1u));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, vertex_count)), uint16_t{257}));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, vertex_count)), uint16_t{0}));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, triangle_count)), uint8_t{0}));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, triangle_count)), uint8_t{255}));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, strip_count)), uint8_t{0}));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, position_bits)), uint8_t{255}));
  EXPECT_TRUE(kept.refuses(kClusters, field(offsetof(baked::ClusterRecord, flags)), uint8_t{255}));
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  for (const size_t of_group : {offsetof(baked::LodGroupRecord, error), offsetof(baked::LodGroupRecord, radius)})
    for (const float value : {nan, -1.0f}) EXPECT_TRUE(kept.refuses(kGroups, of_group, value)) << of_group;
  EXPECT_TRUE(kept.refuses(kGroups, offsetof(baked::LodGroupRecord, error), infinite));
  EXPECT_TRUE(kept.refuses(kGroups, offsetof(baked::LodGroupRecord, center), 1e30f));
  EXPECT_TRUE(kept.refuses(kGroups, offsetof(baked::LodGroupRecord, level), 7u));
  EXPECT_TRUE(kept.refuses(kLinks, offsetof(baked::LodLinkRecord, group), uint16_t{0xffff}));
  EXPECT_TRUE(kept.refuses(kLinks, offsetof(baked::LodLinkRecord, generating_group), uint16_t{1}));
  EXPECT_TRUE(kept.refuses(kLinks, kept.bytes(kLinks) - sizeof(uint32_t), ~0u));
  // Fields of a level: triangles, payload bytes, stream bits, counts, clusters by class, bounds, error, normals.
  constexpr size_t kLevelBytes = 136;
  for (const size_t level : {size_t{0}, kLevelBytes})
    for (size_t byte = 0; byte < kLevelBytes; byte += 4) {
      if (level == 0 && byte >= 56 && byte < 120) continue; // counts and bounds of level 0 are taken from the geometry
      EXPECT_TRUE(kept.refuses(kLevels, level + byte, 0x7fffffffu)) << "level " << level / kLevelBytes << ", " << byte;
    }
}

TEST(LodStore, WhateverItHoldsABakeSucceeds) {
  const KeptLevels kept;
  Random random(11);
  uint32_t made_again = 0;
  const uint32_t repeats = fewer(300u);
  for (uint32_t repeat = 0; repeat < repeats; ++repeat) {
    std::vector<std::byte> damaged = kept.good();
    const size_t first = repeat % 4 == 0 ? 16 : sizeof(StoreHeader); // the header's counts too
    for (uint32_t change = 0; change < 1 + random.bits() % 4; ++change) {
      const size_t at = first + random.bits() % (damaged.size() - first);
      damaged[at] = static_cast<std::byte>(random.bits() % 3 == 0 ? 0xff : random.bits() % 256);
    }
    const BakedScene after = kept.bake_with(std::move(damaged)); // reads back the baked file
    made_again += after.report.resumed_geometries == 0;
    if (after.report.resumed_geometries == 0) {
      EXPECT_TRUE(after.bytes == kept.whole()) << repeat;
    }
  }
  EXPECT_GT(made_again, repeats / 4); // most changes to the payload result in other valid levels
}

TEST(LodStore, ClearNamesWhatItCannotRemove) {
  const SceneFolder folder;
  const LodStore store(folder.path() / "levels");
  for (int i = 0; i < 20; ++i)
    write_file_bytes(folder.path() / "levels" / (std::to_string(i) + ".ptklod"), std::vector<std::byte>(1));
  for (const char* name : {"a.ptklod", "b.ptklod"}) {
    std::filesystem::create_directories(folder.path() / "levels" / name);
    write_file_bytes(folder.path() / "levels" / name / "file", std::vector<std::byte>(1));
  }
  try {
    store.clear();
    ADD_FAILURE() << "it says nothing";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kIo);
    EXPECT_NE(std::string(error.what()).find(".ptklod: "), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("and 1 more"), std::string::npos) << error.what();
  }
  size_t left = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "levels")) left += !entry.path().empty();
  EXPECT_EQ(left, 2u); // the others were removed
}

TEST(LodStore, AnInterruptedBakeGoesOnWithWhatItHas) {
  const SceneFolder folder;
  BakeConfig config = config_with_levels();
  const std::vector<std::byte> whole = bake(mixed_lod_scene(), config).bytes;
  config.resume = folder.path() / "levels";
  const BakedScene first = bake(mixed_lod_scene(), config);
  EXPECT_EQ(first.bytes, whole);
  EXPECT_EQ(first.report.resumed_geometries, 0u);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(config.resume)) files.push_back(entry.path());
  ASSERT_EQ(files.size(), 2u);
  std::filesystem::remove(files[0]);
  const BakedScene second = bake(mixed_lod_scene(), config);
  EXPECT_EQ(second.bytes, whole);
  EXPECT_EQ(second.report.resumed_geometries, 1u);
  const BakedScene third = bake(mixed_lod_scene(), config);
  EXPECT_EQ(third.bytes, whole);
  EXPECT_EQ(third.report.resumed_geometries, 2u);
  config.lod_levels = 2;
  EXPECT_EQ(bake(mixed_lod_scene(), config).report.resumed_geometries, 0u);
  Diagnostics diagnostics;
  Progress progress;
  bake_scene(mixed_lod_scene(), config, folder.path() / "out.ptk", false, diagnostics, progress);
  EXPECT_FALSE(std::filesystem::exists(config.resume));
}

/// At any point of interruption, the files left behind are complete.
TEST(LodStore, AnInterruptedBakeLeavesNoHalfMadeLevels) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const SceneFolder folder;
  Scene scene = mixed_lod_scene();
  for (uint32_t i = 0; i < 6; ++i) add_shape(scene, torus_mesh(60 + 10 * i, 24), translation({4.0 * i, 9, 0}));
  BakeConfig config = config_with_levels();
  const std::vector<std::byte> whole = bake(scene, config).bytes;
  config.resume = folder.path() / "levels";
  uint64_t resumed = 0;
  for (const uint64_t stop : {1u, 20u, 40u, 60u, 80u}) {
    Diagnostics diagnostics;
    Progress progress([&](std::string_view phase, uint64_t done, uint64_t total) {
      if (phase.ends_with("levels") && 100 * done >= stop * total) throw Error(ErrorKind::kCancelled, "stopped");
    });
    EXPECT_THROW((void)bake_to_bytes(scene, config, diagnostics, progress), Error) << stop;
    const BakedScene after = bake(scene, config);
    EXPECT_TRUE(after.bytes == whole) << stop;
    resumed += after.report.resumed_geometries;
    LodStore(config.resume).clear();
  }
  EXPECT_GT(resumed, 0u);
}

TEST(LodStore, LevelsThatStayDoNotSpoilTheFile) {
  const SceneFolder folder;
  BakeConfig config;
  config.lod = LodUse::kAll;
  config.resume = folder.path() / "levels";
  std::filesystem::create_directories(config.resume / "a.ptklod" / "b");
  Diagnostics diagnostics;
  Progress progress;
  const BakeReport report =
      bake_scene(scene_of(torus_mesh(24, 16)), config, folder.path() / "out.ptk", false, diagnostics, progress);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "out.ptk"));
  ASSERT_FALSE(report.warnings.empty());
  EXPECT_NE(report.warnings.back().find("a.ptklod"), std::string::npos);
}

TEST(LodStore, KeysTellNumbersOfLevelsAndLocksApart) {
  const BuiltLod built = build_lod(torus_mesh(24, 16));
  const LodKey key = lod_key(built.geometry, built.base, {9, {}});
  EXPECT_NE(key, lod_key(built.geometry, built.base, {8, {}}));
  std::vector<uint8_t> locked(built.geometry.positions.size());
  const LodKey none = lod_key(built.geometry, built.base, {9, locked});
  locked[3] = 1;
  EXPECT_NE(none, lod_key(built.geometry, built.base, {9, locked}));
}

} // namespace
} // namespace packtrace::test
