#include "pbrt_import/files/image_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#define STB_IMAGE_STATIC // other libraries may bring their own copy of stb_image
#define STB_IMAGE_IMPLEMENTATION
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
// stb_image's other decoders, JPEG above all, access memory outside their buffers when files are damaged.
#define STBI_ONLY_PNG
#include <stb/stb_image.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/png_chunks.h"
#include "pbrt_import/files/float_images.h"
#include "pbrt_import/files/image_summarizer.h"
#include "pbrt_import/files/jpeg.h"
#include "pbrt_import/files/radiance.h"
#include "pbrt_import/files/tga.h"
#include "pbrt_import/files/webp.h"
#include "pbrt_import/scene/albedo_texture.h"

namespace packtrace {
namespace {

constexpr const char* kDamaged = "damaged image: ";

constexpr const char *kNotInPalette = "has a colour that the palette lacks; it counts as black",
                     *kNotInPaletteMany = "have colours that the palette lacks; they count as black";

/// Linear value of an sRGB-encoded value. Source: IEC 61966-2-1.
float linear_from_srgb(float v) {
  return v <= 0.04045f ? v / 12.92f : static_cast<float>(std::pow((v + 0.055) / 1.055, 2.4));
}

struct StbFree {
  void operator()(void* p) const { stbi_image_free(p); }
};

/// Summarizes rows of 8-bit pixels.
template <uint32_t kChannels>
ImageSummary summarize_bytes(const uint8_t* pixels, uint32_t width, uint32_t height, ImageWants wants,
                             const std::array<float, 256>& linear) {
  ImageSummarizer summarizer(width, height, wants);
  for (uint32_t y = 0; y < height; ++y)
    summarizer.add_row<kChannels>(y, pixels + static_cast<size_t>(y) * width * kChannels, linear);
  return summarizer.finish();
}

template <class T, class ToLinear>
ImageSummary summarize(const T* pixels, int width, int height, ImageWants wants, ToLinear to_linear) {
  const auto w = static_cast<uint32_t>(width), h = static_cast<uint32_t>(height);
  ImageSummarizer summarizer(w, h, wants);
  for (uint32_t y = 0; y < h; ++y) {
    for (uint32_t x = 0; x < w; ++x, pixels += 3)
      summarizer.add(x, y, {to_linear(pixels[0]), to_linear(pixels[1]), to_linear(pixels[2])});
    summarizer.end_row();
  }
  return summarizer.finish();
}

/// Linear value of each 8-bit sample value.
std::array<float, 256> linear_of_bytes(bool decode_srgb) {
  std::array<float, 256> linear{};
  for (size_t i = 0; i < linear.size(); ++i) {
    const float v = static_cast<float>(i) / 255.0f;
    linear[i] = decode_srgb ? linear_from_srgb(v) : v;
  }
  return linear;
}

/// Linear value of each 16-bit sample value.
std::vector<float> linear_of_words(bool decode_srgb) {
  std::vector<float> linear(size_t{1} << 16);
  for (size_t i = 0; i < linear.size(); ++i) {
    const float v = static_cast<float>(i) / 65535.0f;
    linear[i] = decode_srgb ? linear_from_srgb(v) : v;
  }
  return linear;
}

/// Decodes a PNG file with stb_image. The chunks must have been checked.
template <class Sample>
std::unique_ptr<Sample, StbFree> decode_png(std::span<const std::byte> bytes, int channels,
                                            Sample* (*load)(const stbi_uc*, int, int*, int*, int*, int)) {
  int width = 0, height = 0, stored_channels = 0;
  std::unique_ptr<Sample, StbFree> pixels(load(reinterpret_cast<const stbi_uc*>(bytes.data()),
                                               static_cast<int>(bytes.size()), &width, &height, &stored_channels,
                                               channels));
  if (!pixels) fail_image(std::string(kDamaged) + stbi_failure_reason());
  return pixels;
}

/// Mask of the pixels whose alpha is at least a cutoff.
/// @param alpha of the first pixel; that of the next is `stride` bytes behind it
std::vector<uint32_t> alpha_bits(const uint8_t* alpha, size_t stride, size_t width, size_t height, float cutoff) {
  const size_t words = AlphaMask::row_words(static_cast<uint32_t>(width));
  std::vector<uint32_t> bits(words * height, 0);
  for (size_t y = 0; y < height; ++y)
    for (size_t x = 0; x < width; ++x, alpha += stride)
      if (static_cast<float>(*alpha) / 255.0f >= cutoff) bits[y * words + x / 32] |= 1u << (x % 32);
  return bits;
}

/// Adds values of the alpha channel to a summary: the number of pixels where it is below 1 at 8 bits, and the mask of a
/// cutoff.
/// @param alpha of the first pixel; that of the next is `stride` bytes behind it
void add_alpha(ImageSummary& summary, const uint8_t* alpha, size_t stride, size_t width, size_t height,
               ImageWants wants) {
  if (wants.alpha)
    for (size_t i = 0; i < width * height; ++i) summary.transparent += alpha[stride * i] < 255;
  if (wants.mask && wants.alpha_cutoff) summary.nonzero = alpha_bits(alpha, stride, width, height, *wants.alpha_cutoff);
}

ImageSummary read_palette_png(std::span<const std::byte> bytes, const PngHeader& header, bool decode_srgb,
                              ImageWants wants) {
  const PngPalette palette = png_palette(bytes, kDamaged);
  const auto grey = decode_png(palette.indices_as_grey, 1, stbi_load_from_memory);
  const std::array<float, 256> linear = linear_of_bytes(decode_srgb);
  ImageSummarizer summarizer(header.width, header.height, wants);
  uint64_t out_of_range = 0;
  const stbi_uc* pixel = grey.get();
  std::vector<uint8_t> row(size_t{header.width} * 3);
  for (uint32_t y = 0; y < header.height; ++y) {
    for (uint32_t x = 0; x < header.width; ++x) {
      const size_t index = *pixel++ / palette.grey_step;
      out_of_range += index >= palette.colours.size();
      const std::array<uint8_t, 3> colour =
          index < palette.colours.size() ? palette.colours[index] : std::array<uint8_t, 3>{};
      std::ranges::copy(colour, row.begin() + ptrdiff_t{3} * x);
    }
    summarizer.add_row<3>(y, row.data(), linear);
  }
  ImageSummary summary = summarizer.finish();
  add_problem(summary, out_of_range, kNotInPalette, kNotInPaletteMany);
  if (!wants.alpha && !(wants.mask && wants.alpha_cutoff)) return summary;
  // Not by the decoder, whose palette is undefined behind its last entry.
  std::vector<uint8_t> alpha(size_t{header.width} * header.height);
  std::transform(grey.get(), grey.get() + alpha.size(), alpha.begin(), [&](stbi_uc value) {
    const size_t index = value / palette.grey_step;
    return index < palette.alphas.size() ? palette.alphas[index] : uint8_t{255};
  });
  add_alpha(summary, alpha.data(), 1, header.width, header.height, wants);
  return summary;
}

ImageSummary read_png(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants, MemoryReservation& memory) {
  if (bytes.size() > static_cast<size_t>(INT32_MAX)) fail_image("the image file exceeds 2 GiB");
  const PngHeader header = check_png_chunks(bytes, PngChecksums::kCount, kDamaged);
  // stb_image holds at most two copies of at most four channels.
  const ClaimedImageSize size{header.width, header.height};
  size.check(bytes.size(), size.width * size.height * (header.bits_per_sample > 8 ? 16 : 8), wants, memory);
  ImageSummary summary;
  if (header.palette) {
    summary = read_palette_png(bytes, header, decode_srgb, wants);
  } else if (header.bits_per_sample > 8) {
    const auto pixels = decode_png(bytes, 3, stbi_load_16_from_memory);
    const std::vector<float> linear = linear_of_words(decode_srgb);
    summary = summarize(pixels.get(), static_cast<int>(header.width), static_cast<int>(header.height), wants,
                        [&](stbi_us v) { return linear[v]; });
  } else {
    const std::array<float, 256> linear = linear_of_bytes(decode_srgb);
    const bool grey = header.channels <= 2;
    const auto pixels = decode_png(bytes, grey ? 1 : 3, stbi_load_from_memory);
    summary = grey ? summarize_bytes<1>(pixels.get(), header.width, header.height, wants, linear)
                   : summarize_bytes<3>(pixels.get(), header.width, header.height, wants, linear);
  }
  if (!header.palette && (wants.alpha || (wants.mask && wants.alpha_cutoff))) {
    const auto rgba = decode_png(bytes, 4, stbi_load_from_memory);
    add_alpha(summary, rgba.get() + 3, 4, header.width, header.height, wants);
  }
  if (header.wrong_checksums > 0)
    summary.problems.push_back(header.wrong_checksums == 1
                                   ? std::string("a chunk has a wrong checksum; the image may be damaged")
                                   : std::to_string(header.wrong_checksums) +
                                         " chunks have wrong checksums; the image may be damaged");
  return summary;
}

/// TGA has no magic number, so it is tried for files that match no other format.
ImageSummary read_tga(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants, MemoryReservation& memory) {
  const std::optional<TgaHeader> header = parse_tga_header(bytes);
  if (!header) fail_image("not an image in a known format (PNG, JPEG, WebP, TGA, EXR, PFM, HDR)");
  constexpr uint64_t kPixelsPerByte = 64; // a run of up to 128 pixels takes at least two bytes
  const ClaimedImageSize size{header->width, header->height, kPixelsPerByte};
  size.check(bytes.size(), size.width * size.height * 3, wants, memory);
  const TgaPixels pixels = decode_tga(bytes, *header);
  ImageSummary summary =
      summarize_bytes<3>(pixels.rgb.data(), header->width, header->height, wants, linear_of_bytes(decode_srgb));
  if (wants.alpha) summary.transparent = pixels.transparent_pixels;
  add_problem(summary, pixels.pixels_out_of_range, kNotInPalette, kNotInPaletteMany);
  add_problem(summary, pixels.surplus_pixels, "of the last run lies beyond the image's end; it is ignored",
              "of the last run lie beyond the image's end; they are ignored");
  return summary;
}

ImageSummary read_hdr(std::span<const std::byte> bytes, ImageWants wants, MemoryReservation& memory) {
  RadianceReader reader(bytes);
  const ClaimedImageSize size{reader.width(), reader.height()};
  size.check(bytes.size(), size.width * 2 * sizeof(Vec3), wants, memory); // working memory: one row
  ImageSummarizer summarizer(reader.width(), reader.height(), wants);
  for (uint32_t y = 0; y < reader.height(); ++y) {
    const std::span<const Vec3> row = reader.read_row();
    for (uint32_t x = 0; x < reader.width(); ++x) summarizer.add(x, y, row[x]);
    summarizer.end_row();
  }
  return summarizer.finish();
}

ImageSummary read_jpeg(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants,
                       MemoryReservation& memory) {
  JpegReader reader(bytes);
  const ClaimedImageSize size{reader.width(), reader.height()};
  size.check(bytes.size(), reader.working_bytes(), wants, memory);
  const std::array<float, 256> linear = linear_of_bytes(decode_srgb);
  ImageSummarizer summarizer(reader.width(), reader.height(), wants);
  for (uint32_t y = 0; y < reader.height(); ++y) summarizer.add_row<3>(y, reader.read_row().data(), linear);
  ImageSummary summary = summarizer.finish();
  if (const std::string problem = reader.problem(); !problem.empty())
    summary.problems.push_back("the image may be damaged: " + problem);
  return summary;
}

ImageSummary read_webp(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants,
                       MemoryReservation& memory) {
  const WebpReader reader(bytes);
  constexpr uint64_t kPixelsPerByte = uint64_t{1} << 20; // lossless images of one colour take a few bytes
  const ClaimedImageSize size{reader.width(), reader.height(), kPixelsPerByte};
  size.check(bytes.size(), reader.working_bytes(), wants, memory);
  const std::vector<uint8_t> pixels = reader.decode();
  const std::array<float, 256> linear = linear_of_bytes(decode_srgb);
  ImageSummarizer summarizer(reader.width(), reader.height(), wants);
  std::vector<uint8_t> row(size_t{reader.width()} * 3);
  for (uint32_t y = 0; y < reader.height(); ++y) {
    const uint8_t* from = pixels.data() + size_t{y} * reader.width() * 4;
    for (size_t i = 0; i < row.size(); i += 3, from += 4) std::copy(from, from + 3, &row[i]);
    summarizer.add_row<3>(y, row.data(), linear);
  }
  ImageSummary summary = summarizer.finish();
  add_alpha(summary, pixels.data() + 3, 4, reader.width(), reader.height(), wants);
  return summary;
}

/// Name of an unsupported format that is common in scenes, detected by its first bytes; empty if none matches. No TGA
/// file starts with any of these bytes.
std::string_view other_format(std::string_view file) {
  using namespace std::string_view_literals;
  for (const auto& [magic, name] : {std::pair{"BM"sv, "BMP"sv},
                                    {"GIF8"sv, "GIF"sv},
                                    {"II*\0"sv, "TIFF"sv},
                                    {"MM\0*"sv, "TIFF"sv},
                                    {"8BPS"sv, "Photoshop"sv},
                                    {"DDS "sv, "DDS"sv}})
    if (file.starts_with(magic)) return name;
  return {};
}

ImageSummary read_by_format(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants,
                            MemoryReservation& memory) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\x76\x2f\x31\x01")) return read_exr_image(bytes, wants, memory);
  if (text.starts_with("PF") || text.starts_with("Pf")) return read_pfm_image(bytes, wants, memory);
  if (text.starts_with("#?")) return read_hdr(bytes, wants, memory);
  if (const std::string_view name = other_format(text); !name.empty())
    fail_image("images in " + std::string(name) + " format are not read, only PNG, JPEG, WebP, TGA, EXR, PFM and HDR");
  if (text.starts_with("\xff\xd8\xff")) return read_jpeg(bytes, decode_srgb, wants, memory);
  if (WebpReader::is_webp(bytes)) return read_webp(bytes, decode_srgb, wants, memory);
  return text.starts_with("\x89PNG") ? read_png(bytes, decode_srgb, wants, memory)
                                     : read_tga(bytes, decode_srgb, wants, memory);
}

} // namespace

ImageSummary read_image(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants,
                        MemoryReservation& memory) {
  ImageSummary summary = read_by_format(bytes, decode_srgb, wants, memory);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const bool has_alpha = text.starts_with("\x89PNG") || WebpReader::is_webp(bytes);
  if (wants.alpha_cutoff && !has_alpha) std::ranges::fill(summary.nonzero, ~0u); // no alpha is read
  return summary;
}

} // namespace packtrace
