#include <cmath>

#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/image_file.h"
#include "pbrt_import/language/spectrum.h"
#include "pbrt_import/language/texture_graph.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

/// An uncompressed 24-bit TGA with rows from the top, from grey values of one byte.
std::string grey_tga(uint32_t width, uint32_t height, const std::vector<uint8_t>& grey) {
  std::string file(18, '\0');
  file[2] = 2;
  file[12] = static_cast<char>(width), file[13] = static_cast<char>(width >> 8);
  file[14] = static_cast<char>(height), file[15] = static_cast<char>(height >> 8);
  file[16] = 24;
  file[17] = 0x20; // rows start at the top
  for (const uint8_t value : grey) file.append(3, static_cast<char>(value));
  return file;
}

std::string pfm(uint32_t width, uint32_t height, const std::vector<float>& rgb) {
  std::string file = "PF\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
  file.append(reinterpret_cast<const char*>(rgb.data()), rgb.size() * 4);
  return file;
}

std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

TEST(ImageFile, SrgbIsAveragedLinearly) {
  const std::string file = grey_tga(2, 1, {0, 255});
  EXPECT_NEAR(read_image(bytes(file), true, false, 1 << 20).average.x, 0.5, 1e-6);
  const std::string middle = grey_tga(1, 1, {128});
  EXPECT_NEAR(read_image(bytes(middle), true, false, 1 << 20).average.y, 0.21586, 1e-4);
  EXPECT_NEAR(read_image(bytes(middle), false, false, 1 << 20).average.y, 128.0 / 255.0, 1e-6);
}

TEST(ImageFile, NonzeroTexelsAreMarkedRowByRowFromTheTop) {
  std::vector<uint8_t> grey(33 * 2, 0);
  grey[32] = 1, grey[33] = 255;
  const std::string file = grey_tga(33, 2, grey);
  const ImageSummary image = read_image(bytes(file), true, true, 1 << 20);
  EXPECT_EQ(image.nonzero, (std::vector<uint32_t>{0, 1, 1, 0}));
}

TEST(ImageFile, PfmRowsStartAtTheBottom) {
  const std::string file = pfm(1, 2, {1, 2, 3, 0, 0, 0});
  const ImageSummary image = read_image(bytes(file), true, true, 1 << 20);
  EXPECT_EQ(image.average, Vec3(0.5f, 1.0f, 1.5f));
  EXPECT_EQ(image.nonzero, (std::vector<uint32_t>{0, 1}));
}

TEST(ImageFile, EveryTruncationIsAnError) {
  const std::string file = pfm(2, 2, std::vector<float>(12, 1.0f));
  for (size_t size = 0; size < file.size(); ++size) {
    const std::string part = file.substr(0, size);
    EXPECT_THROW(read_image(bytes(part), true, true, 1 << 20), Error) << size;
  }
}

TEST(ImageFile, HugeSizesAreRefusedBeforeAllocating) {
  for (const char* const text :
       {"PF\n16777216 16777216\n-1.0\n", "PF\n1e300 1e300\n-1\n", "PF\n-5 5\n-1\n", "PF\nnan 1\n1\n"}) {
    const std::string file = text;
    EXPECT_THROW(read_image(bytes(file), true, true, 1 << 20), Error) << text;
  }
  const std::string wide = grey_tga(65535, 65535, {});
  EXPECT_THROW(read_image(bytes(wide), true, true, 1 << 20), Error);
}

TEST(ImageFile, NoiseIsNotAnImage) {
  for (const char* const magic : {"", "\x76\x2f\x31\x01", "\x89PNG\r\n\x1a\n", "#?RADIANCE\n"}) {
    std::string file = magic;
    for (uint32_t i = 0; i < 1000; ++i) file += static_cast<char>((i * 2654435761u) >> 21);
    EXPECT_THROW(read_image(bytes(file), true, true, 1 << 20), Error) << magic;
  }
}

TEST(Spectrum, FlatSpectrumHasUnitLuminance) {
  const float flat[] = {400, 1, 700, 1};
  const Vec3 rgb = rgb_from_samples(flat);
  EXPECT_NEAR(0.212671f * rgb.x + 0.715160f * rgb.y + 0.072169f * rgb.z, 1.0f, 1e-3f);
  EXPECT_NEAR(rgb.y, 0.95f, 0.05f); // equal energy is slightly pink in sRGB
}

