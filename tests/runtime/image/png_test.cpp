#include "runtime/image/png.h"

#include <cmath>
#include <limits>
#include <string_view>

#include <gtest/gtest.h>

#include "pbrt_import/base/file_bytes.h"
#include "tests/runtime/image/image_test_support.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using Bytes = std::vector<std::byte>;

void append_be32(Bytes& bytes, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::byte>(value >> shift));
}

/// CRC-32 computed bit by bit from its definition, so that it shares no code with the code under test.
uint32_t crc(const Bytes& bytes, size_t begin) {
  uint32_t remainder = ~0u;
  for (size_t i = begin; i < bytes.size(); ++i)
    for (uint32_t bit = 0; bit < 8; ++bit) {
      const uint32_t in = (std::to_integer<uint32_t>(bytes[i]) >> bit) & 1u;
      remainder = (remainder >> 1) ^ (((remainder ^ in) & 1u) != 0 ? 0xedb88320u : 0u);
    }
  return ~remainder;
}

void append_chunk(Bytes& file, std::string_view type, const Bytes& data) {
  append_be32(file, static_cast<uint32_t>(data.size()));
  const size_t begin = file.size();
  for (const char c : type) file.push_back(static_cast<std::byte>(c));
  file.insert(file.end(), data.begin(), data.end());
  append_be32(file, crc(file, begin));
}

