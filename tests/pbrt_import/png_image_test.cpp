#include <cstring>
#include <tuple>

#include <zlib.h>

#include "tests/pbrt_import/image_test_support.h"

namespace packtrace {
namespace {

using namespace std::string_literals;
using namespace image_test;

std::string chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
  return number(static_cast<uint32_t>(data.size()), 4, true) + checked + number(static_cast<uint32_t>(sum), 4, true);
}

std::string zlib_stream(const std::string& text) {
  uLongf size = compressBound(static_cast<uLong>(text.size()));
  std::string packed(size, '\0');
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(text.data()),
                     static_cast<uLong>(text.size())),
            Z_OK);
  packed.resize(size);
  return packed;
}

enum PngColour : uint32_t { kGrey = 0, kRgb = 2, kPalette = 3, kGreyAlpha = 4, kRgba = 6 };

std::string png_header(uint32_t width, uint32_t height, uint32_t bits, PngColour colour, uint32_t interlaced = 0) {
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", number(width, 4, true) + number(height, 4, true) + number(bits, 1) +
                                                 number(colour, 1) + "\0\0"s + number(interlaced, 1));
}

/// @param rows filter byte and samples of each row
std::string png(uint32_t width, uint32_t height, uint32_t bits, PngColour colour, const std::string& rows,
                uint32_t interlaced = 0) {
  std::string file = png_header(width, height, bits, colour, interlaced);
  if (colour == kPalette) file += chunk("PLTE", "\x00\x00\x00\xff\x80\x00"s);
  return file + chunk("IDAT", zlib_stream(rows)) + chunk("IEND", "");
}

TEST(PngImage, EveryKindOfColoursIsRead) {
  const Vec3 grey(0x40 / 255.0f), orange(1.0f, 0x80 / 255.0f, 0.0f);
  expect_average(png(1, 1, 8, kGrey, "\0\x40"s), grey);
  expect_average(png(1, 1, 8, kGreyAlpha, "\0\x40\x07"s), grey);
  expect_average(png(1, 1, 8, kRgb, "\0\xff\x80\0"s), orange);
  expect_average(png(1, 1, 8, kRgba, "\0\xff\x80\0\x07"s), orange);
  expect_average(png(1, 1, 8, kPalette, "\0\1"s), orange);
  expect_average(png(8, 1, 1, kGrey, "\0\xf0"s), Vec3(0.5f));
}

TEST(PngImage, SixteenBitsKeepTheirPrecision) {
  const float value = 0x1234 / 65535.0f;
  expect_average(png(1, 1, 16, kGrey, "\0\x12\x34"s), Vec3(value));
  expect_average(png(1, 1, 16, kGreyAlpha, "\0\x12\x34\0\7"s), Vec3(value));
  expect_average(png(1, 1, 16, kRgb, "\0\x12\x34\0\0\xff\xff"s), {value, 0.0f, 1.0f});
  expect_average(png(1, 1, 16, kRgba, "\0\x12\x34\0\0\xff\xff\0\7"s), {value, 0.0f, 1.0f});
}

TEST(PngImage, TransparentPixelsAreCounted) {
  EXPECT_EQ(transparent(png(2, 1, 8, kGreyAlpha, "\0\x40\x07\x40\xff"s)), 1u);
  EXPECT_EQ(transparent(png(2, 1, 8, kRgba, "\0\xff\x80\0\x07\xff\x80\0\xff"s)), 1u);
  EXPECT_EQ(transparent(png(1, 1, 16, kRgba, "\0\x12\x34\0\0\xff\xff\0\7"s)), 1u);
  EXPECT_EQ(transparent(png(1, 1, 8, kRgb, "\0\xff\x80\0"s)), 0u);
  const std::string entry = chunk("tRNS", "\xff\x20"s), palette = png(3, 1, 8, kPalette, "\0\0\1\1"s);
  EXPECT_EQ(transparent(palette), 0u);
  EXPECT_EQ(transparent(std::string(palette).insert(palette.find("IDAT") - 4, entry)), 2u);
  const std::string damaged = png(3, 1, 8, kPalette, "\0\xff\1\1"s); // an index that the palette lacks is opaque
  EXPECT_EQ(transparent(std::string(damaged).insert(damaged.find("IDAT") - 4, entry)), 2u);
}