TEST(Spectrum, LongWavesAreRed) {
  const float red[] = {610, 0, 620, 1, 700, 1};
  const Vec3 rgb = rgb_from_samples(red);
  EXPECT_GT(rgb.x, 10.0f * std::abs(rgb.y));
}

TEST(Spectrum, XyzOfD65IsWhite) {
  const Vec3 white = rgb_from_xyz({0.95047f, 1.0f, 1.08883f});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(white[c], 1.0f, 1e-3f);
}

TEST(Spectrum, ConductorsReflect) {
  EXPECT_NEAR(conductor_albedo(1.0f, 0.0f), 0.0f, 1e-6f); // no interface
  const MetalIndices copper = *metal_by_name("metals/Cu.eta.spd");
  const Vec3 albedo(conductor_albedo(copper.eta.x, copper.k.x), conductor_albedo(copper.eta.y, copper.k.y),
                    conductor_albedo(copper.eta.z, copper.k.z));
  EXPECT_GT(albedo.x, 0.9f);
  EXPECT_LT(albedo.z, 0.6f);
  EXPECT_FALSE(metal_by_name("Unobtainium.spd"));
}

TEST(Spectrum, SpdFilesAreListsOfPairs) {
  EXPECT_EQ(parse_spd("# head\n400 0.5\r\n500 1e-1 # tail"), (std::vector<float>{400, 0.5f, 500, 0.1f}));
  for (const char* const text : {"", "# only", "400", "400 x", "400 0.5 500"}) EXPECT_FALSE(parse_spd(text)) << text;
}

TEST(Textures, ImagesGiveTheirAverage) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(2, 1, {0, 255}));
  const Material material = only_material(
      import_world(folder, "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.tga\" \"float scale\" 0.5 "
                           "Material \"matte\" \"texture Kd\" \"t\"" +
                               std::string(kTriangle)));
  EXPECT_NEAR(material.albedo.x, 0.25f, 1e-6f);
  EXPECT_EQ(material.flags, kAlbedoTexture);
}

TEST(Textures, ArithmeticIsDoneOnAverages) {
  const SceneFolder folder;
  const Material material = only_material(import_world(
      folder, "Texture \"a\" \"spectrum\" \"constant\" \"rgb value\" [1 0.5 0]"
              "Texture \"b\" \"color\" \"scale\" \"texture tex1\" \"a\" \"rgb tex2\" [0.5 0.5 0.5]"
              "Texture \"c\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"b\" \"rgb tex2\" [0 0 0.5]"
              "Texture \"d\" \"spectrum\" \"mix\" \"texture tex1\" \"c\" \"rgb tex2\" [1 1 1] \"float amount\" 0.5 "
              "Material \"matte\" \"texture Kd\" \"d\"" +
                  std::string(kTriangle)));
  EXPECT_NEAR(material.albedo.x, 0.625f, 1e-6f);
  EXPECT_NEAR(material.albedo.y, 0.5625f, 1e-6f);
  EXPECT_NEAR(material.albedo.z, 0.625f, 1e-6f);
}

TEST(Textures, ProceduralOnesGiveTheirMeans) {
  const SceneFolder folder;
  struct Case {
    const char* texture;
    Vec3 mean;
  };
  for (const Case& c : {Case{"\"fbm\"", Vec3(0.12f)},
                        {"\"fbm\" \"integer octaves\" 4 \"float roughness\" 0.3", Vec3(0.12f)},
                        {"\"wrinkled\"", Vec3(0.4f)},
                        {"\"windy\"", Vec3(0.03f)},
                        {"\"bilerp\"", Vec3(0.5f)},
                        {"\"bilerp\" \"rgb v00\" [0.1 0.2 0.3] \"rgb v11\" [0.5 0.2 0.1]", Vec3(0.4f, 0.35f, 0.35f)},
                        {"\"bilerp\" \"rgb v00\" [1 1 1] \"rgb v10\" [1 1 1]", Vec3(1.0f)}}) {
    const Imported imported =
        import_world(folder, "Texture \"t\" \"spectrum\" " + std::string(c.texture) +
                                 " Material \"matte\" \"texture Kd\" \"t\"" + std::string(kTriangle));
    const Material material = only_material(imported);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(material.albedo[i], c.mean[i], 1e-6f) << c.texture;
    EXPECT_EQ(imported.text(), "") << c.texture;
  }
}

