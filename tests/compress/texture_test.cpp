#include "compress/format/textures/texture_codec.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/format/textures/texture_encoder.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using test::Random;

AlbedoTexture texture_of(uint32_t width, uint32_t height, const auto& colour) {
  AlbedoTexture texture{"t", width, height, WrapMode::kRepeat, Vec2(1.0f), Vec2(0.0f), {}};
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      for (const uint8_t value : Rgb8(colour(x, y))) texture.rgb.push_back(value);
  return texture;
}

AlbedoTexture noise(uint32_t width, uint32_t height, uint32_t seed) {
  Random random(seed);
  return texture_of(width, height, [&](uint32_t, uint32_t) {
    return Rgb8{static_cast<uint8_t>(random.bits()), static_cast<uint8_t>(random.bits()),
                static_cast<uint8_t>(random.bits())};
  });
}

/// Resembles a photograph: colours change slowly, and within a block along one direction.
AlbedoTexture smooth(uint32_t size) {
  return texture_of(size, size, [&](uint32_t x, uint32_t y) {
    const double u = 6.0 * x / size, v = 6.0 * y / size, light = 0.5 + 0.4 * std::sin(u + std::cos(v));
    return Rgb8{static_cast<uint8_t>(220 * light), static_cast<uint8_t>(180 * light + 20),
                static_cast<uint8_t>(90 + 60 * std::cos(u * 0.7) * light)};
  });
}

TextureView coded(const AlbedoTexture& texture, TextureCodec codec, const std::vector<uint8_t>& data) {
  TextureView result = view(texture);
  result.codec = codec, result.data = data;
  return result;
}

double psnr(const AlbedoTexture& texture, TextureCodec codec) {
  const EncodedTexture encoded = encode_texture(texture, codec, 0.0);
  EXPECT_EQ(encoded.data.size(), texture_bytes(codec, texture.width, texture.height));
  EXPECT_EQ(encoded.codec, codec);
  EXPECT_EQ(encoded.psnr_db, texture_psnr_db(texture, coded(texture, codec, encoded.data)));
  return encoded.psnr_db;
}

TEST(TextureCodec, SrgbBytesRoundTripAndRoundToTheNearest) {
  for (size_t i = 0; i < 256; ++i) EXPECT_EQ(srgb8_of_linear(linear_of_srgb8()[i]), i);
  EXPECT_EQ(srgb8_of_linear(0.21404114f), 128); // slightly above 127.5
  EXPECT_EQ(srgb8_of_linear(-1.0f), 0);
  EXPECT_EQ(srgb8_of_linear(7.0f), 255);
  EXPECT_EQ(srgb8_of_linear(std::nanf("")), 0);
}

TEST(TextureCodec, Bc1BlocksAreThoseOfGraphicsCards) {
  // Endpoints pure red and pure blue; indices 0 1 2 3 in the first row, 3 2 1 0 in the second, 1 in the other rows.
  const std::vector<uint8_t> block{0x00, 0xf8, 0x1f, 0x00, 0b11100100, 0b00011011, 0b01010101, 0b01010101};
  TextureView texture{4, 4, WrapMode::kRepeat, Vec2(1.0f), Vec2(0.0f), TextureCodec::kBc1, block};
  const std::array<Rgb8, 4> colours{Rgb8{255, 0, 0}, {0, 0, 255}, {170, 0, 85}, {85, 0, 170}};
  for (uint32_t x = 0; x < 4; ++x) {
    EXPECT_EQ(texture.texel(x, 0), colours[x]);
    EXPECT_EQ(texture.texel(x, 1), colours[3 - x]);
    EXPECT_EQ(texture.texel(x, 3), colours[1]);
  }
  // With the smaller number first: three colours and black.
  const std::vector<uint8_t> dark{0x1f, 0x00, 0x00, 0xf8, 0b11100100, 0, 0, 0};
  texture.data = dark;
  EXPECT_EQ(texture.texel(0, 0), (Rgb8{0, 0, 255}));
  EXPECT_EQ(texture.texel(2, 0), (Rgb8{128, 0, 128}));
  EXPECT_EQ(texture.texel(3, 0), (Rgb8{0, 0, 0}));
}

