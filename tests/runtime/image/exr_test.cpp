#include "runtime/image/exr.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include "pbrt_import/base/file_bytes.h"
#include "runtime/image/read_image.h"
#include "tests/runtime/image/image_test_support.h"
#include "tests/sanitized.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using Bytes = std::vector<std::byte>;
constexpr ImageSize kSize{7, 5};

/// A frame with all kinds of layers that the renderer writes.
struct Frame {
  Image ao = noise_image(kSize, 1, 1), normal = noise_image(kSize, 3, 2), color = noise_image(kSize, 3, 3);
  std::vector<uint32_t> instance = std::vector<uint32_t>(kSize.pixels(), 0xfffffff1u);

  Frame() { ao.data[3] = kInvalidAo; }
  Bytes encode(const ExrAttributes& attributes = {}) const {
    const std::array layers{Layer{"ao", {""}, std::span<const float>(ao.data), true},
                            Layer{"normal", {"X", "Y", "Z"}, std::span<const float>(normal.data)},
                            Layer{"", {"R", "G", "B"}, std::span<const float>(color.data), true},
                            Layer{"instance", {""}, std::span<const uint32_t>(instance)}};
    return encode_exr(kSize, layers, attributes);
  }
};

size_t find(const Bytes& bytes, std::string_view text) {
  const auto* begin = reinterpret_cast<const char*>(bytes.data());
  return std::string_view(begin, bytes.size()).find(text);
}

/// Decodes all layers of a possibly damaged file. Only exceptions of type Error are accepted.
void decode_all(std::span<const std::byte> bytes) {
  try {
    for (const ExrLayer& layer : exr_info(bytes, "memory").layers) decode_exr(bytes, "memory", layer.name);
  } catch (const Error&) {
  }
}

TEST(Exr, FloatsRoundTripExactlyAndHalvesWithinTheirPrecision) {
  const Frame frame;
  const Bytes file = frame.encode();
  const Image normal = decode_exr(file, "memory", "normal");
  EXPECT_EQ(normal.size, kSize);
  EXPECT_EQ(normal.channels, 3u);
  EXPECT_EQ(normal.data, frame.normal.data);
  const Image color = decode_exr(file, "memory", "");
  EXPECT_EQ(color.channels, 1u) << "ao comes first where no layer is named";
  EXPECT_EQ(color.data[3], kInvalidAo);
  for (size_t i = 0; i < color.data.size(); ++i)
    EXPECT_NEAR(color.data[i], frame.ao.data[i], std::abs(frame.ao.data[i]) * 0x1p-11f);
}

TEST(Exr, IntegersRoundTripExactly) {
  const Frame frame;
  EXPECT_EQ(decode_exr_uint(frame.encode(), "memory", "instance"), frame.instance);
  EXPECT_EQ(error_kind_of([&] { decode_exr_uint(frame.encode(), "memory", "ao"); }), ErrorKind::kInput);
}

TEST(Exr, ChannelsComeInColourOrder) {
  const Frame frame;
  const std::array layers{Layer{"", {"R", "G", "B"}, std::span<const float>(frame.color.data)}};
  EXPECT_EQ(decode_exr(encode_exr(kSize, layers), "memory").data, frame.color.data);
  const ExrInfo info = exr_info(frame.encode(), "memory");
  ASSERT_EQ(info.layers.size(), 4u);
  const ExrLayer& colors =
      *std::find_if(info.layers.begin(), info.layers.end(), [](auto& l) { return l.name.empty(); });
  ASSERT_EQ(colors.channels.size(), 3u);
  EXPECT_EQ(colors.channels[0].name + colors.channels[1].name + colors.channels[2].name, "RGB");
  EXPECT_EQ(colors.channels[0].type, ExrType::kHalf);
}

TEST(Exr, AttributesRoundTrip) {
  const ExrAttributes attributes{
      {"packtrace:spp", 16}, {"packtrace:radius", 0.1}, {"packtrace:scene", std::string("a b")}};
  const ExrInfo info = exr_info(Frame().encode(attributes), "memory");
  for (const auto& [name, value] : attributes) EXPECT_EQ(info.attributes.at(name), value) << name;
}

TEST(Exr, BytesAreTheSameEveryTime) { EXPECT_EQ(Frame().encode({{"a", 1}}), Frame().encode({{"a", 1}})); }