TEST(Textures, MissingImagesAreReportedAndWhite) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" "
                                                 "\"gone.png\"\nMaterial \"matte\" \"texture Kd\" \"t\"" +
                                                     std::string(kTriangle));
  EXPECT_EQ(only_material(imported).albedo, Vec3(1.0f));
  EXPECT_TRUE(imported.reported("scene.pbrt:1:46: error: no such texture file")) << imported.text();
  EXPECT_EQ(imported.statistics.textures_missing, 1u);
}

TEST(Textures, WindowsPathsAreFound) {
  const SceneFolder folder;
  folder.write("textures/brick.tga", grey_tga(1, 1, {255}));
  const Imported imported =
      import_world(folder, "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"textures\\brick.tga\" "
                           "Material \"matte\" \"texture Kd\" \"t\"" +
                               std::string(kTriangle));
  EXPECT_EQ(imported.statistics.textures_found, 1u);
  EXPECT_EQ(imported.count(Severity::kError), 0u);
  EXPECT_TRUE(imported.reported("warning: file names have back-slashes, \"textures\\brick.tga\"; read as slashes"));
}

TEST(Textures, UndefinedAndMistypedTexturesAreNamed) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder,
      "Texture \"wood\" \"float\" \"constant\" Material \"matte\" \"texture Kd\" \"wood\" \"texture sigma\" \"wod\"" +
          std::string(kTriangle) + "Material \"matte\" \"texture Kd\" \"brick\"");
  EXPECT_TRUE(imported.reported(
      "no spectrum texture \"wood\" for parameter \"texture Kd\"; a texture of that name has the other"));
  EXPECT_TRUE(imported.reported("no spectrum texture \"brick\""));
}

TEST(Textures, UnknownClassesAreNamed) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Texture \"a\" \"float\" \"imagmap\" Texture \"b\" \"int\" \"constant\"");
  EXPECT_TRUE(imported.reported("unknown texture class \"imagmap\"; did you mean \"imagemap\"?"));
  EXPECT_TRUE(imported.reported("unknown texture type \"int\""));
}

TEST(AlphaTextures, ImagesBecomeMasks) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(4, 4, {255, 255, 0, 0, 255, 255, 0, 0, 255, 255, 0, 0, 255, 255, 0, 0}));
  const Imported imported = import_world(
      folder,
      "Texture \"a\" \"float\" \"imagemap\" \"string filename\" \"a.tga\" \"float uscale\" 2 \"string wrap\" "
      "\"clamp\"\n"
      "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] \"texture alpha\" \"a\"");
  const Material material = only_material(imported);
  EXPECT_EQ(material.flags, kAlphaMask);
  ASSERT_EQ(imported.scene.masks.size(), 1u);
  const AlphaMask& mask = imported.scene.masks[material.alpha_mask];
  EXPECT_EQ(mask.words, (std::vector<uint32_t>{3, 3, 3, 3}));
  EXPECT_EQ(mask.wrap, WrapMode::kClamp);
  EXPECT_EQ(mask.uv_scale, Vec2(2.0f, 1.0f));
  EXPECT_TRUE(view(mask).opaque({0.1f, 0.5f}));
  EXPECT_FALSE(view(mask).opaque({0.45f, 0.5f}));
}

TEST(AlphaTextures, ExtremeMappingsKeepTheImagesTexels) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(2, 1, {0, 255}));
  for (const char* const mapping : {"\"float uscale\" 1e-44", "\"float udelta\" 1e7", "\"float uscale\" -1e38"}) {
    const Imported imported =
        import_world(folder, "Texture \"a\" \"float\" \"imagemap\" \"string filename\" \"a.tga\" " +
                                 std::string(mapping) + std::string(kTriangle) + "\"texture alpha\" \"a\"");
    ASSERT_EQ(imported.scene.masks.size(), 1u) << mapping << imported.text();
    EXPECT_EQ(imported.scene.masks[0].words, std::vector<uint32_t>{2}) << mapping;
  }
}