TEST(TextureCodec, Bc1FindsBlocksThatItCanHoldExactly) {
  Random random(4);
  for (int round = 0; round < 300; ++round) {
    std::vector<uint8_t> block(8);
    for (uint8_t& byte : block) byte = static_cast<uint8_t>(random.bits());
    const TextureView original{4, 4, WrapMode::kRepeat, Vec2(1.0f), Vec2(0.0f), TextureCodec::kBc1, block};
    if ((block[1] << 8 | block[0]) <= (block[3] << 8 | block[2])) continue; // the encoder writes four colours only
    const AlbedoTexture texture = texture_of(4, 4, [&](uint32_t x, uint32_t y) { return original.texel(x, y); });
    EXPECT_GT(psnr(texture, TextureCodec::kBc1), 40.0) << round;
  }
}

TEST(TextureCodec, Bc1KeepsSmoothColoursAndOddSizes) {
  EXPECT_GT(psnr(smooth(64), TextureCodec::kBc1), 40.0);
  EXPECT_GT(psnr(texture_of(4, 4, [](uint32_t, uint32_t) { return Rgb8{77, 99, 131}; }), TextureCodec::kBc1), 44.0);
  const AlbedoTexture odd = texture_of(5, 7, [](uint32_t x, uint32_t y) {
    return Rgb8{static_cast<uint8_t>(40 * x), static_cast<uint8_t>(40 * x), static_cast<uint8_t>(30 * y / 3)};
  });
  EXPECT_GT(psnr(odd, TextureCodec::kBc1), 28.0);
  EXPECT_GT(psnr(noise(64, 64, 1), TextureCodec::kBc1), 12.5); // noise fits no block; this is the expected quality
}

TEST(TextureCodec, PalettesOfFewColoursAreExact) {
  const AlbedoTexture few = texture_of(16, 16, [](uint32_t x, uint32_t y) {
    return Rgb8{static_cast<uint8_t>(x * 17), static_cast<uint8_t>(y * 17), static_cast<uint8_t>(x ^ y)};
  }); // 256 colours
  EXPECT_EQ(psnr(few, TextureCodec::kPalette8), std::numeric_limits<double>::infinity());
  EXPECT_GT(psnr(smooth(128), TextureCodec::kPalette8), 38.0);
  EXPECT_GT(psnr(noise(64, 64, 2), TextureCodec::kPalette8), 22.0);
}

TEST(TextureCodec, KeyColoursAreTheEndsOfFourSixteenAndFourLevels) {
  const AlbedoTexture levels = texture_of(16, 16, [](uint32_t x, uint32_t y) {
    return Rgb8{static_cast<uint8_t>(10 + 60 * (y / 4)), static_cast<uint8_t>(30 + 15 * x),
                static_cast<uint8_t>(200 - 20 * (y % 4))};
  });
  EXPECT_EQ(psnr(levels, TextureCodec::kR2G4B2), std::numeric_limits<double>::infinity());
  const std::vector<uint8_t> data = encode_r2g4b2(levels);
  EXPECT_EQ((std::vector<uint8_t>{data.begin(), data.begin() + 6}), (std::vector<uint8_t>{10, 30, 140, 190, 255, 200}));
  EXPECT_EQ(data[6], 0b00'0000'11);       // texel (0, 0): least red and green, most blue
  EXPECT_EQ(data[6 + 255], 0b11'1111'00); // texel (15, 15)
  EXPECT_GT(psnr(smooth(64), TextureCodec::kR2G4B2), 24.0);
}

TEST(TextureCodec, AutoTakesTheSmallestThatIsGoodEnough) {
  const AlbedoTexture photo = smooth(64), rough = noise(64, 64, 3);
  EXPECT_EQ(encode_texture(photo, {}, 34.0).codec, TextureCodec::kBc1);
  EXPECT_EQ(encode_texture(photo, {}, 100.0).codec, TextureCodec::kRgb8);
  EXPECT_EQ(encode_texture(rough, {}, 34.0).codec, TextureCodec::kRgb8);
  const double palette = psnr(rough, TextureCodec::kPalette8), keys = psnr(rough, TextureCodec::kR2G4B2);
  ASSERT_LT(keys, palette);
  EXPECT_EQ(encode_texture(rough, {}, (keys + palette) / 2).codec, TextureCodec::kPalette8);
  EXPECT_EQ(encode_texture(rough, {}, keys - 0.1).codec, TextureCodec::kR2G4B2);
  // For 13 x 13 texels the palette is larger than the texture.
  EXPECT_EQ(encode_texture(noise(13, 13, 5), {}, 34.0).codec, TextureCodec::kRgb8);
}