TEST(Exr, MisusesAreUsageErrors) {
  const Frame frame;
  const auto encode = [](ImageSize size, std::vector<Layer> layers, ExrAttributes attributes = {}) {
    return error_kind_of([&] { encode_exr(size, layers, attributes); });
  };
  const Layer ao{"ao", {""}, std::span<const float>(frame.ao.data)};
  EXPECT_EQ(encode(kSize, {}), ErrorKind::kUsage);
  EXPECT_EQ(encode(kSize, {ao, ao}), ErrorKind::kUsage) << "channel used twice";
  EXPECT_EQ(encode({8, 5}, {ao}), ErrorKind::kUsage) << "wrong sample count";
  EXPECT_EQ(encode({0, 0}, {Layer{"ao", {""}, std::span<const float>()}}), ErrorKind::kUsage);
  EXPECT_EQ(encode(kSize, {Layer{"", {""}, std::span<const float>(frame.ao.data)}}), ErrorKind::kUsage);
  EXPECT_EQ(encode(kSize, {ao}, {{"dataWindow", 1}}), ErrorKind::kUsage);
  EXPECT_EQ(encode(kSize, {ao}, {{"channels", 1}}), ErrorKind::kUsage);
}

TEST(Exr, UnclearAndMissingLayersAreInputErrors) {
  const Frame frame;
  EXPECT_EQ(error_kind_of([&] { decode_exr(frame.encode(), "memory", "depth"); }), ErrorKind::kInput);
  const std::array two{Layer{"normal", {"X", "Y", "Z"}, std::span<const float>(frame.normal.data)},
                       Layer{"depth", {""}, std::span<const float>(frame.ao.data)}};
  EXPECT_EQ(error_kind_of([&] { decode_exr(encode_exr(kSize, two), "memory"); }), ErrorKind::kInput);
  EXPECT_EQ(decode_exr(encode_exr(kSize, std::span(two).first(1)), "memory").data, frame.normal.data);
}

TEST(Exr, EveryTruncatedPrefixIsRejected) {
  const Bytes file = Frame().encode();
  for (size_t length = 0; length < file.size(); ++length)
    EXPECT_EQ(error_kind_of([&] { decode_exr(std::span(file).first(length), "cut", "normal"); }), ErrorKind::kInput)
        << length << " of " << file.size();
}

