#include <cstring>
#include <limits>

#include <OpenEXR/ImfFloatVectorAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfKeyCodeAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfPreviewImage.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfStringVectorAttribute.h>
#include <OpenEXR/ImfTiledRgbaFile.h>
#include <OpenEXR/ImfTimeCodeAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

#include "tests/pbrt_import/exr_stream.h"
#include "tests/pbrt_import/image_test_support.h"

namespace packtrace {
namespace {

using namespace std::string_literals;
using namespace image_test;

const Imf::Rgba kPixel(0.25f, 0.5f, 0.75f);

std::string exr(Imf::Header header, Imf::RgbaChannels channels = Imf::WRITE_RGB) {
  StringStream stream;
  {
    const Imath::Box2i box = header.dataWindow();
    const int width = box.max.x - box.min.x + 1, height = box.max.y - box.min.y + 1;
    const std::vector<Imf::Rgba> pixels(static_cast<size_t>(width) * static_cast<size_t>(height), kPixel);
    Imf::RgbaOutputFile file(stream, header, channels);
    const auto before = static_cast<uint64_t>(box.min.x + int64_t{box.min.y} * width) * sizeof(Imf::Rgba);
    // An integer, since it lies outside the array.
    const uint64_t base = reinterpret_cast<uintptr_t>(pixels.data()) - before;
    file.setFrameBuffer(reinterpret_cast<const Imf::Rgba*>(base), 1, static_cast<size_t>(width));
    file.writePixels(height);
  }
  return stream.text();
}

std::string tiled_exr(int width, int height) {
  StringStream stream;
  {
    const std::vector<Imf::Rgba> pixels(static_cast<size_t>(width) * static_cast<size_t>(height), kPixel);
    Imf::TiledRgbaOutputFile file(stream, Imf::Header(width, height), Imf::WRITE_RGB, 16, 8, Imf::ONE_LEVEL);
    file.setFrameBuffer(pixels.data(), 1, static_cast<size_t>(width));
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  }
  return stream.text();
}

/// Inserts an attribute in front of all others of a file with a single block.
std::string with_attribute(std::string file, const std::string& name, const std::string& type, uint32_t bytes,
                           const std::string& value) {
  const std::string attribute = name + '\0' + type + '\0' + number(bytes, 4) + value;
  for (size_t at = 0; at + 8 <= file.size(); ++at) {
    uint64_t offset;
    std::memcpy(&offset, file.data() + at, 8);
    if (offset != at + 8) continue; // not the offset of the block
    offset += attribute.size();
    std::memcpy(file.data() + at, &offset, 8);
  }
  return file.substr(0, 8) + attribute + file.substr(8);
}

std::string replaced(std::string file, const std::string& attribute_and_type, size_t offset, const std::string& bytes) {
  const size_t at = file.find(attribute_and_type);
  EXPECT_NE(at, file.npos);
  return file.replace(at + attribute_and_type.size() + offset, bytes.size(), bytes);
}

TEST(ExrImage, EveryCompressionAndOrderIsRead) {
  for (int compression = 0; compression < Imf::NUM_COMPRESSION_METHODS; ++compression)
    for (const Imf::LineOrder order : {Imf::INCREASING_Y, Imf::DECREASING_Y}) {
      Imf::Header header(5, 300);
      header.compression() = static_cast<Imf::Compression>(compression);
      header.lineOrder() = order;
      expect_average(exr(header), {0.25f, 0.5f, 0.75f}, 1e-2f);
    }
}

TEST(ExrImage, TilesCropsAndLuminanceAreRead) {
  expect_average(tiled_exr(40, 30), {0.25f, 0.5f, 0.75f});
  const ImageSummary image = read(exr(Imf::Header(10, 10, Imath::Box2i({-3, 100}, {3, 104}))));
  EXPECT_EQ(image.width, 7u);
  EXPECT_EQ(image.height, 5u);
  expect_average(exr(Imf::Header(4, 4), Imf::WRITE_YC), {0.25f, 0.5f, 0.75f}, 2e-2f);
  expect_average(exr(Imf::Header(4, 4), Imf::WRITE_RGBA), {0.25f, 0.5f, 0.75f});
}

TEST(ExrImage, AttributesOfOtherProgramsAreSkipped) {
  Imf::Header header(4, 4);
  header.insert("text", Imf::StringAttribute("abc"));
  header.insert("texts", Imf::StringVectorAttribute({"a", "", "bcd"}));
  header.insert("numbers", Imf::FloatVectorAttribute({1.0f, 2.0f}));
  header.insert("place", Imf::V3fAttribute({1.0f, 2.0f, 3.0f}));
  header.insert("matrix", Imf::M44dAttribute());
  header.insert("key", Imf::KeyCodeAttribute());
  header.insert("time", Imf::TimeCodeAttribute());
  header.insert("rate", Imf::RationalAttribute());
  header.setPreviewImage(Imf::PreviewImage(3, 2));
  addChromaticities(header, Imf::Chromaticities());
  expect_average(exr(header), {0.25f, 0.5f, 0.75f});
}

TEST(ExrImage, SizesOfAttributesMustFitTheirTypes) {
  const std::string file = exr(Imf::Header(4, 4));
  EXPECT_EQ(complaint(with_attribute(file, "note", "string", 2, "ab")), "");
  EXPECT_EQ(complaint(with_attribute(file, "note", "ofAnotherKind", 3, "abc")), "");
  EXPECT_EQ(complaint(with_attribute(file, "note", "string", 0x6f646e69, "ab")),
            "damaged image: the file is truncated");
  EXPECT_EQ(complaint(with_attribute(file, "note", "ofAnotherKind", 0xffffffff, "")),
            "damaged image: the file is truncated");
  for (const auto& [type, bytes] : {std::tuple{"int", 3u},
                                    {"float", 5u},
                                    {"box2i", 8u},
                                    {"v2f", 4u},
                                    {"tiledesc", 8u},
                                    {"chromaticities", 16u},
                                    {"m44f", 1u},
                                    {"double", 0u}})
    EXPECT_EQ(complaint(with_attribute(file, "note", type, bytes, std::string(bytes, '\0'))),
              "damaged image: an attribute of type " + std::string(type) + " has " + std::to_string(bytes) + " bytes");
  EXPECT_EQ(complaint(with_attribute(file, "note", "stringvector", 6, "\xff\xff\xff\x7f__")),
            "damaged image: a string is larger than its attribute");
  // OpenEXR reads channels up to an empty name, here beyond the attribute.
  EXPECT_EQ(complaint(with_attribute(file, "note", "chlist", 18, "R\0\1\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0"s)),
            "damaged image: the file is truncated");
  EXPECT_EQ(complaint(with_attribute(file, "note", "chlist", 3, "\0ab"s)),
            "damaged image: its list of channels ends early");
  EXPECT_EQ(complaint(with_attribute(file, "note", "chlist", 1, "\0"s)), "");
  EXPECT_EQ(complaint(with_attribute(file, "note", "preview", 8, "\0\1\0\0\0\1\0\0"s)),
            "damaged image: its preview image has a wrong size");
  EXPECT_EQ(complaint(with_attribute(file, "dataWindow", "box2i", 16, std::string(16, '\0'))),
            "damaged image: its header has attribute dataWindow twice");
  EXPECT_EQ(complaint(replaced(file, "dataWindo", 0, "v")), "damaged image: its header has no attribute dataWindow");
}

TEST(ExrImage, ClaimsAreCheckedBeforeAnythingIsAllocated) {
  const std::string file = exr(Imf::Header(4, 4)), window = "dataWindow\0box2i\0"s;
  const auto corner = [&](uint32_t x, uint32_t y) {
    return complaint(replaced(file, window, 4 + 8, number(x, 4) + number(y, 4)));
  };
  EXPECT_EQ(corner(3, 3), "");
  EXPECT_EQ(corner(3, 1'000'000), "damaged image: the file is truncated"); // too short for the offset table
  const std::string blocks =
      "damaged image: its " + std::to_string(file.size()) + " bytes cannot hold the blocks it claims";
  EXPECT_EQ(corner(16'000'000, 3), blocks);
  EXPECT_EQ(corner(2'000'000, 3), blocks);
  EXPECT_EQ(corner(500'000, 3), "decoding its 500001 x 4 pixels needs 427 MiB of memory, of 64.0 MiB left; "
                                "--max-memory raises it");
  EXPECT_EQ(corner(static_cast<uint32_t>(-1), 3), "the image has no pixels");
  const std::string tiles = tiled_exr(40, 30);
  EXPECT_EQ(complaint(replaced(tiles, "tiles\0tiledesc\0"s, 4, "\0\0\0\x10\0\0\0\x10"s)),
            "damaged image: its " + std::to_string(tiles.size()) + " bytes cannot hold the blocks it claims");
  EXPECT_EQ(complaint(replaced(tiles, "tiles\0tiledesc\0"s, 4, "\0\0\0\0"s)),
            "damaged image: impossible size of tiles");
}

TEST(ExrImage, WindowsMayLieAnywhere) {
  for (const int at : {-1'000'000'000, 1'000'000'000})
    expect_average(exr(Imf::Header(4, 4, Imath::Box2i({at, -at}, {at + 3, -at + 3}))), {0.25f, 0.5f, 0.75f});
}

TEST(ExrImage, OtherKindsAreRefusedByName) {
  const std::string file = exr(Imf::Header(4, 4));
  const auto with_version = [&](const std::string& version) {
    return complaint(file.substr(0, 4) + version + file.substr(8));
  };
  EXPECT_EQ(with_version("\2\x10\0\0"s), "multi-part EXR files are not supported");
  EXPECT_EQ(with_version("\2\x08\0\0"s), "deep EXR files are not supported");
  EXPECT_EQ(with_version("\3\0\0\0"s), "unknown version of the EXR format");
}

TEST(ExrImage, DamageIsSurvived) {
  expect_robust(exr(Imf::Header(4, 4)));
  expect_robust(tiled_exr(20, 10));
}

} // namespace
} // namespace packtrace
