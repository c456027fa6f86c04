#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/proxies/geometry_field.h"
#include "compress/bake/proxies/geometry_voxels.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

struct BuiltField {
  OccludingTriangles source;
  GeometryField result;
};

BuiltField field_of(const Mesh& mesh, uint32_t voxels, uint32_t bits) {
  const BakedFile file = BakedFile::from_bytes(test::bake(test::scene_of(mesh)).bytes);
  BuiltField built{occluding_triangles(file, 0, material_runs(file.sections())[0]), {}};
  ProxyConfig config;
  config.voxels = voxels, config.field_bits = bits;
  built.result = build_field(built.source, config, MemoryBudget(), "test");
  return built;
}

/// Distance to the nearest of all triangles, in voxels.
double brute_distance(const BuiltField& built, VoxelIndex v) {
  const DVec3 p = built.result.origin + built.result.edge * DVec3(v[0], v[1], v[2]);
  double nearest = 1e300;
  for (const OccludingTriangle& t : built.source.triangles) {
    std::array<DVec3, 3> c;
    for (size_t i = 0; i < 3; ++i)
      for (size_t a = 0; a < 3; ++a)
        c[i][static_cast<glm::length_t>(a)] =
            static_cast<double>(t.corners[i][a] + built.source.low[a]) * built.source.step;
    nearest = std::min(nearest, glm::distance(p, nearest_point(p, c[0], c[1], c[2])));
  }
  return nearest / built.result.edge;
}

TEST(DistanceFieldCodec, StoredDistancesAreExactToTheirQuantisation) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  for (const uint32_t bits : {8u, 16u}) {
    const BuiltField built = field_of(test::soup_mesh(60, 5), 24, bits);
    const DistanceField& field = built.result.field;
    EXPECT_FALSE(built.result.has_sign);
    uint64_t compared = 0;
    for (uint32_t z = 0; z < field.size()[2]; ++z)
      for (uint32_t y = 0; y < field.size()[1]; ++y)
        for (uint32_t x = 0; x < field.size()[0]; ++x) {
          const double expected = std::min(brute_distance(built, {x, y, z}), double{voxels::kFieldBand});
          const auto stored = field.sample({x, y, z});
          if (!stored) {
            ASSERT_EQ(expected, double{voxels::kFieldBand});
            ASSERT_LE(std::abs(field.distance(glm::vec3(x, y, z))), brute_distance(built, {x, y, z}) + 1e-4);
            continue;
          }
          ++compared;
          ASSERT_NEAR(*stored, expected, field.quantum() * 1.001 + 1e-5);
        }
    EXPECT_GT(compared, 5000u);
  }
}

TEST(DistanceFieldCodec, JumpFloodingHasErrorsAndTheyAreRepaired) {
  const BuiltField built = field_of(test::soup_mesh(300, 8), 32, 16);
  EXPECT_GT(built.result.repaired, 0u);
  EXPECT_LT(built.result.repaired * 10, built.result.band_samples);
}

TEST(DistanceFieldCodec, ClosedGeometriesHaveNegativeDistancesInside) {
  const BuiltField built = field_of(test::sphere_mesh(60), 40, 16);
  ASSERT_TRUE(built.result.has_sign);
  const DistanceField& field = built.result.field;
  for (uint32_t z = 0; z < field.size()[2]; z += 3)
    for (uint32_t y = 0; y < field.size()[1]; y += 3)
      for (uint32_t x = 0; x < field.size()[0]; x += 3) {
        const double expected =
            (glm::length(built.result.origin + built.result.edge * DVec3(x, y, z)) - 1.0) / built.result.edge;
        const double got = field.distance(glm::vec3(x, y, z));
        if (std::abs(expected) > 0.1) {
          ASSERT_EQ(got < 0.0, expected < 0.0) << expected;
        }
        if (std::abs(expected) < 2.9)
          ASSERT_NEAR(got, expected, 0.06);
        else
          ASSERT_LE(std::abs(got), std::abs(expected) + 0.06);
      }
}

TEST(DistanceFieldCodec, EveryPrefixIsAFaultAndEveryChangedBitIsOneOrReadable) {
  const DistanceField field = field_of(test::sphere_mesh(12), 12, 8).result.field;
  const std::vector<uint32_t> words(field.words().begin(), field.words().end());
  EXPECT_EQ(find_field_fault(field.header(), words), std::nullopt);
  for (size_t n = 0; n < words.size(); n += n < 64 ? 1 : 37) {
    voxels::FieldHeader header = field.header();
    EXPECT_NE(find_field_fault(header, std::span(words).first(n)), std::nullopt);
    header.word_count = n;
    EXPECT_NE(find_field_fault(header, std::span(words).first(n)), std::nullopt);
  }
  const auto read_all = [](const DistanceField& changed) {
    float sum = 0.0f;
    for (float z = -1.0f; z < 30.0f; z += 3.7f)
      for (float y = -1.0f; y < 30.0f; y += 3.7f)
        for (float x = -1.0f; x < 30.0f; x += 3.7f) sum += changed.distance({x, y, z});
    EXPECT_TRUE(std::isfinite(sum));
  };
  for (size_t bit = 0; bit < sizeof(voxels::FieldHeader) * 8; ++bit) {
    voxels::FieldHeader header = field.header();
    reinterpret_cast<uint8_t*>(&header)[bit / 8] ^= static_cast<uint8_t>(1u << (bit % 8));
    if (!find_field_fault(header, words)) read_all(DistanceField(header, words));
  }
  for (size_t bit = 0; bit < words.size() * 32; bit += bit < 4096 ? 1 : 211) {
    std::vector<uint32_t> changed = words;
    changed[bit / 32] ^= 1u << (bit % 32);
    if (!find_field_fault(field.header(), changed)) read_all(DistanceField(field.header(), changed));
  }
}

TEST(DistanceFieldCodec, AFieldBeyondTheMemoryNamesTheLargestThatFits) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const BakedFile file = BakedFile::from_bytes(test::bake(test::scene_of(test::sphere_mesh(10))).bytes);
  const OccludingTriangles source = occluding_triangles(file, 0, material_runs(file.sections())[0]);
  ProxyConfig config;
  config.voxels = 1000;
  std::string message;
  try {
    build_field(source, config, MemoryBudget(uint64_t{8} << 20), "ball");
  } catch (const MemoryError& error) {
    message = error.what();
  }
  const size_t at = message.find("the largest that fits is --proxy-voxels ");
  ASSERT_NE(at, std::string::npos) << message;
  config.voxels = static_cast<uint32_t>(std::stoul(message.substr(at + 40)));
  EXPECT_NO_THROW(build_field(source, config, MemoryBudget(uint64_t{8} << 20), "ball"));
}

} // namespace
} // namespace packtrace
