#include "pbrt_import/files/image_file.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
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
#include <zlib.h>

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/exr_stream.h"

namespace packtrace {
namespace {

using namespace std::string_literals;

constexpr uint64_t kBudget = 64u << 20;

ImageSummary read(const std::string& file, bool want_mask = false) {
  return read_image(std::as_bytes(std::span(file)), false, want_mask, kBudget);
}

/// Message of the Error that reading a file throws; "" if there is none.
std::string complaint(const std::string& file) {
  try {
    (void)read(file, true);
    return "";
  } catch (const Error& error) {
    EXPECT_TRUE(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kLimitExceeded) << error.what();
    return error.what();
  }
}

void expect_average(const std::string& file, Vec3 average, float tolerance = 1e-6f) {
  const ImageSummary image = read(file);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.average[c], average[c], tolerance) << c;
}

/// Every proper prefix must be rejected; files with a flipped byte must be read or rejected.
void expect_robust(const std::string& file) {
  for (size_t size = 0; size < file.size(); ++size) EXPECT_NE(complaint(file.substr(0, size)), "") << size;
  for (const int flip : {0x01, 0x80, 0xff})
    for (size_t i = 0; i < file.size(); ++i) {
      std::string altered = file;
      altered[i] = static_cast<char>(altered[i] ^ flip);
      (void)complaint(altered);
    }
}

std::string number(uint32_t value, int bytes, bool big_endian = false) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> 8 * (big_endian ? bytes - 1 - i : i));
  return text;
}

// PNG

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

/// Problems of a file that is read in spite of damage.
std::vector<std::string> problems(const std::string& file) { return read(file, true).problems; }
using Problems = std::vector<std::string>;

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

// TGA

std::string tga(char type, uint32_t width, uint32_t height, char bits, const std::string& data,
                const std::string& palette = "") {
  const std::string map =
      palette.empty() ? std::string(5, '\0') : "\0\0"s + number(static_cast<uint32_t>(palette.size() / 3), 2) + '\x18';
  return '\0' + std::string(1, palette.empty() ? '\0' : '\1') + type + map + "\0\0\0\0"s + number(width, 2) +
         number(height, 2) + bits + '\x20' + palette + data;
}

TEST(TgaImage, EveryKindIsRead) {
  const Vec3 colour(0x30 / 255.0f, 0x20 / 255.0f, 0x10 / 255.0f);
  expect_average(tga(2, 1, 1, 24, "\x10\x20\x30"), colour);
  expect_average(tga(2, 1, 1, 32, "\x10\x20\x30\x01"), colour);
  expect_average(tga(3, 2, 1, 8, "\x10\x30"), Vec3(0x20 / 255.0f));
  expect_average(tga(10, 200, 1, 24, "\xff\x10\x20\x30\xc7\x10\x20\x30"), colour);
  expect_average(tga(1, 2, 1, 8, "\1\1", "\x01\x02\x03\x10\x20\x30"), colour);
}

TEST(TgaImage, PixelsComeInEveryOrderAndDepth) {
  const auto first_red = [](const std::string& file) {
    MemoryReservation memory{MemoryBudget(kBudget)};
    return read_image(std::as_bytes(std::span(file)), true, ImageWants{false, true}, memory).rgb;
  };
  std::string file = tga(2, 2, 2, 24, "\0\0\x01\0\0\x02\0\0\x03\0\0\x04"s); // red values 1 to 4
  const auto reds = [&] {
    const std::vector<uint8_t> rgb = first_red(file);
    return std::vector<int>{rgb[0], rgb[3], rgb[6], rgb[9]};
  };
  EXPECT_EQ(reds(), (std::vector<int>{1, 2, 3, 4}));
  file[17] = 0x00; // from the bottom left
  EXPECT_EQ(reds(), (std::vector<int>{3, 4, 1, 2}));
  file[17] = 0x10; // from the bottom right
  EXPECT_EQ(reds(), (std::vector<int>{4, 3, 2, 1}));
  expect_average(tga(2, 1, 1, 16, "\xe0\x7f"s), {1.0f, 1.0f, 0.0f});
  expect_average(tga(3, 1, 1, 16, "\x40\x07"s), Vec3(0x40 / 255.0f));
  expect_average(tga(9, 3, 1, 16, "\x82\1\0"s, "\x01\x02\x03\x10\x20\x30"),
                 {0x30 / 255.0f, 0x20 / 255.0f, 0x10 / 255.0f});
}

