// JPEG images.

#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/image_file.h"
#include "tests/pbrt_import/image_test_support.h"

namespace packtrace {
namespace {

constexpr uint64_t kPlenty = 64u << 20;

/// A JPEG file: red on the left, blue on the right; or grey with these as 76 and 29.
std::string jpeg(uint32_t width, uint32_t height, bool grey, bool progressive) {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  encoder.err = jpeg_std_error(&errors);
  jpeg_create_compress(&encoder);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&encoder, &memory, &size);
  encoder.image_width = width, encoder.image_height = height;
  encoder.input_components = grey ? 1 : 3;
  encoder.in_color_space = grey ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, 100, TRUE);
  encoder.comp_info[0].h_samp_factor = encoder.comp_info[0].v_samp_factor = 1;
  if (progressive) jpeg_simple_progression(&encoder);
  jpeg_start_compress(&encoder, TRUE);
  std::vector<unsigned char> row;
  for (uint32_t x = 0; x < width; ++x) {
    const bool left = x < width / 2;
    if (grey)
      row.push_back(left ? 76 : 29);
    else
      row.insert(row.end(),
                 {static_cast<unsigned char>(left ? 255 : 0), 0, static_cast<unsigned char>(left ? 0 : 255)});
  }
  unsigned char* rows[] = {row.data()};
  for (uint32_t y = 0; y < height; ++y) jpeg_write_scanlines(&encoder, rows, 1);
  jpeg_finish_compress(&encoder);
  jpeg_destroy_compress(&encoder);
  std::string file(reinterpret_cast<const char*>(memory), size);
  std::free(memory);
  return file;
}

ImageSummary read(const std::string& file, ImageWants wants = {}) {
  MemoryReservation memory{MemoryBudget(kPlenty)};
  return read_image(std::as_bytes(std::span(file)), false, wants, memory);
}

TEST(JpegImages, BaselineProgressiveAndGrey) {
  for (const bool progressive : {false, true}) {
    const ImageSummary colour = read(jpeg(32, 8, false, progressive), {.colours = true});
    EXPECT_EQ(colour.width, 32u);
    EXPECT_EQ(colour.height, 8u);
    EXPECT_NEAR(colour.average.x, 0.5f, 0.01f);
    EXPECT_NEAR(colour.average.y, 0.0f, 0.01f);
    EXPECT_NEAR(colour.average.z, 0.5f, 0.01f);
    ASSERT_EQ(colour.rgb.size(), 32u * 8 * 3);
    EXPECT_GT(colour.rgb[0], 250);
    EXPECT_GT(colour.rgb[31 * 3 + 2], 250);
    const ImageSummary grey = read(jpeg(32, 8, true, progressive));
    EXPECT_NEAR(grey.average.x, 52.5f / 255.0f, 0.005f);
    EXPECT_EQ(grey.average.x, grey.average.z);
  }
}

TEST(JpegImages, HaveNoAlpha) {
  const ImageSummary summary = read(jpeg(33, 2, false, false), {.mask = true, .alpha_cutoff = 0.5f});
  EXPECT_EQ(summary.nonzero, (std::vector<uint32_t>(4, ~0u)));
}

TEST(JpegImages, EveryPrefixAndFlippedByteEndsWell) {
  for (const bool progressive : {false, true}) {
    const std::string whole = jpeg(24, 16, false, progressive);
    size_t problems = 0;
    for (size_t i = 0; i < whole.size(); ++i) {
      std::string flipped = whole;
      flipped[i] = static_cast<char>(flipped[i] ^ (1 << i % 8));
      for (const std::string& content : {whole.substr(0, i), flipped}) {
        try {
          problems += read(content).problems.size();
        } catch (const Error& error) {
          EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
        }
      }
    }
    EXPECT_GT(problems, 10u); // what the decoder tolerates is reported
  }
}

TEST(JpegImages, ClaimedSizesAreChecked) {
  std::string file = jpeg(8, 8, false, false);
  const size_t frame = file.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  for (size_t i = frame + 5; i < frame + 9; ++i) file[i] = '\xff'; // 65535 x 65535
  MemoryReservation memory{MemoryBudget(kPlenty)};
  EXPECT_THROW(read_image(std::as_bytes(std::span(file)), false, ImageWants{.colours = true}, memory), Error);
}

} // namespace
} // namespace packtrace