TEST(AlphaTextures, CheckerboardsRepeatEveryTwoCells) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "Texture \"c\" \"float\" \"checkerboard\" \"float uscale\" 3 \"float vscale\" 3 \"float udelta\" 1" +
                  std::string(kTriangle) + "\"texture alpha\" \"c\"");
  ASSERT_EQ(imported.scene.masks.size(), 1u) << imported.text();
  const AlphaMaskView mask = view(imported.scene.masks[0]);
  for (int v = -4; v < 4; ++v)
    for (int u = -4; u < 4; ++u) {
      const Vec2 centre((static_cast<float>(u) + 0.5f) / 3.0f, (static_cast<float>(v) + 0.5f) / 3.0f);
      EXPECT_EQ(mask.opaque(centre), (u + 1 + v) % 2 == 0) << u << " " << v;
    }
}

TEST(AlphaTextures, ProductsHaveTheHolesOfBoth) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(4, 1, {255, 255, 0, 0}));
  folder.write("b.tga", grey_tga(4, 1, {0, 255, 255, 255}));
  const Imported imported =
      import_world(folder, "Texture \"a\" \"float\" \"imagemap\" \"string filename\" \"a.tga\""
                           "Texture \"b\" \"float\" \"imagemap\" \"string filename\" \"b.tga\""
                           "Texture \"c\" \"float\" \"scale\" \"texture tex1\" \"a\" \"texture tex2\" \"b\""
                           "Texture \"d\" \"float\" \"scale\" \"texture tex1\" \"c\" \"float tex2\" 0.5 "
                           "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] "
                           "\"texture shadowalpha\" \"d\"");
  EXPECT_EQ(only_material(imported).flags, kShadowAlphaMask);
  ASSERT_EQ(imported.scene.masks.size(), 1u);
  EXPECT_EQ(imported.scene.masks[0].words, std::vector<uint32_t>{2});
}

TEST(AlphaTextures, ConstantsNeedNoMask) {
  const SceneFolder folder;
  folder.write("black.tga", grey_tga(2, 2, {0, 0, 0, 0}));
  folder.write("grey.tga", grey_tga(2, 2, {1, 1, 1, 1}));
  const auto with = [&](const std::string& alpha) {
    return import_world(folder, "Texture \"black\" \"float\" \"imagemap\" \"string filename\" \"black.tga\""
                                "Texture \"grey\" \"float\" \"imagemap\" \"string filename\" \"grey.tga\"" +
                                    std::string(kTriangle) + alpha);
  };
  for (const char* const opaque : {"\"float alpha\" 1", "\"float alpha\" 0.01", "\"texture alpha\" \"grey\""}) {
    const Imported imported = with(opaque);
    EXPECT_EQ(only_material(imported).flags, 0u) << opaque;
    EXPECT_TRUE(imported.scene.masks.empty());
  }
  for (const char* const absent : {"\"float alpha\" 0", "\"texture alpha\" \"black\""}) {
    const Imported imported = with(absent);
    EXPECT_TRUE(imported.scene.shapes.empty()) << absent;
    EXPECT_TRUE(imported.scene.materials.empty());
    EXPECT_EQ(imported.statistics.shapes_absent, 1u);
    EXPECT_TRUE(imported.reported("note: 1 shape is left out: its alpha is 0 everywhere")) << imported.text();
    EXPECT_EQ(imported.count(Severity::kError), 0u) << imported.text();
  }
  EXPECT_EQ(only_material(with("\"float shadowalpha\" 0")).flags, kNoShadow);
}

TEST(AlphaTextures, ProceduralOnesDoNotMakeShapesVanish) {
  const SceneFolder folder;
  for (const char* const texture : {"\"fbm\"", "\"wrinkled\"", "\"windy\"", "\"bilerp\" \"float v01\" 0", "\"dots\""}) {
    const Imported imported = import_world(folder, "Texture \"t\" \"float\" " + std::string(texture) +
                                                       std::string(kTriangle) + "\"texture alpha\" \"t\"");
    EXPECT_EQ(imported.scene.shapes.size(), 1u) << texture;
    EXPECT_EQ(only_material(imported).flags, 0u) << texture;
    EXPECT_TRUE(imported.reported("its holes are approximated")) << texture << imported.text();
  }
}