TEST(TgaImage, WhatDoesNotFitIsReported) {
  EXPECT_EQ(problems(tga(10, 3, 1, 24, "\x82\x10\x20\x30")), Problems{});
  EXPECT_EQ(problems(tga(10, 2, 1, 24, "\x82\x10\x20\x30")),
            Problems{"1 pixel of the last run lies beyond the image's end; it is ignored"});
  EXPECT_EQ(problems(tga(10, 1, 1, 24, "\xff\x10\x20\x30")),
            Problems{"127 pixels of the last run lie beyond the image's end; they are ignored"});
  EXPECT_EQ(problems(tga(1, 3, 1, 8, "\1\2\xff"s, "\x01\x02\x03\x10\x20\x30")),
            Problems{"2 pixels have colours that the palette lacks; they count as black"});
  EXPECT_EQ(problems(tga(9, 3, 1, 8, "\x82\2"s, "\x01\x02\x03\x10\x20\x30")),
            Problems{"3 pixels have colours that the palette lacks; they count as black"});
}

TEST(TgaImage, DamageIsSurvived) {
  expect_robust(tga(2, 2, 2, 24, std::string(12, '\x40')));
  expect_robust(tga(10, 200, 1, 24, "\xff\x10\x20\x30\xc7\x10\x20\x30"));
  expect_robust(tga(1, 2, 1, 8, "\1\1", "\x01\x02\x03\x10\x20\x30"));
}

// Radiance HDR

std::string hdr(const std::string& size, const std::string& pixels, const std::string& lines = "") {
  return "#?RADIANCE\n" + lines + "FORMAT=32-bit_rle_rgbe\n\n" + size + "\n" + pixels;
}

TEST(HdrImage, SharedExponentsScale) {
  expect_average(hdr("-Y 1 +X 1", "\x80\x40\x20\x81"), {1.0f, 0.5f, 0.25f});
  expect_average(hdr("-Y 1 +X 1", "\x80\x40\x20\x84"), {8.0f, 4.0f, 2.0f});
  expect_average(hdr("-Y 1 +X 1", "\x80\x40\x20\0"s), Vec3(0.0f));
  expect_average("#?RGBE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 1\r\n\x80\x40\x20\x81", {1.0f, 0.5f, 0.25f});
  // EXPOSURE is ignored, since it has been applied to the pixels.
  expect_average(hdr("-Y 1 +X 1", "\x80\x40\x20\x81", "# comment\nEXPOSURE=2\n"), {1.0f, 0.5f, 0.25f});
}

TEST(HdrImage, RowsComeFromTheTop) {
  const ImageSummary image = read(hdr("-Y 2 +X 2", "\x80\x80\x80\x81\0\0\0\0\0\0\0\0\0\0\0\0"s), true);
  EXPECT_EQ(image.width, 2u);
  EXPECT_EQ(image.height, 2u);
  EXPECT_EQ(image.nonzero, (std::vector<uint32_t>{1, 0}));
  EXPECT_EQ(image.average, Vec3(0.25f));
}

TEST(HdrImage, RunsOfComponentsAreRead) {
  // Red: one run of eight; green: two runs; blue: literal; exponent: a run and two literal values.
  const std::string row =
      "\2\2\0\x08"s + "\x88\x80" + "\x84\x80\x84\0"s + "\x08\x80\0\x80\0\x80\0\x80\0"s + "\x86\x81" + "\x02\x81\x81";
  expect_average(hdr("-Y 2 +X 8", row + row), {1.0f, 0.5f, 0.5f});
}

TEST(HdrImage, RunsOfPixelsAreRead) {
  expect_average(hdr("-Y 1 +X 4", "\x80\x40\x20\x81\1\1\1\3"), {1.0f, 0.5f, 0.25f});
  // Repeats the first pixel 2 + 1 * 256 times.
  expect_average(hdr("-Y 1 +X 259", "\x80\x40\x20\x81\1\1\1\2\1\1\1\1"), {1.0f, 0.5f, 0.25f});
}

TEST(HdrImage, EveryByteOfARowIsLookedAt) {
  const std::string truncated = "damaged image: the file is truncated",
                    wrong = "damaged image: a run does not fit its row";
  const std::string start = "\2\2\0\x08"s;
  EXPECT_EQ(complaint(hdr("-Y 1 +X 8", start + '\0')), wrong); // an empty run
  EXPECT_EQ(complaint(hdr("-Y 1 +X 8", start + "\x80" + std::string(128, '\1'))), wrong);
  EXPECT_EQ(complaint(hdr("-Y 1 +X 8", start + "\x89\1")), wrong);
  EXPECT_EQ(complaint(hdr("-Y 1 +X 8", start)), truncated);
  EXPECT_EQ(complaint(hdr("-Y 1 +X 8", "\2\2\0\x09"s)), "damaged image: a row has a different width");
  EXPECT_EQ(complaint(hdr("-Y 1 +X 2", "\1\1\1\1")), wrong); // repeats a pixel that does not exist
  EXPECT_EQ(complaint(hdr("-Y 1 +X 4", "\x80\x40\x20\x81\1\1\1\4")), wrong);
  EXPECT_EQ(complaint(hdr("-Y 1 +X 4", "\x80\x40\x20\x81\1\1\1\0\1\1\1\0\1\1\1\0\1\1\1\0"s)), wrong);
}

