// Errors on opening files with damaged levels of detail.

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/file/file_summary.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

/// Two geometries with levels, and one between them without.
std::vector<std::byte> lod_file(const BakeConfig& config = {}) {
  Scene scene = scene_of(grid_mesh(20, 0.1f, true));
  add_shape(scene, grid_mesh(2), translation({0, 0, 1}));
  add_shape(scene, grid_mesh(30, 0.2f), translation({0, 0, 2}));
  BakeConfig with = config;
  with.lod = LodUse::kAll;
  with.lod_min_triangles = 100;
  return bake(scene, with).bytes;
}

class LodValidation : public testing::Test {
protected:
  LodValidation() : bytes_(lod_file()), file_(BakedFile::from_bytes(bytes_)) {}

  /// What is said where a number is changed; without "memory: damaged baked file: ".
  template <class T>
  std::string after(baked::Section section, size_t at, T value) const {
    const std::string all = message_after(bytes_, section, at, value), prefix = "memory: damaged baked file: ";
    EXPECT_EQ(all.substr(0, prefix.size()), prefix);
    return all.substr(std::min(prefix.size(), all.size()));
  }
  template <class T>
  std::string level(size_t number, size_t field, T value) const {
    return after(baked::kLodLevels, number * sizeof(baked::LodLevelRecord) + field, value);
  }
  std::string group(size_t number, size_t field, float value) const {
    uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    return after(baked::kLodGroups, number * sizeof(baked::LodGroupRecord) + field, bits);
  }
  std::string link(size_t number, size_t field, uint16_t value) const {
    return after(baked::kLodLinks, number * sizeof(baked::LodLinkRecord) + field, value);
  }
  template <class T>
  std::string geometry(size_t number, size_t field, T value) const {
    return after(baked::kGeometries, number * sizeof(baked::GeometryRecord) + field, value);
  }

  const std::vector<std::byte> bytes_;
  const BakedFile file_;
};

TEST_F(LodValidation, TheFileIsWhatTheseTestsThink) {
  ASSERT_EQ(file_.base_geometry_count(), 3u);
  EXPECT_TRUE(file_.lod(1).levels.empty());
  const LodView first = file_.lod(0), second = file_.lod(2);
  ASSERT_GE(first.levels.size(), 3u);
  ASSERT_GE(second.levels.size(), 3u);
  EXPECT_EQ(first.levels[1].geometry, 3u);
  EXPECT_EQ(second.levels[0].geometry, 2u);
  EXPECT_EQ(second.levels[1].geometry, 3u + first.levels.size() - 1);
  EXPECT_EQ(file_.geometries().size(), 3 + first.levels.size() - 1 + second.levels.size() - 1);
  EXPECT_EQ(first.groups.size() + second.groups.size(), file_.sections().lod_groups.size());
  EXPECT_EQ(first.links().size() + second.links().size(), file_.sections().lod_links.size());
}

TEST_F(LodValidation, LevelRecordsAreChecked) {
  using Level = baked::LodLevelRecord;
  const size_t of_second = file_.lod(0).levels.size();
  const std::string second = "lod level " + std::to_string(of_second);
  EXPECT_EQ(level(0, offsetof(Level, base), 3), "lod level 0: geometry");
  EXPECT_EQ(level(0, offsetof(Level, base), 1), "lod level 0: geometry");
  EXPECT_EQ(level(of_second, offsetof(Level, base), 0), second + ": level");
  EXPECT_EQ(level(1, offsetof(Level, level), uint16_t{2}), "lod level 1: level");
  EXPECT_EQ(level(0, offsetof(Level, level), uint16_t{1}), "lod level 0: level");
  EXPECT_EQ(level(1, offsetof(Level, geometry), 4), "lod level 1: geometry");
  EXPECT_EQ(level(1, offsetof(Level, geometry), ~0u), "lod level 1: geometry");
  EXPECT_EQ(level(0, offsetof(Level, group_count), uint16_t{0}), "lod level 0: number of groups");
  EXPECT_EQ(level(0, offsetof(Level, group_count), uint16_t{0xffff}), "lod level 0: number of groups");
  EXPECT_EQ(level(1, offsetof(Level, first_group), 0), "lod level 1: groups");
  EXPECT_EQ(level(1, offsetof(Level, first_group), ~0u), "lod level 1: groups");
  EXPECT_EQ(level(1, offsetof(Level, first_link), 0), "lod level 1: links");
  EXPECT_EQ(level(0, offsetof(Level, triangles), 1), "lod level 0: triangles");
  EXPECT_EQ(level(1, offsetof(Level, triangles), ~0u), "lod level 1: triangles");
  EXPECT_EQ(level(1, offsetof(Level, error), 0), "lod level 1: error");
  EXPECT_EQ(level(0, offsetof(Level, error), 0x7fc00000u), "lod level 0: error"); // NaN
}