TEST(Exr, FlippedBitsGiveErrorsOrImagesButNothingElse) {
  const Bytes file = Frame().encode({{"a", std::string("b")}});
  size_t rejected = 0;
  const size_t step = test::sanitized() ? 3 : 1; // every byte, and each of its bits in some
  for (size_t bit = 0; bit < 8 * file.size(); bit += step) {
    Bytes altered = file;
    altered[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
    decode_all(altered);
    try {
      exr_info(altered, "altered");
    } catch (const Error&) {
      ++rejected;
    }
  }
  EXPECT_GT(rejected, 100u / step);
}

TEST(Exr, ClaimsOfHugeSizesFailBeforeAllocating) {
  Bytes file = Frame().encode();
  const size_t window = find(file, "dataWindow") + sizeof("dataWindow") + sizeof("box2i") + sizeof(int32_t);
  for (const int32_t side : {100000, 60000, 0x7fffffff, -1}) {
    std::memcpy(file.data() + window + 8, &side, 4);
    std::memcpy(file.data() + window + 12, &side, 4);
    EXPECT_EQ(error_kind_of([&] { decode_exr(file, "huge", "ao"); }), ErrorKind::kInput) << side;
  }
}

TEST(Exr, LengthsInsideTheHeaderCannotExceedTheFile) {
  Bytes file = Frame().encode({{"text", std::string("abcd")}});
  const size_t length = find(file, "string") + sizeof("string");
  for (const uint32_t value : {0x7fffffffu, 0xffffffffu}) {
    std::memcpy(file.data() + length, &value, 4);
    EXPECT_EQ(error_kind_of([&] { exr_info(file, "long"); }), ErrorKind::kInput);
  }
  // The same for an attribute with a list of strings, where each element has its own length.
  const std::array<unsigned char, 29> list{'l', 0, 's', 't', 'r',  'i',  'n',  'g',  'v', 'e', 'c', 't', 'o', 'r', 0,
                                           8,   0, 0,   0,   0xf0, 0xff, 0xff, 0x7f, 'a', 'b', 'c', 'd', 0,   0};
  Bytes with_list = Frame().encode();
  with_list.insert(with_list.begin() + 8, reinterpret_cast<const std::byte*>(list.data()),
                   reinterpret_cast<const std::byte*>(list.data()) + 27);
  try {
    exr_info(with_list, "list");
    FAIL() << "the wrong string length was accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("string is larger"), std::string::npos) << error.what();
  }
}

TEST(Exr, FilesOfOtherProgramsAreRead) {
  const TemporaryFolder folder;
  const Image image = noise_image({40, 30}, 1, 5);
  Imf::Header header(40, 30);
  // A cropped image, whose data window does not start at the origin.
  header.dataWindow() = Imath::Box2i({-10, 100}, {29, 129});
  header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
  header.compression() = Imf::PIZ_COMPRESSION;
  header.setTileDescription(Imf::TileDescription(16, 16, Imf::ONE_LEVEL));
  Imf::FrameBuffer frame;
  auto* samples = reinterpret_cast<char*>(const_cast<float*>(image.data.data()));
  frame.insert("Y", Imf::Slice::Make(Imf::FLOAT, samples, header.dataWindow(), 4, 160));
  {
    Imf::TiledOutputFile file((folder / "tiled.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  }
  EXPECT_EQ(read_exr(folder / "tiled.exr").data, image.data);
  EXPECT_EQ(read_image(folder / "tiled.exr").image.data, image.data);
  const Bytes tiled = read_file_bytes(folder / "tiled.exr");
  for (size_t length = 0; length < tiled.size(); length += 7)
    EXPECT_EQ(error_kind_of([&] { decode_exr(std::span(tiled).first(length), "cut"); }), ErrorKind::kInput) << length;
  for (size_t byte = 0; byte < 600 && byte < tiled.size(); ++byte) {
    Bytes altered = tiled;
    altered[byte] ^= std::byte{0x81};
    decode_all(altered);
  }
}

TEST(Exr, KindsThatCannotBeReadAreUnsupported) {
  const TemporaryFolder folder;
  std::vector<Imf::Header> headers(2, Imf::Header(4, 4));
  for (size_t i = 0; i < 2; ++i) {
    headers[i].setName(i == 0 ? "a" : "b");
    headers[i].setType(Imf::SCANLINEIMAGE);
    headers[i].channels().insert("Y", Imf::Channel(Imf::HALF));
  }
  {
    const Imf::MultiPartOutputFile file((folder / "multi.exr").c_str(), headers.data(), 2);
  }
  EXPECT_EQ(error_kind_of([&] { read_exr(folder / "multi.exr"); }), ErrorKind::kUnsupported);

  Imf::Header header(4, 4);
  header.channels().insert("Y", Imf::Channel(Imf::HALF, 2, 2));
  std::array<unsigned char, 64> samples{};
  Imf::FrameBuffer frame;
  frame.insert("Y", Imf::Slice(Imf::HALF, reinterpret_cast<char*>(samples.data()), 2, 8, 2, 2));
  {
    Imf::OutputFile file((folder / "subsampled.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(4);
  }
  EXPECT_EQ(error_kind_of([&] { read_exr(folder / "subsampled.exr"); }), ErrorKind::kUnsupported);
}

TEST(ReadImage, GoesByContentNotByName) {
  const TemporaryFolder folder;
  const Frame frame;
  write_file_bytes(folder / "exr.png", frame.encode());
  const LoadedImage loaded = read_image(folder / "exr.png", "normal");
  EXPECT_EQ(loaded.layer, "normal");
  EXPECT_EQ(loaded.image.data, frame.normal.data);
  write_file_bytes(folder / "text.exr", Bytes(100, std::byte{'a'}));
  EXPECT_EQ(error_kind_of([&] { read_image(folder / "text.exr"); }), ErrorKind::kInput);
  write_file_bytes(folder / "empty.exr", {});
  EXPECT_EQ(error_kind_of([&] { read_image(folder / "empty.exr"); }), ErrorKind::kInput);
}

} // namespace
} // namespace packtrace