TEST(PngImage, InterlacedPassesAreCountedRight) {
  for (uint32_t side = 1; side <= 9; ++side) {
    std::string rows;
    const uint32_t passes[7][4] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                   {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
    for (const auto& [x0, y0, dx, dy] : passes)
      for (uint32_t y = y0; y < side && x0 < side; y += dy)
        rows += '\0' + std::string((side - x0 + dx - 1) / dx, '\x40');
    expect_average(png(side, side, 8, kGrey, rows, 1), Vec3(0x40 / 255.0f));
  }
}

TEST(PngImage, DataMayComeInSeveralChunks) {
  const std::string data = zlib_stream("\0\x40\x80"s);
  const std::string file = png_header(2, 1, 8, kGrey) + chunk("IDAT", data.substr(0, 3)) + chunk("IDAT", "") +
                           chunk("IDAT", data.substr(3)) + chunk("IEND", "");
  expect_average(file, Vec3(0x60 / 255.0f));
}

TEST(PngImage, ChunksThatLieAreRefused) {
  const std::string header = png_header(1, 1, 8, kGrey), data = chunk("IDAT", zlib_stream("\0\x40"s)),
                    end = chunk("IEND", "");
  EXPECT_EQ(complaint(header + data + end), "");
  EXPECT_EQ(complaint(header + "\x70\0\0\0IDAT"s + data + end), "damaged image: the file is truncated");
  EXPECT_EQ(complaint(header + chunk("IDAT", "") + data + end), "damaged image: an image data chunk is empty");
  EXPECT_EQ(complaint(header + end), "damaged image: it has no image data");
  EXPECT_EQ(complaint(header + data), "damaged image: the file is truncated");
  EXPECT_EQ(complaint(header + header.substr(8) + data + end),
            "damaged image: the header chunk is not where it belongs");
  EXPECT_EQ(complaint(header.substr(0, 8) + data + end), "damaged image: the header chunk is not where it belongs");
  EXPECT_EQ(complaint(png(1, 1, 3, kGrey, "\0\x40"s)), "damaged image: impossible number of bits per sample");
  EXPECT_EQ(complaint(png(1, 1, 8, PngColour{5}, "\0\x40"s)), "damaged image: unknown kind of colours");
  EXPECT_EQ(complaint(png(30000, 30000, 8, kGrey, "\0\x40"s)), "damaged image: too little data for its size");
  EXPECT_EQ(complaint(png(0, 1, 8, kGrey, "\0\x40"s)), "damaged image: it has no pixels");
}

TEST(PngImage, DataThatUnpackWithoutEndAreRefused) {
  EXPECT_EQ(complaint(png(4, 4, 8, kGrey, std::string(80 << 20, '\0'))), "damaged image: too much data for its size");
  // Some excess data is accepted.
  EXPECT_EQ(complaint(png(4, 4, 8, kGrey, std::string(1 << 20, '\0'))), "");
}

TEST(PngImage, WrongChecksumsAreReported) {
  std::string file = png(2, 1, 8, kGrey, "\0\x40\x80"s);
  EXPECT_EQ(problems(file), Problems{});
  file[file.size() - 1] ^= 1;
  EXPECT_EQ(problems(file), Problems{"a chunk has a wrong checksum; the image may be damaged"});
  expect_average(file, Vec3(0x60 / 255.0f));
  file[8 + 8 + 13] ^= 1; // in the checksum of the header
  EXPECT_EQ(problems(file), Problems{"2 chunks have wrong checksums; the image may be damaged"});
}

TEST(PngImage, ColoursBeyondThePaletteAreBlackAndReported) {
  const Vec3 half_orange(0.5f, 0x40 / 255.0f, 0.0f);
  for (const int bits : {2, 4, 8}) {
    // Colours 1 and 3 of a palette of two.
    const std::string pixels = bits == 2 ? "\0\x70"s : bits == 4 ? "\0\x13"s : "\0\1\3"s;
    EXPECT_EQ(problems(png(2, 1, bits, kPalette, pixels)),
              Problems{"1 pixel has a colour that the palette lacks; it counts as black"});
    expect_average(png(2, 1, bits, kPalette, pixels), half_orange);
  }
  EXPECT_EQ(problems(png(3, 1, 8, kPalette, "\0\1\2\xff"s)),
            Problems{"2 pixels have colours that the palette lacks; they count as black"});
}

TEST(PngImage, PalettesOfEveryDepthAreRead) {
  for (const int bits : {1, 2, 4, 8}) // two pixels with colours 0 and 1
    expect_average(png(2, 1, bits, kPalette,
                       '\0' + (bits == 8 ? "\0\1"s : std::string(1, static_cast<char>(1 << (8 - 2 * bits))))),
                   {0.5f, 0x40 / 255.0f, 0.0f});
  const std::string header = png_header(1, 1, 8, kPalette), data = chunk("IDAT", zlib_stream("\0\0"s)),
                    end = chunk("IEND", "");
  EXPECT_EQ(complaint(header + data + end), "damaged image: no palette before the image data");
  EXPECT_EQ(complaint(header + chunk("PLTE", "\1\2") + data + end), "damaged image: wrong palette size");
  expect_average(header + chunk("PLTE", "\xff\xff\xff") + chunk("tRNS", "\0"s) + data + end, Vec3(1.0f));
}

TEST(PngImage, DamageIsSurvived) {
  expect_robust(png(3, 2, 8, kRgb, std::string(20, '\2')));
  expect_robust(png(9, 9, 16, kRgba, std::string(1000, '\1'), 1));
  expect_robust(png(5, 2, 8, kPalette, std::string("\0\1\0\1\0\1\0\1\0\1\0\1"s)));
}

} // namespace
} // namespace packtrace