TEST(HdrImage, OtherKindsAreRefusedByName) {
  const std::string orientation = "HDR images that are not stored from the top left (-Y, +X) are not read";
  for (const char* const size : {"+Y 1 +X 1", "-Y 1 -X 1", "+X 1 -Y 1", "", "-Y 1"})
    EXPECT_EQ(complaint(hdr(size, "\x80\x40\x20\x81")), orientation) << size;
  EXPECT_EQ(complaint("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n\1\1\1\1"),
            "HDR images other than FORMAT=32-bit_rle_rgbe are not read");
  for (const char* const size : {"-Y 0 +X 1", "-Y 1 +X -1", "-Y 1.5 +X 1", "-Y 1 +X nan", "-Y 1 +X 1e9", "-Y 1 +X"})
    EXPECT_EQ(complaint(hdr(size, "\x80\x40\x20\x81")),
              "damaged image: width and height must be whole numbers from 1 to 16777216")
        << size;
}

TEST(HdrImage, DamageIsSurvived) {
  expect_robust(hdr("-Y 2 +X 2", std::string(16, '\x40')));
  const std::string row =
      "\2\2\0\x08"s + "\x88\x80" + "\x84\x80\x84\0"s + "\x08\x80\0\x80\0\x80\0\x80\0"s + "\x86\x81" + "\x02\x81\x81";
  expect_robust(hdr("-Y 2 +X 8", row + row));
}

// PFM

TEST(PfmImage, ColoursAndGreyAreRead) {
  const float values[] = {0.25f, 0.5f, 1.0f};
  const std::string samples(reinterpret_cast<const char*>(values), sizeof values);
  expect_average("PF\n1 1\n-1.0\n" + samples, {0.25f, 0.5f, 1.0f});
  expect_average("Pf\n3 1\n-1.0\n" + samples, Vec3(1.75f / 3.0f));
  expect_robust("PF\n1 1\n-1.0\n" + samples);
}

TEST(PfmImage, NegativeValuesCountAsZeroAndAreReported) {
  const float values[] = {0.5f, -1.0f, 0.25f, 0.5f, 1.0f, 0.25f, 0.0f, -0.0f, 0.0f};
  const std::string file = "PF\n3 1\n-1.0\n" + std::string(reinterpret_cast<const char*>(values), sizeof values);
  expect_average(file, {1.0f / 3.0f, 1.0f / 3.0f, 0.5f / 3.0f});
  EXPECT_EQ(problems(file), Problems{"1 pixel has a negative value, which counts as 0"});
  const float grey[] = {-1.0f, -2.0f, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_EQ(problems("Pf\n3 1\n-1.0\n" + std::string(reinterpret_cast<const char*>(grey), sizeof grey)),
            (Problems{"1 pixel is not finite; it counts as black", "2 pixels have negative values, which count as 0"}));
}

// EXR

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

// Other formats

TEST(ImageFormats, ThoseThatAreNotReadAreNamed) {
  for (const auto& [magic, name] : {std::pair{"\xff\xd8\xff\xe0"s, "JPEG"},
                                    {"BM"s, "BMP"},
                                    {"GIF89a"s, "GIF"},
                                    {"II*\0"s, "TIFF"},
                                    {"MM\0*"s, "TIFF"}})
    EXPECT_EQ(complaint(magic + std::string(100, '\0')),
              "images in " + std::string(name) + " format are not read, only PNG, TGA, EXR, PFM and HDR");
  for (const std::string& file : {""s, "text"s, "\xff\xd8"s})
    EXPECT_EQ(complaint(file), "not an image in a known format (PNG, TGA, EXR, PFM, HDR)");
}

TEST(ImageFormats, WhatFuzzingFoundIsRefused) {
  for (const char* const name :
       {"exr_attribute_length.exr", "exr_attribute_size_lies.exr", "exr_huge_window.exr", "hdr_truncated_run.hdr",
        "jpeg_huffman_counts.jpg", "jpeg_wild_read.jpg", "png_empty_idat.png"}) {
    std::ifstream in(std::string(PACKTRACE_SOURCE_DIR "/tests/fuzz/corpus/image/") + name, std::ios::binary);
    const std::string file{std::istreambuf_iterator<char>(in), {}};
    EXPECT_FALSE(file.empty()) << name;
    EXPECT_NE(complaint(file), "") << name;
  }
}

} // namespace
} // namespace packtrace
