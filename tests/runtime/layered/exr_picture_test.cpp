// Copies of EXR files with changed channels.

#include "runtime/image/exr_picture.h"

#include <array>
#include <bit>

#include <gtest/gtest.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include "pbrt_import/base/file_bytes.h"
#include "tests/runtime/image/image_test_support.h"
#include "tests/runtime/layered/foreign_pictures.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using Bytes = std::vector<std::byte>;
constexpr ImageSize kCopySize{20, 12};

/// A picture as stored with a compression.
Bytes stored(Imf::Compression compression, const std::vector<std::string>& halves = {}) {
  const TemporaryFolder folder;
  foreign::write(folder / "a.exr", kCopySize, foreign::wall(kCopySize, 1), halves, compression);
  return read_file_bytes(folder / "a.exr");
}

TEST(ExrPicture, CopiesHaveTheSameSamplesFromEveryLosslessCompression) {
  const foreign::Channels wall = foreign::wall(kCopySize, 1);
  for (const Imf::Compression compression :
       {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION}) {
    const ExrPicture picture(stored(compression, {"depth"}), "a");
    const ExrPicture copy(picture.encode({}), "copy");
    EXPECT_EQ(copy.size(), kCopySize);
    for (const auto& [channel, values] : wall) {
      EXPECT_EQ(copy.floats(channel), values) << channel;
      EXPECT_EQ(copy.type(channel), channel == "depth" ? ExrType::kHalf : ExrType::kFloat);
    }
  }
}

TEST(ExrPicture, LossyCompressionsAreRead) {
  for (const Imf::Compression compression : {Imf::PXR24_COMPRESSION, Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
    const std::vector<float> depth = ExrPicture(stored(compression), "a").floats("depth");
    for (const float z : depth) ASSERT_NEAR(z, 10.0f, 0.01f) << compression;
  }
}

TEST(ExrPicture, LayersReplaceChannelsAndAreAdded) {
  const ExrPicture picture(stored(Imf::ZIP_COMPRESSION), "a");
  const std::vector<float> ao(kCopySize.pixels(), 0.25f), x(kCopySize.pixels() * 2, 3.0f);
  const std::array layers{Layer{"ao", {""}, std::span<const float>(ao), true},
                          Layer{"extra", {"X", "Y"}, std::span<const float>(x)}};
  const ExrPicture copy(picture.encode(layers), "copy");
  EXPECT_EQ(copy.floats("ao"), ao);
  EXPECT_EQ(copy.type("ao"), ExrType::kHalf);
  EXPECT_EQ(copy.floats("extra.Y"), std::vector<float>(kCopySize.pixels(), 3.0f));
  EXPECT_EQ(copy.floats("depth"), picture.floats("depth"));
}

TEST(ExrPicture, WindowsAndAttributesAreKeptAndTilesBecomeLines) {
  const TemporaryFolder folder;
  const Image image = noise_image({40, 30}, 1, 5);
  Imf::Header header(64, 48);
  header.dataWindow() = Imath::Box2i({-10, 8}, {29, 37});
  header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
  header.setTileDescription(Imf::TileDescription(16, 16, Imf::ONE_LEVEL));
  header.pixelAspectRatio() = 1.5f;
  Imf::addOwner(header, "somebody");
  Imf::FrameBuffer frame;
  frame.insert("Y", Imf::Slice::Make(Imf::FLOAT, image.data.data(), header.dataWindow(), 4, 160));
  {
    Imf::TiledOutputFile file((folder / "tiled.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  }
  const ExrPicture picture(read_file_bytes(folder / "tiled.exr"), "tiled");
  EXPECT_EQ(picture.floats("Y"), image.data);
  write_file_bytes(folder / "copy.exr", picture.encode({}));
  EXPECT_EQ(decode_exr(read_file_bytes(folder / "copy.exr"), "copy").data, image.data);
  const Imf::InputFile copy((folder / "copy.exr").c_str());
  EXPECT_EQ(copy.header().dataWindow(), header.dataWindow());
  EXPECT_EQ(copy.header().displayWindow(), header.displayWindow());
  EXPECT_EQ(copy.header().pixelAspectRatio(), 1.5f);
  EXPECT_EQ(Imf::owner(copy.header()), "somebody");
  EXPECT_FALSE(copy.header().hasTileDescription());
}

TEST(ExrPicture, WordsAreIntegersOrTheBitsOfFloats) {
  const std::vector<uint32_t> ids(kCopySize.pixels(), 0xfffffff1u);
  const std::vector<float> hashes(kCopySize.pixels(), 0.75f);
  const std::array layers{Layer{"a", {""}, std::span<const uint32_t>(ids)},
                          Layer{"b", {""}, std::span<const float>(hashes)},
                          Layer{"c", {""}, std::span<const float>(hashes), true}};
  const ExrPicture picture(encode_exr(kCopySize, layers), "ids");
  EXPECT_EQ(picture.words("a"), ids);
  EXPECT_EQ(picture.words("b").front(), std::bit_cast<uint32_t>(0.75f));
  EXPECT_EQ(picture.words("c"), picture.words("b"));
}

TEST(ExrPicture, OnlyTheWantedChannelsAreDecoded) {
  const std::array<std::string, 1> wanted{"depth"};
  const ExrPicture picture(stored(Imf::ZIP_COMPRESSION), "a", wanted);
  EXPECT_TRUE(picture.type("depth"));
  EXPECT_FALSE(picture.type("ao"));
  const std::array<std::string, 1> missing{"nothing"};
  EXPECT_EQ(error_kind_of([&] { ExrPicture(stored(Imf::ZIP_COMPRESSION), "a", missing); }), ErrorKind::kInput);
}

TEST(ExrPicture, TruncatedAndAlteredFilesGiveErrorsOrPictures) {
  const Bytes file = stored(Imf::ZIP_COMPRESSION);
  for (size_t length = 0; length < file.size(); length += 3)
    EXPECT_EQ(error_kind_of([&] { ExrPicture(std::span(file).first(length), "cut"); }), ErrorKind::kInput) << length;
  for (size_t byte = 0; byte < file.size(); ++byte) {
    Bytes altered = file;
    altered[byte] ^= std::byte{0x81};
    try {
      const ExrPicture picture(altered, "altered");
      const ExrPicture copy(picture.encode({}), "copy");
      EXPECT_EQ(copy.size(), picture.size());
    } catch (const Error&) {
    }
  }
}

} // namespace
} // namespace packtrace