TEST_F(LodValidation, GeometriesOfLevelsAreChecked) {
  using Geometry = baked::GeometryRecord;
  EXPECT_EQ(geometry(1, offsetof(Geometry, flags), uint16_t{baked::kWorldSpace | baked::kLodLevel}),
            "instance 1: geometry");
  EXPECT_EQ(geometry(4, offsetof(Geometry, flags), baked::kWorldSpace), "geometry 4: behind levels of detail");
  EXPECT_EQ(geometry(3, offsetof(Geometry, flags), baked::kLodLevel), "lod level 1: geometry is not like its base");
  EXPECT_EQ(geometry(3, offsetof(Geometry, step_mantissa), 7), "lod level 1: geometry is not like its base");
  EXPECT_EQ(geometry(3, offsetof(Geometry, slot_count), 2), "lod level 1: geometry is not like its base");
  EXPECT_EQ(geometry(3, offsetof(Geometry, origin), 12345), "lod level 1: geometry is not like its base");
  EXPECT_EQ(geometry(3, offsetof(Geometry, uv_encoding), uint8_t{1}), "lod level 1: geometry is not like its base");
  EXPECT_EQ(geometry(3, offsetof(Geometry, normal_encoding), uint8_t{9}), "geometry 3: normal encoding");
  EXPECT_EQ(after(baked::kInstances, offsetof(baked::InstanceRecord, geometry), 3), "instance 0: geometry");
}

TEST_F(LodValidation, GroupsAreChecked) {
  using Group = baked::LodGroupRecord;
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const LodView lod = file_.lod(0);
  const size_t last = lod.groups.size() - 1; // terminal
  ASSERT_TRUE(std::isinf(lod.groups[last].error));
  EXPECT_EQ(group(0, offsetof(Group, error), nan), "lod group 0: error");
  EXPECT_EQ(group(0, offsetof(Group, error), -1.0f), "lod group 0: error");
  EXPECT_EQ(group(0, offsetof(Group, radius), nan), "lod group 0: sphere");
  EXPECT_EQ(group(0, offsetof(Group, radius), -1.0f), "lod group 0: sphere");
  EXPECT_EQ(group(0, offsetof(Group, radius), infinity), "lod group 0: sphere");
  EXPECT_EQ(group(0, offsetof(Group, center) + 8, nan), "lod group 0: sphere");
  EXPECT_EQ(after(baked::kLodGroups, offsetof(Group, level), 1), "lod group 0: level");
  EXPECT_EQ(group(last, offsetof(Group, error), 1e9f), "lod group " + std::to_string(last) + ": coarser clusters");
  // What the first cluster of level 1 is made of, and is part of.
  const LodLink link = lod.links_of(1)[0];
  const std::string at = "lod link " + std::to_string(lod.levels[1].first_link) + ": ";
  EXPECT_EQ(group(link.generating_group, offsetof(Group, error), infinity), at + "generating group is terminal");
  EXPECT_EQ(group(link.group, offsetof(Group, error), 0.0f), at + "error below that of the generating group");
  EXPECT_EQ(group(link.group, offsetof(Group, radius), 0.0f), at + "sphere does not hold that of the generating group");
  EXPECT_EQ(group(link.generating_group, offsetof(Group, center), 100.0f),
            at + "sphere does not hold that of the generating group");
}