TEST(TextureCodec, SamplesAreBilinearInLinearLight) {
  const AlbedoTexture texture = texture_of(2, 2, [](uint32_t x, uint32_t y) {
    return Rgb8{static_cast<uint8_t>(x == 0 ? 0 : 255), static_cast<uint8_t>(y == 0 ? 0 : 255), 0};
  });
  TextureView t = view(texture);
  EXPECT_EQ(t.sample({0.25f, 0.75f}), Vec3(0, 0, 0)); // centre of texel (0, 0): the top row is at v = 1
  EXPECT_EQ(t.sample({0.75f, 0.25f}), Vec3(1, 1, 0));
  EXPECT_EQ(t.sample({0.5f, 0.5f}), Vec3(0.5f, 0.5f, 0)); // 0.21 would be the mean of encoded values
  EXPECT_EQ(t.sample({0.0f, 0.75f}), Vec3(0.5f, 0, 0));   // repeats
  EXPECT_EQ(t.sample({-7.0f, 0.75f}), Vec3(0.5f, 0, 0));
  t.wrap = WrapMode::kClamp;
  EXPECT_EQ(t.sample({0.0f, 0.75f}), Vec3(0, 0, 0));
  EXPECT_EQ(t.sample({90.0f, -90.0f}), Vec3(1, 1, 0));
  t.wrap = WrapMode::kBlack;
  EXPECT_EQ(t.sample({1.0f, 0.25f}), Vec3(0.5f, 0.5f, 0));
  EXPECT_EQ(t.sample({1.3f, 0.25f}), Vec3(0, 0, 0));
  t.wrap = WrapMode::kRepeat;
  t.uv_scale = {2.0f, 1.0f}, t.uv_offset = {0.5f, 0.0f};
  EXPECT_EQ(t.sample({0.125f, 0.25f}), Vec3(1, 1, 0));
  for (const float huge : {1e30f, -1e30f, std::nanf(""), HUGE_VALF}) EXPECT_TRUE(is_finite(t.sample({huge, 0.5f})));
}

TEST(TextureCodec, RecordsThatReachTooFarAreRefused) {
  baked::TextureRecord record{};
  record.width = record.height = 8, record.codec = static_cast<uint32_t>(TextureCodec::kBc1);
  record.uv_scale = {1, 1};
  EXPECT_FALSE(find_texture_fault(record, 32));
  EXPECT_TRUE(find_texture_fault(record, 31));
  record.first_byte = 1;
  EXPECT_TRUE(find_texture_fault(record, 32));
  record.first_byte = ~uint64_t{0};
  EXPECT_TRUE(find_texture_fault(record, 32));
  record.first_byte = 0, record.width = kMaxTextureSide, record.height = kMaxTextureSide;
  EXPECT_TRUE(find_texture_fault(record, 32));
  record.width = record.height = 0;
  EXPECT_TRUE(find_texture_fault(record, 32));
  record.width = record.height = 4, record.psnr_db = std::nanf("");
  EXPECT_TRUE(find_texture_fault(record, 32));
}

Scene textured_scene() {
  Scene scene = test::scene_of(test::grid_mesh(12));
  scene.materials.push_back({"photo", kAlbedoTexture, Vec3(0.5f), kNoMask, kNoMask, 0});
  scene.materials.push_back({"bumpy", kNormalMap, Vec3(0.5f), kNoMask, kNoMask});
  scene.textures.push_back(smooth(64));
  test::add_shape(scene, test::grid_mesh(12, 0.1f, true), DAffine(1.0), 1);
  test::add_shape(scene, test::grid_mesh(8, 0.2f, true), test::translation({3, 0, 0}), 2);
  return scene;
}

