// Textures that are kept: alpha masks, and albedo textures with ImportOptions::keep_textures.

#include <cmath>

#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/pbrt_import/texture_images.h"

namespace packtrace {
namespace {

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