TEST(AlphaTextures, BilerpsOfEqualCornersAreConstants) {
  const SceneFolder folder;
  const auto with = [&](const std::string& corners) {
    return import_world(folder, "Texture \"t\" \"float\" \"bilerp\" " + corners + std::string(kTriangle) +
                                    "\"texture alpha\" \"t\"");
  };
  const Imported absent = with("\"float v01\" 0 \"float v11\" 0");
  EXPECT_TRUE(absent.scene.shapes.empty());
  EXPECT_EQ(absent.statistics.shapes_absent, 1u);
  EXPECT_TRUE(absent.reported("note: 1 shape is left out: its alpha is 0 everywhere")) << absent.text();
  const Imported opaque = with("\"float v00\" 1 \"float v10\" 1");
  EXPECT_EQ(only_material(opaque).flags, 0u);
  EXPECT_EQ(opaque.text(), "");
}

TEST(AlphaTextures, DeepTextureGraphsEnd) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(2, 1, {0, 255}));
  std::string text = "Texture \"t0\" \"float\" \"imagemap\" \"string filename\" \"a.tga\"\n";
  for (int i = 1; i < 20'000; ++i) {
    const std::string before = "\"t" + std::to_string(i - 1) + "\"";
    text += "Texture \"t" + std::to_string(i) + "\" \"float\" \"scale\" \"texture tex1\" " + before +
            " \"texture tex2\" " + before + "\n";
  }
  const Imported imported = import_world(folder, text + std::string(kTriangle) + "\"texture alpha\" \"t19999\"");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(imported.reported("its holes are approximated"));
  const Imported shallow = import_world(folder, text + std::string(kTriangle) + "\"texture alpha\" \"t50\"");
  EXPECT_EQ(only_material(shallow).flags, kAlphaMask);
  EXPECT_FALSE(shallow.reported("approximated"));
}

/// Imports a world with ImportOptions::keep_textures.
ImportResult with_textures(const SceneFolder& folder, const std::string& world) {
  folder.write("kept.pbrt", "WorldBegin\n" + world + "\nWorldEnd\n");
  ImportOptions options;
  options.keep_textures = true;
  Diagnostics diagnostics;
  Progress progress;
  return import_scene(folder.path() / "kept.pbrt", options, diagnostics, progress);
}

const std::string kMatte = "Material \"matte\" \"texture Kd\" \"t\"\n" + std::string(kTriangle) + "\n";

TEST(AlbedoTextures, ImagesAreKeptAsTheyAre) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(3, 2, {0, 10, 20, 128, 200, 255}));
  const std::string image = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.tga\" ";
  const ImportResult kept = with_textures(folder, image +
                                                      "\"float uscale\" 3 \"float vdelta\" 0.5 "
                                                      "\"string wrap\" \"clamp\"\n" +
                                                      kMatte);
  ASSERT_EQ(kept.scene.textures.size(), 1u);
  const AlbedoTexture& texture = kept.scene.textures[0];
  EXPECT_EQ(texture.name, "t");
  EXPECT_EQ(texture.width, 3u);
  EXPECT_EQ(texture.height, 2u);
  EXPECT_EQ(texture.wrap, WrapMode::kClamp);
  EXPECT_EQ(texture.uv_scale, Vec2(3, 1));
  EXPECT_EQ(texture.uv_offset, Vec2(0, 0.5f));
  EXPECT_EQ(texture.rgb,
            (std::vector<uint8_t>{0, 0, 0, 10, 10, 10, 20, 20, 20, 128, 128, 128, 200, 200, 200, 255, 255, 255}));
  EXPECT_EQ(kept.scene.materials.at(0).albedo_texture, 0u);
  EXPECT_EQ(kept.scene.materials[0].flags, kAlbedoTexture);
  EXPECT_TRUE(import_world(folder, image + "\n" + kMatte).scene.textures.empty()) << "not unless asked for";
}

