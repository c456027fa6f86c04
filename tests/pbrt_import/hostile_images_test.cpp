#include <cstdint>
#include <cstring>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfRgbaFile.h>

#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/exr_stream.h"
#include "tests/pbrt_import/hostile_case.h"

namespace packtrace {
namespace {

using namespace std::string_literals;

std::string tga(uint32_t width, uint32_t height, size_t pixels) {
  std::string file(18 + 3 * pixels, '\x40');
  std::memset(file.data(), 0, 18);
  file[2] = 2;
  file[12] = static_cast<char>(width), file[13] = static_cast<char>(width >> 8);
  file[14] = static_cast<char>(height), file[15] = static_cast<char>(height >> 8);
  file[16] = 24;
  return file;
}

std::string bmp(uint32_t width, uint32_t height, size_t pixel_bytes) {
  std::string file(54 + pixel_bytes, '\x40');
  std::memset(file.data(), 0, 54);
  const auto put = [&](size_t at, uint32_t value) { std::memcpy(file.data() + at, &value, 4); };
  file[0] = 'B', file[1] = 'M';
  put(10, 54), put(14, 40), put(18, width), put(22, height), put(26, 24u << 16 | 1);
  return file;
}

std::string pfm(const std::string& header, const std::vector<float>& values) {
  std::string file = header;
  file.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  return file;
}

std::string exr() {
  StringStream stream;
  {
    const std::vector<Imf::Rgba> pixels(16, Imf::Rgba(0.25f, 0.5f, 0.75f));
    Imf::RgbaOutputFile file(stream, Imf::Header(4, 4), Imf::WRITE_RGB);
    file.setFrameBuffer(pixels.data(), 1, 4);
    file.writePixels(4);
  }
  return stream.text();
}

/// An EXR file with a depth channel but no colour channels.
std::string depth_exr() {
  StringStream stream;
  {
    Imf::Header header(2, 2);
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    std::vector<float> depths(4, 1.0f);
    Imf::FrameBuffer buffer;
    buffer.insert("Z",
                  Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(depths.data()), sizeof(float), 2 * sizeof(float)));
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(buffer);
    file.writePixels(2);
  }
  return stream.text();
}

/// exr() with a different maximum corner of its data window.
std::string exr_with_corner(int32_t x, int32_t y) {
  std::string file = exr();
  const size_t at = file.find("dataWindow\0box2i\0"s) + 17 + 4 + 8;
  std::memcpy(file.data() + at, &x, 4);
  std::memcpy(file.data() + at + 4, &y, 4);
  return file;
}

/// A disk whose colour is an image texture.
HostileCase image_case(const std::string& name, const std::string& file, const std::string& content,
                       const std::string& diagnostics) {
  return {name,
          world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"" + file +
                "\"\nMaterial \"matte\" \"texture Kd\" \"t\""),
          diagnostics,
          {1, 1, 0, 0},
          {{file, content}}};
}