TEST_F(LodValidation, LinksAreChecked) {
  using Link = baked::LodLinkRecord;
  const LodView lod = file_.lod(0);
  const auto first = static_cast<size_t>(lod.levels[1].first_link);
  const std::string at = "lod link " + std::to_string(first) + ": ";
  EXPECT_EQ(link(0, offsetof(Link, group), lod.levels[0].group_count), "lod link 0: group");
  EXPECT_EQ(link(0, offsetof(Link, group), uint16_t{0xffff}), "lod link 0: group");
  EXPECT_EQ(link(0, offsetof(Link, generating_group), uint16_t{1}), "lod link 0: generating group");
  EXPECT_EQ(link(first, offsetof(Link, group), lod.levels[1].group_count), at + "group");
  EXPECT_EQ(link(first, offsetof(Link, generating_group), uint16_t{0xffff}), at + "generating group");
  EXPECT_EQ(link(first, offsetof(Link, generating_group), lod.levels[0].group_count), at + "generating group");
}

TEST_F(LodValidation, EveryTruncatedPrefixIsRefused) {
  for (size_t size = 0; size < bytes_.size(); size += 1 + (size > 1024) * 6)
    ASSERT_EQ(open_kind(std::span(bytes_).first(size)), ErrorKind::kInput) << size;
}

/// Any word of the three sections and of the levels' geometry records, changed to anything: refused, or read safely.
TEST_F(LodValidation, DamageWithRightHashesIsRefusedOrHarmless) {
  baked::FileHeader header;
  std::memcpy(&header, bytes_.data(), sizeof header);
  Random random(21);
  uint32_t refused = 0, accepted = 0;
  for (int round = 0; round < 6000; ++round) {
    std::vector<std::byte> bytes = bytes_;
    constexpr std::array<baked::Section, 4> kSections = {baked::kLodLevels, baked::kLodGroups, baked::kLodLinks,
                                                         baked::kGeometries};
    const baked::SectionRecord& section = header.sections[kSections[random.bits() % 4]];
    const size_t at = static_cast<size_t>(section.offset) + random.bits() % static_cast<size_t>(section.bytes);
    bytes[at] = random.bits() % 2 ? static_cast<std::byte>(random.bits() & 0xffu) : bytes[at] ^ std::byte{1};
    rehash<baked::FileHeader>(bytes);
    try {
      const BakedFile file = BakedFile::from_bytes(bytes);
      for (uint32_t g = 0; g < file.base_geometry_count(); ++g) {
        const LodView lod = file.lod(g);
        for (size_t level = 0; level < lod.levels.size(); ++level) {
          ASSERT_EQ(lod.links_of(level).size(), file.clusters(lod.levels[level].geometry).size());
          ASSERT_EQ(lod.groups_of(level).size(), lod.levels[level].group_count);
          (void)decode(file, lod.levels[level].geometry);
        }
      }
      (void)summarize(file);
      ++accepted;
    } catch (const Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 3000u);
  EXPECT_GT(accepted, 100u); // errors and radii may be a little larger
}

TEST_F(LodValidation, DiskFormsGiveTheSameFile) {
  for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
    BakeConfig config;
    config.codec = codec;
    const std::vector<std::byte> disk = lod_file(config);
    EXPECT_TRUE(std::ranges::equal(BakedFile::from_bytes(disk).bytes(), bytes_));
    for (size_t size = 0; size < disk.size(); size += 13)
      ASSERT_EQ(open_kind(std::span(disk).first(size)), ErrorKind::kInput) << size;
  }
}

} // namespace
} // namespace packtrace::test
