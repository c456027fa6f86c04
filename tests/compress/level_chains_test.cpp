#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include <gtest/gtest.h>

#include "compress/bake/plan/geometry_plan.h"
#include "compress/format/deformation/deformation_view.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"
#include "tests/deforming_meshes.h"

namespace packtrace {
namespace {

uint32_t add_cloth(Scene& scene, uint32_t quads, const std::string& name) {
  Mesh mesh = test::Cloth(quads).mesh(0.0);
  mesh.name = name;
  const auto number = static_cast<uint32_t>(scene.objects.size());
  Object& object = scene.objects.emplace_back();
  object.name = name;
  object.shapes.emplace_back().mesh = static_cast<uint32_t>(scene.meshes.size());
  scene.meshes.push_back(std::move(mesh));
  return number;
}

/// Three clothes of 8, 4 and 2 quads; the first is instanced twice, the others are not.
struct ChainedScene {
  ChainedScene() {
    scene.materials.emplace_back();
    for (const uint32_t quads : {8u, 4u, 2u}) add_cloth(scene, quads, "cloth_" + std::to_string(quads));
    scene.instances.resize(2);
    scene.instances[1].world_from_object = Affine(2.0f);
    config.precision_kind = PrecisionKind::kAbsolute, config.precision = 1e-3;
    config.level_chains = {{{0, 1, 2}, {10.0, 25.5}}};
  }
  std::vector<std::byte> bytes() const { return test::bake(scene, config).bytes; }
  ErrorKind refused() const {
    try {
      bytes();
    } catch (const Error& error) {
      return error.kind();
    }
    ADD_FAILURE() << "not refused";
    return ErrorKind::kIo;
  }

  Scene scene;
  BakeConfig config;
};

TEST(LevelChains, StoreLevelsThatNothingPlaces) {
  const ChainedScene chained;
  const BakedFile file = BakedFile::from_bytes(chained.bytes());
  const auto chains = level_chains(file.sections().deformation);
  ASSERT_EQ(chains.size(), 1u);
  EXPECT_EQ(chains[0].level_count, 3u);
  EXPECT_EQ(chains[0].distance[0], 10.0);
  EXPECT_EQ(chains[0].distance[1], 25.5);
  const uint32_t triangles[] = {128, 32, 8};
  for (size_t level = 0; level < 3; ++level)
    EXPECT_EQ(file.geometries()[chains[0].geometry[level]].triangle_count, triangles[level]);
  // Instances may show any level, so all have a step for the larger instance.
  for (const baked::GeometryRecord& g : file.geometries()) EXPECT_LE(g.position_error_bound * 2.0, 0.5e-3 * 1.001);
  for (const auto& runs : material_runs(file.sections())) EXPECT_EQ(runs.size(), 1u);
}

TEST(LevelChains, AllCodecsKeepThem) {
  ChainedScene chained;
  const BakedFile plain = BakedFile::from_bytes(chained.bytes());
  for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
    chained.config.codec = codec;
    const BakedFile file = BakedFile::from_bytes(chained.bytes());
    EXPECT_TRUE(std::ranges::equal(file.sections().deformation, plain.sections().deformation));
  }
}

TEST(LevelChains, GoWithMeshesThatDeform) {
  ChainedScene chained;
  chained.config.sequences.push_back(
      {1, std::make_shared<test::GivenFrames>(test::sampled(test::Cloth(4), 3)), 24.0, 0});
  const BakedFile file = BakedFile::from_bytes(chained.bytes());
  ASSERT_EQ(deformation_records(file.sections().deformation).size(), 1u);
  EXPECT_EQ(deformation_records(file.sections().deformation)[0].geometry, 1u);
  EXPECT_EQ(level_chains(file.sections().deformation).size(), 1u);
}

TEST(LevelChains, ObjectsThatCannotStandForEachOtherAreRefused) {
  ChainedScene equal;
  equal.config.level_chains[0].objects[2] = add_cloth(equal.scene, 4, "again");
  EXPECT_EQ(equal.refused(), ErrorKind::kUsage);
  ChainedScene masked;
  masked.scene.materials.emplace_back().flags = kTransmissive;
  masked.scene.objects[1].shapes[0].material = 1;
  EXPECT_EQ(masked.refused(), ErrorKind::kUsage);
  ChainedScene unplaced;
  unplaced.scene.instances.clear();
  EXPECT_EQ(unplaced.refused(), ErrorKind::kUsage);
  ChainedScene unknown;
  unknown.config.level_chains[0].objects[1] = 7;
  EXPECT_EQ(unknown.refused(), ErrorKind::kInput);
  for (const std::vector<double>& distances :
       {std::vector<double>{5.0}, {5.0, 5.0}, {0.0, 5.0}, {5.0, INFINITY}, {5.0, NAN}}) {
    ChainedScene wrong;
    wrong.config.level_chains[0].distances = distances;
    EXPECT_EQ(wrong.refused(), ErrorKind::kUsage);
  }
}

TEST(LevelChains, FaultsAreNamed) {
  const std::vector<std::byte> bytes = ChainedScene().bytes();
  constexpr size_t kRecord = sizeof(baked::DeformationHeader);
  const auto expect_fault = [&](size_t at, uint32_t value, const char* part) {
    const std::string message = test::message_after(bytes, baked::kDeformation, at, value);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect_fault(offsetof(baked::DeformationHeader, chain_count), 0, "number of animations");
  expect_fault(offsetof(baked::DeformationHeader, chain_count), 2, "number of level chains");
  expect_fault(offsetof(baked::DeformationHeader, chain_count), ~0u, "number of level chains");
  expect_fault(offsetof(baked::DeformationHeader, animation_count), 1, "number of");
  expect_fault(kRecord, 1, "number of levels");
  expect_fault(kRecord, 9, "number of levels");
  expect_fault(kRecord, 2, "distances");
  expect_fault(kRecord, 4, "distances");
  expect_fault(kRecord + offsetof(baked::LevelChainRecord, reserved), 1, "reserved field");
  expect_fault(kRecord + offsetof(baked::LevelChainRecord, geometry) + 4, 3, "geometry of a level");
  expect_fault(kRecord + offsetof(baked::LevelChainRecord, geometry) + 28, 1, "geometry of a level");
  expect_fault(kRecord + offsetof(baked::LevelChainRecord, distance) + 4, 0xc0240000, "distances");
  expect_fault(kRecord + offsetof(baked::LevelChainRecord, distance) + 4, 0x7ff80000, "distances");
  expect_fault(kRecord + offsetof(baked::LevelChainRecord, distance) + 12, 0x40000000, "distances");
}

TEST(LevelChains, DamagedBitsAreRejectedOrHarmless) {
  const std::vector<std::byte> good = ChainedScene().bytes();
  const size_t bits = 8 * BakedFile::from_bytes(good).sections().deformation.size();
  size_t rejected = 0;
  for (size_t bit = 0; bit < bits; ++bit) {
    std::vector<std::byte> bytes = good;
    baked::FileHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    bytes[header.sections[baked::kDeformation].offset + bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
    test::rehash<baked::FileHeader>(bytes);
    try {
      const BakedFile damaged = BakedFile::from_bytes(bytes);
      for (const baked::LevelChainRecord& chain : level_chains(damaged.sections().deformation))
        for (uint32_t level = 0; level < chain.level_count; ++level)
          EXPECT_LT(chain.geometry[level], damaged.base_geometry_count());
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      ++rejected;
    }
  }
  EXPECT_GT(rejected, bits * 3 / 4); // distances can have many values
  EXPECT_LT(rejected, bits);
}

} // namespace
} // namespace packtrace