std::vector<HostileCase> images() {
  return {
      image_case("PngOfOnePixel", "a.png", png(1, 1, 8, std::string("\0\x80\x80\x80", 4)), ""),
      image_case("PngOfSixteenBits", "a.png", png(1, 1, 16, std::string("\0\x80\x01\x80\x02\x80\x03", 7)), ""),
      image_case("PngNamedTga", "a.tga", good_png(), ""),
      image_case("PngGzipped", "a.png", gzip(good_png()), ""),
      image_case("PngGzipTruncated", "a.png", without_end(gzip(good_png()), 1),
                 R"(scene.pbrt:2:1: error: texture file "a.png": truncated gzip data; it counts as white
)"),
      image_case("PngGzipDamaged", "a.png", flipped(gzip(good_png()), gzip(good_png()).size() - 8),
                 R"(scene.pbrt:2:1: error: texture file "a.png": damaged gzip data; it counts as white
)"),
      image_case(
          "PngTruncatedInItsHeader", "a.png", good_png().substr(0, 20),
          R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "PngTruncatedInItsPixels", "a.png", good_png().substr(0, 45),
          R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "PngWithoutItsEnd", "a.png", without_end(good_png(), 12),
          R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: the file is truncated; it counts as white
)"),
      image_case("PngWithDamagedPixels", "a.png", flipped(good_png(), 41),
                 R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: bad zlib header; it counts as white
)"),
      image_case(
          "PngOfTooFewRows", "a.png", png(100, 100, 8, std::string(10, '\0')),
          R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: too little data for its size; it counts as white
)"),
      image_case("PngOfNoPixels", "a.png", png(0, 0, 8, ""),
                 R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: it has no pixels; it counts as white
)"),
      image_case(
          "PngOfTrillionsOfPixels", "a.png", png(1 << 24, 1 << 24, 8, ""),
          R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: too little data for its size; it counts as white
)"),
      image_case(
          "PngOfMillionsOfPixels", "a.png", png(20'000, 20'000, 8, ""),
          R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: too little data for its size; it counts as white
)"),
      image_case(
          "TgaOfNoPixels", "a.tga", tga(0, 0, 0),
          R"(scene.pbrt:2:1: error: texture file "a.tga": not an image in a known format (PNG, TGA, EXR, PFM, HDR); it counts as white
)"),
      image_case(
          "TgaTruncated", "a.tga", tga(2, 2, 3),
          R"(scene.pbrt:2:1: error: texture file "a.tga": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "TgaWithoutItsLastByte", "a.tga", without_end(tga(2, 2, 4), 1),
          R"(scene.pbrt:2:1: error: texture file "a.tga": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "TgaOfBillionsOfPixels", "a.tga", tga(65'535, 65'535, 0),
          R"(scene.pbrt:2:1: error: texture file "a.tga": damaged image: its 18 bytes cannot hold the 65535 x 65535 pixels it claims; it counts as white
)"),
      image_case(
          "TgaOfMillionsOfPixels", "a.tga", tga(20'000, 20'000, 0),
          R"(scene.pbrt:2:1: error: texture file "a.tga": damaged image: its 18 bytes cannot hold the 20000 x 20000 pixels it claims; it counts as white
)"),
      image_case(
          "BmpTruncated", "a.bmp", bmp(4, 4, 20),
          R"(scene.pbrt:2:1: error: texture file "a.bmp": images in BMP format are not read, only PNG, TGA, EXR, PFM and HDR; it counts as white
)"),
      image_case(
          "HdrHeaderOnly", "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 4\n",
          R"(scene.pbrt:2:1: error: texture file "a.hdr": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "JpegNoise", "a.jpg", "\xff\xd8\xff\xe0" + std::string(100, '\x5a'),
          R"(scene.pbrt:2:1: error: texture file "a.jpg": images in JPEG format are not read, only PNG, TGA, EXR, PFM and HDR; it counts as white
)"),
      image_case(
          "GifIsNotSupported", "a.gif", "GIF89a\1\0\1\0\0\0\0"s,
          R"(scene.pbrt:2:1: error: texture file "a.gif": images in GIF format are not read, only PNG, TGA, EXR, PFM and HDR; it counts as white
)"),
      image_case(
          "TextNamedPng", "a.png", "this is no image",
          R"(scene.pbrt:2:1: error: texture file "a.png": not an image in a known format (PNG, TGA, EXR, PFM, HDR); it counts as white
)"),
      image_case(
          "EmptyImage", "a.png", "",
          R"(scene.pbrt:2:1: error: texture file "a.png": not an image in a known format (PNG, TGA, EXR, PFM, HDR); it counts as white
)"),
      image_case("PfmLittleEndian", "a.pfm", pfm("PF\n1 1\n-1.0\n", {0.5f, 0.25f, 0.125f}), ""),
      image_case("PfmBigEndian", "a.pfm", "PF\n1 1\n1.0\n\x3f\0\0\0\x3f\0\0\0\x3f\0\0\0"s, ""),
      image_case("PfmOfOneChannel", "a.pfm", pfm("Pf 2 1 -1 ", {0.5f, 0.25f}), ""),
      image_case("PfmWithCrLf", "a.pfm", pfm("PF\r\n1 1\r\n-1\n", {0.5f, 0.5f, 0.5f}), ""),
      image_case("PfmNotANumber", "a.pfm", pfm("Pf\n2 1\n-1\n", {std::numeric_limits<float>::quiet_NaN(), 0.5f}),
                 R"(scene.pbrt:2:1: warning: texture file "a.pfm": 1 pixel is not finite; it counts as black
)"),
      image_case(
          "PfmTruncated", "a.pfm", pfm("PF\n2 2\n-1\n", {1, 1, 1, 1, 1}),
          R"(scene.pbrt:2:1: error: texture file "a.pfm": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "PfmHeaderOnly", "a.pfm", "PF",
          R"(scene.pbrt:2:1: error: texture file "a.pfm": damaged PFM header: expected width, height and scale; it counts as white
)"),
      image_case(
          "PfmOfNegativeSize", "a.pfm", pfm("PF\n-1 1\n-1\n", {1, 1, 1}),
          R"(scene.pbrt:2:1: error: texture file "a.pfm": damaged PFM header: width and height must be whole numbers from 1 to 16777216; it counts as white
)"),
      image_case(
          "PfmOfHalfAPixel", "a.pfm", pfm("PF\n1.5 1\n-1\n", {1, 1, 1}),
          R"(scene.pbrt:2:1: error: texture file "a.pfm": damaged PFM header: width and height must be whole numbers from 1 to 16777216; it counts as white
)"),
      image_case(
          "PfmOfBillionsOfPixels", "a.pfm", pfm("PF\n16777216 16777216\n-1\n", {1, 1, 1}),
          R"(scene.pbrt:2:1: error: texture file "a.pfm": damaged image: its 36 bytes cannot hold the 16777216 x 16777216 pixels it claims; it counts as white
)"),
      image_case(
          "PfmScaleZero", "a.pfm", pfm("PF\n1 1\n0\n", {1, 1, 1}),
          R"(scene.pbrt:2:1: error: texture file "a.pfm": damaged PFM header: the scale must be finite and not 0; it counts as white
)"),
      image_case(
          "PfmScaleNotANumber", "a.pfm", pfm("PF\n1 1\nnan\n", {1, 1, 1}),
          R"(scene.pbrt:2:1: error: texture file "a.pfm": damaged PFM header: the scale must be finite and not 0; it counts as white
)"),
      image_case("PfmOfHugeColours", "a.pfm", pfm("PF\n1 1\n-1\n", {3e38f, 3e38f, 3e38f}),
                 R"(scene.pbrt:3:1: note: material "matte": its colour leaves [0, 1] and is clamped
)"),
      image_case("Exr", "a.exr", exr(), ""),
      image_case(
          "ExrTruncatedInItsHeader", "a.exr", exr().substr(0, 100),
          R"(scene.pbrt:2:1: error: texture file "a.exr": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "ExrTruncatedInItsPixels", "a.exr", without_end(exr(), 10),
          R"(scene.pbrt:2:1: error: texture file "a.exr": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "ExrMagicOnly", "a.exr", "\x76\x2f\x31\x01",
          R"(scene.pbrt:2:1: error: texture file "a.exr": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "ExrOfDepthOnly", "a.exr", depth_exr(),
          R"(scene.pbrt:2:1: error: texture file "a.exr": the EXR image has none of the channels R, G, B and Y; it counts as white
)"),
      image_case(
          "ExrOfBillionsOfRows", "a.exr", exr_with_corner(3, 1'000'000'000),
          R"(scene.pbrt:2:1: error: texture file "a.exr": damaged image: the file is truncated; it counts as white
)"),
      image_case(
          "ExrOfMillionsOfColumns", "a.exr", exr_with_corner(16'000'000, 3),
          R"(scene.pbrt:2:1: error: texture file "a.exr": damaged image: its 351 bytes cannot hold the blocks it claims; it counts as white
)"),
      image_case("ExrOfNoRows", "a.exr", exr_with_corner(3, -1),
                 R"(scene.pbrt:2:1: error: texture file "a.exr": the image has no pixels; it counts as white
)"),
      {"ImageMissing",
       world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"gone.png\""),
       R"(scene.pbrt:2:35: error: no such texture file "gone.png"; it counts as white
)",
       {1, 1, 0, 0}},
      {"ImageIsAFolder",
       world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"folder\""),
       R"(scene.pbrt:2:35: error: texture file "folder" is not a regular file; it counts as white
)",
       {1, 1, 0, 0},
       {{"folder/x", ""}}},
      {"ImageWithoutName",
       world("Texture \"t\" \"spectrum\" \"imagemap\""),
       R"(scene.pbrt:2:1: error: imagemap texture without a "string filename"; it counts as white
)",
       {1, 1, 0, 0}},
      {"ImageWithAnEmptyName",
       world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"\""),
       R"(scene.pbrt:2:35: error: empty file name; nothing is read
)",
       {1, 1, 0, 0}},
      {"ImageWrapUnknown",
       world("Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"a.png\" \"string wrap\" \"repaet\""),
       R"(scene.pbrt:2:1: error: unknown wrap mode "repaet"; repeat is used; did you mean "repeat"?
)",
       {1, 1, 0, 0},
       {{"a.png", good_png()}}},
      {"ImageScaleNotANumber",
       world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\" \"float scale\" nan\nMaterial "
             "\"matte\" \"texture Kd\" \"t\""),
       R"(scene.pbrt:2:1: error: parameter "float scale" is not finite; its default is used
)",
       {1, 1, 0, 0},
       {{"a.png", good_png()}}},
      {"ImageForAlphaIsDamaged",
       world("Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"a.png\"" + std::string(kTriangle) +
             "\"texture alpha\" \"t\""),
       R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: the file is truncated; it counts as white
)",
       {2, 2, 0, 0},
       {{"a.png", good_png().substr(0, 45)}}},
      {"ImageNobodyUsesIsNotRead",
       world("Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"a.png\""),
       "",
       {1, 1, 0, 0},
       {{"a.png", "junk"}}},
  };
}

const bool kRegistered = register_cases("HostileImages", images(), __FILE__);

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
  EXPECT_EQ(albedo_of("a.exr", exr()), Vec3(0.25f, 0.5f, 0.75f));
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
  for (const auto& [name, content] :
       {std::pair<std::string, std::string>{"a.png", good_png()}, {"a.tga", tga(3, 2, 6)}, {"a.exr", exr()}}) {
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
