#include <cstdint>

#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/hostile_recipe.h"
#include "tests/pbrt_import/hostile_scene.h"

namespace packtrace {
namespace {

using namespace std::string_literals;

TEST(HostileFiles, ImagesKeepTheirMeanColour) {
  const SceneFolder folder;
  const auto albedo_of = [&](const std::string& name, const std::string& content) {
    folder.write(name, content);
    const Imported imported = import_world(
        folder, "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"" + name +
                    "\" \"bool gamma\" \"false\" Material \"matte\" \"texture Kd\" \"t\"" + std::string(kTriangle));
    EXPECT_EQ(imported.text(), "") << name;
    return only_material(imported).albedo;
  };
  EXPECT_EQ(albedo_of("a.exr", recipe_bytes("exr")), Vec3(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(albedo_of("a.pfm", "PF\n1 1\n1.0\n\x3f\0\0\0\x3f\0\0\0\x3e\x80\0\0"s), Vec3(0.5f, 0.5f, 0.25f));
  EXPECT_EQ(albedo_of("16.png", png(1, 1, 16, std::string("\0\x80\x01\0\0\xff\xff", 7))),
            Vec3(0x8001 / 65535.0f, 0.0f, 1.0f));
}

TEST(HostileFiles, LargeAlphaImagesWithManyNodesAreApproximated) {
  const SceneFolder folder;
  constexpr uint32_t kSide = 8192;
  std::string rows(size_t{kSide} * (1 + kSide / 8), '\xaa');
  for (size_t row = 0; row < kSide; ++row) rows[row * (1 + kSide / 8)] = 0; // each row starts with its filter byte
  folder.write("a.png", png(kSide, kSide, 1, rows, kGrey));
  std::string text = "Texture \"t0\" \"float\" \"imagemap\" \"string filename\" \"a.png\"\n";
  for (int i = 1; i < 60; ++i)
    text += "Texture \"" + numbered("t", i) + "\" \"float\" \"scale\" \"texture tex1\" \"" + numbered("t", i - 1) +
            "\" \"texture tex2\" \"" + numbered("t", i - 1) + "\"\n";
  const Imported imported = import_text(folder, world(text + std::string(kTriangle) + "\"texture alpha\" \"t59\""));
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene.pbrt:61:1: note: alpha texture \"t59\" is not a plain image "
            "over uv; its holes are approximated\n");
  EXPECT_TRUE(imported.scene.masks.empty());
  EXPECT_EQ(kept_of(imported), (Kept{2, 2, 0, 0}));
}

TEST(HostileFiles, EveryTruncationOfAnImageIsAnError) {
  const SceneFolder folder;
  for (const auto& [name, content] : {std::pair<std::string, std::string>{"a.png", good_png()},
                                      {"a.tga", recipe_bytes("tga 3 2 6")},
                                      {"a.exr", recipe_bytes("exr")}}) {
    for (size_t size = 0; size < content.size(); size += name == "a.exr" ? 7 : 1) {
      folder.write(name, content.substr(0, size));
      const Imported imported =
          import_world(folder, "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"" + name +
                                   "\" Material \"matte\" \"texture Kd\" \"t\"" + std::string(kTriangle));
      EXPECT_EQ(imported.count(Severity::kError), 1u) << name << " of " << size << " bytes: " << imported.text();
      EXPECT_EQ(only_material(imported).albedo, Vec3(1.0f)) << name << " of " << size << " bytes";
    }
  }
}

} // namespace
} // namespace packtrace
