#include <cmath>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/image_file.h"
#include "pbrt_import/language/spectrum.h"
#include "pbrt_import/language/texture_graph.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/pbrt_import/texture_images.h"

namespace packtrace {
namespace {

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

} // namespace
} // namespace packtrace