Bytes bytes_of(std::initializer_list<int> values) {
  Bytes bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

struct PngParts {
  uint32_t width = 1, height = 1;
  int bits = 8, color_type = 0;
  Bytes palette;
  Bytes rows; ///< filter byte and samples per row; stored without compression
  bool end = true;
};

Bytes make_png(const PngParts& parts) {
  Bytes file = bytes_of({0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'});
  Bytes header;
  append_be32(header, parts.width);
  append_be32(header, parts.height);
  for (const int value : {parts.bits, parts.color_type, 0, 0, 0}) header.push_back(static_cast<std::byte>(value));
  append_chunk(file, "IHDR", header);
  if (!parts.palette.empty()) append_chunk(file, "PLTE", parts.palette);
  const auto length = static_cast<int>(parts.rows.size());
  Bytes data = bytes_of({0x78, 0x01, 0x01, length & 0xff, length >> 8, ~length & 0xff, (~length >> 8) & 0xff});
  data.insert(data.end(), parts.rows.begin(), parts.rows.end());
  uint32_t a = 1, b = 0;
  for (const std::byte byte : parts.rows) a = (a + std::to_integer<uint32_t>(byte)) % 65521, b = (b + a) % 65521;
  append_be32(data, b << 16 | a);
  append_chunk(file, "IDAT", data);
  if (parts.end) append_chunk(file, "IEND", {});
  return file;
}

TEST(Png, RawBytesRoundTripExactlyForEveryChannelCount) {
  for (uint32_t channels = 1; channels <= 4; ++channels) {
    Image image({16, 16}, channels);
    for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i % 256) / 255.0f;
    const Image read = decode_png(encode_png(image, PngTransfer::kRaw), "memory", PngTransfer::kRaw);
    EXPECT_EQ(read.size, image.size);
    EXPECT_EQ(read.channels, channels);
    EXPECT_EQ(read.data, image.data);
  }
}

TEST(Png, LinearColoursSurviveTheTransferWithinHalfAStep) {
  Image image({256, 1}, 3);
  Noise noise(7);
  for (float& value : image.data) value = noise();
  const Image read = decode_png(encode_png(image, PngTransfer::kSrgb), "memory", PngTransfer::kSrgb);
  for (size_t i = 0; i < image.data.size(); ++i)
    EXPECT_LE(std::abs(srgb_from_linear(read.data[i]) - srgb_from_linear(image.data[i])), 0.5f / 255.0f + 1e-5f);
}

TEST(Png, StoresKnownSrgbCodes) {
  Image image({3, 1}, 1);
  image.data = {0.0f, 0.2140411f, 1.0f}; // the middle value encodes to 127.5 / 255 in sRGB
  const Image read = decode_png(encode_png(image, PngTransfer::kSrgb), "memory", PngTransfer::kRaw);
  EXPECT_EQ(read.data[0], 0.0f);
  EXPECT_NEAR(read.data[1], 127.5f / 255.0f, 0.51f / 255.0f);
  EXPECT_EQ(read.data[2], 1.0f);
}

TEST(Png, AlphaHasNoTransfer) {
  Image image({1, 1}, 4);
  image.data = {1.0f, 1.0f, 1.0f, 0.2f};
  const Bytes file = encode_png(image, PngTransfer::kSrgb);
  EXPECT_FLOAT_EQ(decode_png(file, "memory", PngTransfer::kRaw).data[3], 51.0f / 255.0f);
  EXPECT_FLOAT_EQ(decode_png(file, "memory", PngTransfer::kSrgb).data[3], 51.0f / 255.0f);
}

TEST(Png, ValuesOutsideTheRangeAreClampedAndNanIsBlack) {
  Image image({4, 1}, 1);
  image.data = {-1.0f, 2.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()};
  for (const PngTransfer transfer : {PngTransfer::kRaw, PngTransfer::kSrgb})
    EXPECT_EQ(decode_png(encode_png(image, transfer), "memory", transfer).data, (std::vector<float>{0, 1, 0, 1}));
}

TEST(Png, SixteenBitSamplesKeepTheirPrecision) {
  const Bytes file = make_png({2, 1, 16, 0, {}, bytes_of({0, 0x12, 0x34, 0xff, 0xff})});
  const Image image = decode_png(file, "memory", PngTransfer::kRaw);
  EXPECT_FLOAT_EQ(image.data[0], 4660.0f / 65535.0f);
  EXPECT_EQ(image.data[1], 1.0f);
  EXPECT_FLOAT_EQ(decode_png(file, "memory").data[0], linear_from_srgb(4660.0f / 65535.0f));
}

TEST(Png, PaletteBecomesColours) {
  const Bytes file = make_png({2, 1, 1, 3, bytes_of({255, 0, 0, 0, 0, 255}), bytes_of({0, 0x40})});
  const Image image = decode_png(file, "memory", PngTransfer::kRaw);
  EXPECT_EQ(image.channels, 3u);
  EXPECT_EQ(image.data, (std::vector<float>{1, 0, 0, 0, 0, 1}));
}

TEST(Png, EveryTruncatedPrefixIsRejected) {
  const Bytes file = encode_png(noise_image({5, 4}, 3, 1), PngTransfer::kSrgb);
  for (size_t length = 0; length < file.size(); ++length)
    EXPECT_EQ(error_kind_of([&] { decode_png(std::span(file).first(length), "cut"); }), ErrorKind::kInput) << length;
}

TEST(Png, EveryFlippedBitIsNoticed) {
  const Bytes file = encode_png(noise_image({5, 4}, 3, 2), PngTransfer::kSrgb);
  for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
    Bytes altered = file;
    altered[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
    EXPECT_EQ(error_kind_of([&] { decode_png(altered, "altered"); }), ErrorKind::kInput) << bit;
  }
}

TEST(Png, ClaimsOfHugeSizesFailBeforeAllocating) {
  for (const auto& [width, height] :
       {std::pair{65536u, 65536u}, {16000u, 16000u}, {0x7fffffffu, 1u}, {0u, 1u}, {1u, 0u}}) {
    PngParts parts{width, height, 8, 2, {}, bytes_of({0, 1, 2, 3})};
    EXPECT_EQ(error_kind_of([&] { decode_png(make_png(parts), "huge"); }), ErrorKind::kInput) << width;
  }
}

TEST(Png, WrongCombinationsAreRejected) {
  const Bytes row = bytes_of({0, 1, 2, 3});
  for (const PngParts& parts :
       {PngParts{1, 1, 3, 2, {}, row}, PngParts{1, 1, 8, 5, {}, row}, PngParts{1, 1, 8, 3, {}, row},
        PngParts{4, 4, 8, 2, {}, row}, PngParts{1, 1, 8, 2, {}, row, false}})
    EXPECT_EQ(error_kind_of([&] { decode_png(make_png(parts), "wrong"); }), ErrorKind::kInput);
}

TEST(Png, ImagesThatDoNotFitTheFormatAreUsageErrors) {
  EXPECT_EQ(error_kind_of([] { encode_png(Image({0, 4}, 3), PngTransfer::kRaw); }), ErrorKind::kUsage);
  EXPECT_EQ(error_kind_of([] { encode_png(Image({4, 4}, 5), PngTransfer::kRaw); }), ErrorKind::kUsage);
}

TEST(Png, FilesRoundTripAndMissingOnesAreInputErrors) {
  const TemporaryFolder folder;
  const Image image = noise_image({9, 7}, 1, 3);
  write_png(folder / "a.png", image, PngTransfer::kRaw);
  EXPECT_EQ(read_png(folder / "a.png", PngTransfer::kRaw).data,
            decode_png(encode_png(image, PngTransfer::kRaw), "memory", PngTransfer::kRaw).data);
  EXPECT_EQ(error_kind_of([&] { read_png(folder / "missing.png"); }), ErrorKind::kInput);
  EXPECT_EQ(error_kind_of([&] { read_png(folder.path()); }), ErrorKind::kInput);
  EXPECT_EQ(error_kind_of([&] { write_png(folder / "no" / "folder.png", image, PngTransfer::kRaw); }), ErrorKind::kIo);
}

TEST(FileBytes, AFullDiskIsNoticed) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  EXPECT_EQ(error_kind_of([] { write_file_bytes("/dev/full", Bytes(10)); }), ErrorKind::kIo);
}

} // namespace
} // namespace packtrace
