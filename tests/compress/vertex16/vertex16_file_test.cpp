#include "compress/exchange/vertex16/vertex16_file.h"

#include <cstring>

#include <gtest/gtest.h>

#include "compress/exchange/vertex16/vertex16_export.h"
#include "compress/format/textures/texture_codec.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/file_hashes.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using vertex16::Header;

std::vector<std::byte> small_file() {
  Scene scene = test::scene_of(test::grid_mesh(3, 0.1f, true));
  AlphaMask mask;
  mask.width = 40, mask.height = 2;
  mask.words = {1, 2, 3, 4};
  scene.masks.push_back(mask);
  scene.materials.push_back({"leaf", kAlphaMask | kAlbedoTexture | kNormalMap, Vec3(0.1f, 0.5f, 0.2f), 0, kNoMask, 0});
  scene.textures.push_back({"t", 2, 2, WrapMode::kRepeat, Vec2(1), Vec2(0), std::vector<uint8_t>(12, 9)});
  test::add_shape(scene, test::grid_mesh(2, 0.3f, true), test::translation({0, 0, 1}), 1);
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  Progress progress;
  return export_vertex16(BakedFile::from_bytes(test::bake(scene, config).bytes), progress).bytes;
}

ErrorKind refusal(std::span<const std::byte> bytes) {
  const std::vector<std::byte> aligned(bytes.begin(), bytes.end());
  try {
    (void)vertex16::validate(aligned, "test");
  } catch (const Error& error) {
    return error.kind();
  }
  return ErrorKind::kCancelled;
}

TEST(Vertex16File, EveryTruncatedPrefixAndTrailingBytesAreRefused) {
  std::vector<std::byte> bytes = small_file();
  for (size_t size = 0; size < bytes.size(); ++size)
    ASSERT_EQ(refusal(std::span(bytes).first(size)), ErrorKind::kInput) << size;
  EXPECT_EQ(refusal(bytes), ErrorKind::kCancelled);
  bytes.resize(bytes.size() + 64);
  EXPECT_EQ(refusal(bytes), ErrorKind::kInput);
}

TEST(Vertex16File, EverySingleBitFlipIsRefused) {
  std::vector<std::byte> bytes = small_file();
  for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const auto flip = static_cast<std::byte>(1u << (bit % 8));
    bytes[bit / 8] ^= flip;
    const bool in_version = bit / 8 >= 8 && bit / 8 < 12;
    ASSERT_EQ(refusal(bytes), in_version ? ErrorKind::kUnsupported : ErrorKind::kInput) << bit;
    bytes[bit / 8] ^= flip;
  }
}

/// Reads every vertex, index and mask word that a record references.
void read_all(const vertex16::Sections& s) {
  float sum = 0.0f;
  for (const vertex16::DrawRecord& draw : s.draws)
    for (uint32_t i = 0; i < draw.index_count; ++i) {
      const glm::uvec4 v = s.vertices[s.vertex(draw, i)];
      sum += vertex16::vertex16_position(v, s.geometries[draw.geometry].frame).x +
             vertex16::vertex16_uv(v, s.geometries[draw.geometry].frame).x + s.geometries[draw.geometry].bounds_lo[0];
    }
  for (const baked::MaskRecord& mask : s.masks)
    sum += static_cast<float>(s.mask_words[mask.first_word + (mask.width + 31) / 32 * mask.height - 1]);
  for (const baked::TextureRecord& t : s.textures)
    sum += s.texture_bytes[t.first_byte + texture_bytes(static_cast<TextureCodec>(t.codec), t.width, t.height) - 1];
  for (const vertex16::InstanceRecord& instance : s.instances) {
    const vertex16::GeometryRecord& g = s.geometries[instance.geometry];
    for (uint32_t d = 0; d < g.draw_count; ++d)
      sum += s.materials[s.material_slots[instance.first_slot + s.draws[g.first_draw + d].material_slot]].albedo[0];
  }
  volatile float sink = sum;
  (void)sink;
}

TEST(Vertex16File, DamageWithRightHashesIsRefusedOrHarmless) {
  const std::vector<std::byte> good = small_file();
  test::Random random(15);
  uint32_t refused = 0, accepted = 0;
  for (int round = 0; round < 20000; ++round) {
    std::vector<std::byte> bytes = good;
    for (uint32_t i = 0; i < 1 + random.bits() % 3; ++i) {
      const size_t at = 12 + random.bits() % (bytes.size() - 12);
      constexpr std::array<uint8_t, 6> kValues = {0, 1, 0x7f, 0x80, 0xff, 0xfe};
      bytes[at] = static_cast<std::byte>(random.bits() % 2 ? kValues[random.bits() % 6] : random.bits() & 0xffu);
    }
    test::rehash<Header>(bytes);
    try {
      read_all(vertex16::validate(bytes, "test"));
      ++accepted;
    } catch (const Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000u); // both outcomes must occur often enough
  EXPECT_GT(accepted, 100u);
}

TEST(Vertex16File, OtherFilesAreNamedAsSuch) {
  const std::vector<std::byte> baked = test::bake(test::scene_of(test::grid_mesh(2))).bytes;
  try {
    (void)vertex16::validate(baked, "x.v16");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "x.v16: not a vertex16 file");
  }
}

} // namespace
} // namespace packtrace