TEST(BakeTextures, AreKeptOnlyWhereAskedFor) {
  const Scene scene = textured_scene();
  const BakedFile plain = BakedFile::from_bytes(test::bake(scene).bytes);
  EXPECT_TRUE(plain.sections().textures.empty());
  EXPECT_EQ(plain.materials()[1].albedo_texture, kNoTexture);
  EXPECT_FALSE(plain.cluster(1, 0).has_uvs());
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  const BakedScene baked = test::bake(scene, config);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.sections().textures.size(), 1u);
  EXPECT_EQ(file.texture(0).codec, TextureCodec::kBc1);
  EXPECT_EQ(file.materials()[1].albedo_texture, 0u);
  EXPECT_FALSE(file.cluster(0, 0).has_uvs());
  EXPECT_TRUE(file.cluster(1, 0).has_uvs());
  EXPECT_TRUE(file.cluster(2, 0).has_uvs()) << "a normal map needs them";
  EXPECT_LE(baked.report.max_uv_error_texels, 1.0 / 32.0);
  EXPECT_GE(baked.report.file.textures.at(0).psnr_db, 34.0f);
}

TEST(BakeTextures, DifferByInstanceOfOneGeometry) {
  Scene scene = textured_scene();
  scene.textures.push_back(smooth(16));
  scene.materials.push_back({"coarse", kAlbedoTexture, Vec3(0.5f), kNoMask, kNoMask, 1});
  scene.shapes.emplace_back(1, 3, false, test::translation({0, 5, 0})); // uses the mesh of "photo"
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  const BakedScene baked = test::bake(scene, config);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.instances()[3].geometry, file.instances()[1].geometry);
  EXPECT_EQ(file.materials()[file.instance_materials(1)[0]].albedo_texture, 0u);
  EXPECT_EQ(file.materials()[file.instance_materials(3)[0]].albedo_texture, 1u);
  EXPECT_LE(baked.report.max_uv_error_texels, 1.0 / 32.0);
  ASSERT_EQ(baked.report.file.uvs.size(), 1u);
  // Errors are in texels of the finer texture, for any order of the instances.
  double bumpy_and_photo = 0.0;
  for (const uint32_t g : {file.instances()[1].geometry, file.instances()[2].geometry})
    bumpy_and_photo = std::max(bumpy_and_photo, file.geometries()[g].max_uv_error * (g == 1 ? 64.0 : 0.0));
  EXPECT_EQ(baked.report.file.uvs[0].max_error_texels, bumpy_and_photo);
  EXPECT_GT(bumpy_and_photo, 0.0);
}

TEST(BakeTextures, SurvivePagesAndThreads) {
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  const std::vector<std::byte> plain = test::bake(textured_scene(), config).bytes;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(test::bake(textured_scene(), config).bytes, plain);
  }
  config.codec = PageCodec::kSmall;
  const BakedFile small = BakedFile::from_bytes(test::bake(textured_scene(), config).bytes);
  EXPECT_TRUE(std::equal(small.bytes().begin(), small.bytes().end(), plain.begin(), plain.end()));
}

TEST(BakeTextures, ScenesThatBreakTheRulesAreRefused) {
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  const auto kind_of = [&](const auto& change) {
    Scene scene = textured_scene();
    change(scene);
    try {
      (void)test::bake(scene, config);
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::kCancelled;
  };
  EXPECT_EQ(kind_of([](Scene&) {}), ErrorKind::kCancelled);
  EXPECT_EQ(kind_of([](Scene& s) { s.textures[0].rgb.pop_back(); }), ErrorKind::kInput);
  EXPECT_EQ(kind_of([](Scene& s) { s.textures[0].width = 0; }), ErrorKind::kInput);
  EXPECT_EQ(kind_of([](Scene& s) { s.textures[0].uv_offset.y = HUGE_VALF; }), ErrorKind::kInput);
  EXPECT_EQ(kind_of([](Scene& s) { s.materials[1].albedo_texture = 1; }), ErrorKind::kInput);
  EXPECT_EQ(kind_of([](Scene& s) { s.materials[1].flags = 0; }), ErrorKind::kInput);
  config.min_texture_psnr_db = 5.0;
  EXPECT_EQ(kind_of([](Scene&) {}), ErrorKind::kUsage);
  config.min_texture_psnr_db = 34.0;
  config.purpose = baked::kAo;
  EXPECT_EQ(kind_of([](Scene&) {}), ErrorKind::kUsage) << "nothing looks at textures";
}

} // namespace
} // namespace packtrace
