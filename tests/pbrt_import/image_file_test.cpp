#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <tuple>

#include "tests/pbrt_import/image_test_support.h"

namespace packtrace {
namespace {

using namespace std::string_literals;
using namespace image_test;

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

TEST(TgaImage, TransparentPixelsAreCountedIfTheDescriptorHasAlpha) {
  for (std::string file : {tga(2, 2, 1, 32, "\x10\x20\x30\x01\x10\x20\x30\xff"),
                           tga(10, 200, 1, 32, "\xc7\x10\x20\x30\x01\xff\x10\x20\x30\xff"),
                           tga(3, 2, 1, 16, "\x40\x07\x40\xff"), tga(2, 2, 1, 16, "\xe0\x7f\xe0\xff")}) {
    const bool runs = file[2] == 10;
    EXPECT_EQ(transparent(file), 0u);
    file[17] = static_cast<char>(file[17] | 8);
    EXPECT_EQ(transparent(file), runs ? 72u : 1u);
  }
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

// Other formats

TEST(ImageFormats, ThoseThatAreNotReadAreNamed) {
  for (const auto& [magic, name] :
       {std::pair{"8BPS"s, "Photoshop"}, {"BM"s, "BMP"}, {"GIF89a"s, "GIF"}, {"II*\0"s, "TIFF"}, {"MM\0*"s, "TIFF"}})
    EXPECT_EQ(complaint(magic + std::string(100, '\0')),
              "images in " + std::string(name) + " format are not read, only PNG, JPEG, WebP, TGA, EXR, PFM and HDR");
  for (const std::string& file : {""s, "text"s, "\xff\xd8"s})
    EXPECT_EQ(complaint(file), "not an image in a known format (PNG, JPEG, WebP, TGA, EXR, PFM, HDR)");
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