TEST(AlbedoTextures, ExpressionsAreEvaluatedAtTheTexels) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(2, 1, {0, 255}));
  const std::string image = "Texture \"i\" \"spectrum\" \"imagemap\" \"string filename\" \"a.tga\"\n";
  const auto rgb_of = [&](const std::string& texture) {
    const ImportResult kept = with_textures(folder, image + texture + "\n" + kMatte);
    return kept.scene.textures.size() == 1 ? kept.scene.textures[0].rgb : std::vector<uint8_t>{};
  };
  EXPECT_EQ(rgb_of("Texture \"t\" \"spectrum\" \"scale\" \"texture tex1\" \"i\" \"rgb tex2\" [ 1 0 0.5 ]"),
            (std::vector<uint8_t>{0, 0, 0, 255, 0, 188}));
  EXPECT_EQ(rgb_of("Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"i\" \"rgb tex2\" [ 1 1 1 ]"),
            (std::vector<uint8_t>{188, 188, 188, 255, 255, 255}));
  const std::vector<uint8_t> checks =
      rgb_of("Texture \"t\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [ 1 0 0 ] \"rgb tex2\" [ 0 1 0 ]");
  ASSERT_EQ(checks.size(), 3u * 256 * 256);
  EXPECT_EQ((std::vector<uint8_t>{checks.begin(), checks.begin() + 3}), (std::vector<uint8_t>{0, 255, 0})); // u < v
  EXPECT_EQ((std::vector<uint8_t>{checks.end() - 3 * 256, checks.end() - 3 * 255}), (std::vector<uint8_t>{255, 0, 0}));
}

TEST(AlbedoTextures, WhatUvDoesNotChangeIsAnAverage) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(2, 1, {0, 255}));
  for (const char* const texture :
       {"\"imagemap\" \"string filename\" \"a.tga\" \"string mapping\" \"spherical\"", "\"fbm\"",
        "\"imagemap\" \"string filename\" \"missing.tga\"", "\"constant\" \"rgb value\" [ 0.2 0.3 0.4 ]"}) {
    const ImportResult kept =
        with_textures(folder, "Texture \"t\" \"spectrum\" " + std::string(texture) + "\n" + kMatte);
    EXPECT_TRUE(kept.scene.textures.empty()) << texture;
    EXPECT_EQ(kept.scene.materials.at(0).albedo_texture, kNoTexture) << texture;
  }
}

TEST(AlbedoTextures, EqualOnesAreStoredOnceAndUnusedOnesNot) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(2, 1, {0, 255}));
  folder.write("b.tga", grey_tga(2, 1, {0, 255}));
  folder.write("c.tga", grey_tga(2, 1, {9, 255}));
  std::string world;
  for (const std::string name : {"a", "b", "c"}) {
    world += "Texture \"" + name + "\" \"spectrum\" \"imagemap\" \"string filename\" \"" + name + ".tga\"\n";
    world += "Material \"matte\" \"texture Kd\" \"" + name + "\"\n";
    if (name != "c") world += std::string(kTriangle) + "\n";
  }
  const ImportResult kept = with_textures(folder, world);
  ASSERT_EQ(kept.scene.textures.size(), 1u);
  EXPECT_EQ(kept.scene.textures[0].name, "a");
}

TEST(AlbedoTextures, TogetherStayWithinTheBudget) {
  const SceneFolder folder;
  std::string world;
  for (const std::string name : {"a", "b", "c"}) { // each has 3000 bytes of colours
    folder.write(name + ".tga", grey_tga(100, 10, std::vector<uint8_t>(1000, static_cast<uint8_t>(name[0]))));
    world += "Texture \"" + name + "\" \"spectrum\" \"imagemap\" \"string filename\" \"" + name + ".tga\"\n" +
             "Material \"matte\" \"texture Kd\" \"" + name + "\"\n" + std::string(kTriangle) + "\n";
  }
  folder.write("three.pbrt", "WorldBegin\n" + world + "\nWorldEnd\n");
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1); // one image at a time
  const auto textures = [&](uint64_t budget, bool keep) {
    ImportOptions options;
    options.keep_textures = keep;
    options.memory = MemoryBudget(budget);
    Diagnostics diagnostics;
    Progress progress;
    return import_scene(folder.path() / "three.pbrt", options, diagnostics, progress).scene.textures.size();
  };
  // Reading and decoding need 10,000 bytes at a time; the images' colours and the textures need 9000 bytes each in
  // total.
  EXPECT_EQ(textures(20'000, true), 3u);
  EXPECT_EQ(textures(15'000, false), 0u);
  EXPECT_THROW(textures(15'000, true), MemoryError);
}

} // namespace
} // namespace packtrace
