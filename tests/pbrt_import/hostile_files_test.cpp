#include <cstdint>
#include <cstring>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <sys/stat.h>
#include <zlib.h>

#include "tests/pbrt_import/exr_stream.h"
#include "tests/pbrt_import/hostile_case.h"

namespace packtrace {
namespace {

using namespace std::string_literals;

/// zlib's output for its window_bits: 15 zlib, 31 gzip.
std::string deflated(std::string_view text, int window_bits) {
  z_stream z{};
  EXPECT_EQ(deflateInit2(&z, 9, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&z, static_cast<uLong>(text.size())) + 64, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  z.avail_in = static_cast<uInt>(text.size());
  z.next_out = reinterpret_cast<Bytef*>(packed.data());
  z.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  packed.resize(z.total_out);
  deflateEnd(&z);
  return packed;
}
std::string gzip(std::string_view text) { return deflated(text, 15 + 16); }

std::string without_end(std::string text, size_t bytes) {
  text.resize(text.size() - bytes);
  return text;
}

std::string flipped(std::string text, size_t at) {
  text[at] = static_cast<char>(~text[at]);
  return text;
}

// Images

std::string big_endian(uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
          static_cast<char>(value)};
}

std::string png_chunk(const std::string& type_and_data) {
  const auto* const bytes = reinterpret_cast<const Bytef*>(type_and_data.data());
  const auto checksum = static_cast<uint32_t>(crc32(0, bytes, static_cast<uInt>(type_and_data.size())));
  return big_endian(static_cast<uint32_t>(type_and_data.size() - 4)) + type_and_data + big_endian(checksum);
}

constexpr char kGrey = 0, kRgb = 2;

/// A PNG that claims a size and has rows of pixels, whether or not they fit it.
std::string png(uint32_t width, uint32_t height, int bits, const std::string& rows, char colour = kRgb) {
  const std::string format{static_cast<char>(bits), colour, 0, 0, 0};
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR" + big_endian(width) + big_endian(height) + format) +
         png_chunk("IDAT" + deflated(rows, 15)) + png_chunk("IEND");
}
std::string good_png() { return png(2, 1, 8, std::string("\0\x80\x80\x80\x40\x40\x40", 7)); }

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

/// Depth, but no colour.
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

/// exr() with a data window that claims other pixels.
std::string exr_with_corner(int32_t x, int32_t y) {
  std::string file = exr();
  const size_t at = file.find("dataWindow\0box2i\0"s) + 17 + 4 + 8;
  std::memcpy(file.data() + at, &x, 4);
  std::memcpy(file.data() + at + 4, &y, 4);
  return file;
}

/// A disk with an image for its colour.
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
      image_case("PngOfTooFewRows", "a.png", png(100, 100, 8, std::string(10, '\0')),
                 R"(scene.pbrt:2:1: error: texture file "a.png": damaged image: too little data for its size; it counts as white
)"),
      image_case(
          "PngOfNoPixels", "a.png", png(0, 0, 8, ""),
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
          R"(scene.pbrt:2:1: error: texture file "a.tga": decoding its 65535 x 65535 pixels needs too much memory; it counts as white
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
          R"(scene.pbrt:2:1: error: texture file "a.pfm": decoding its 16777216 x 16777216 pixels needs too much memory; it counts as white
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
          R"(scene.pbrt:2:1: error: texture file "a.exr": damaged image: its 351 bytes cannot hold the 16000001 x 4 pixels it claims; it counts as white
)"),
      image_case(
          "ExrOfNoRows", "a.exr", exr_with_corner(3, -1),
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

// Scene text in other files

HostileCase with(HostileCase test_case, const ImportOptions& options) {
  test_case.options = options;
  return test_case;
}

ImportOptions include_depth(uint32_t depth) {
  ImportOptions options;
  options.max_include_depth = depth;
  return options;
}
ImportOptions included_files(uint64_t count) {
  ImportOptions options;
  options.max_included_files = count;
  return options;
}
ImportOptions confined() {
  ImportOptions options;
  options.allow_files_outside_scene_folder = false;
  return options;
}
ImportOptions budget(uint64_t bytes) {
  ImportOptions options;
  options.memory_budget_bytes = bytes;
  return options;
}

std::vector<HostileCase> includes() {
  const std::string bomb = gzip(std::string(10'000'000, ' '));
  return {
      {"IncludesItself",
       world("Include \"scene.pbrt\""),
       R"(scene.pbrt:2:1: error: cannot include "scene.pbrt": the file includes itself
)",
       {1, 1, 0, 0}},
      {"IncludesInACycle",
       world("Include \"a\""),
       R"(b:2:2: error: cannot include "a": the file includes itself
  included from a:2:1
  included from scene.pbrt:2:1
a:3:1: error: unknown directive "Nonsense"
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a", "Identity\nInclude \"b\"\nNonsense"}, {"b", "\n Include \"./a\""}}},
      with({"IncludesTooDeep",
            world("Include \"a\""),
            R"(b:1:1: error: included files are nested more than 3 deep; "c" is skipped
  included from a:1:1
  included from scene.pbrt:2:1
)",
            {1, 1, 0, 0},
            {{"a", "Include \"b\""}, {"b", "Include \"c\" Identity"}, {"c", "Nonsense"}}},
           include_depth(3)),
      with({"IncludesTooMany",
            world("Include \"a\"\nInclude \"a\"\nInclude \"a\""),
            R"(scene.pbrt:3:1: error: more than 2 files are included in all; the rest is skipped (2 times, first here)
)",
            {1, 1, 0, 0},
            {{"a", "Identity"}}},
           included_files(2)),
      {"IncludeMissing",
       world("Include \"gone.pbrt\""),
       R"(scene.pbrt:2:1: error: cannot include "gone.pbrt": no such file
)",
       {1, 1, 0, 0}},
      {"IncludeAFolder",
       world("Include \"folder\""),
       R"(scene.pbrt:2:1: error: cannot include "folder": is a directory, not a file
)",
       {1, 1, 0, 0},
       {{"folder/x", ""}}},
      {"IncludeTheFolderItself",
       world("Include \".\""),
       R"(scene.pbrt:2:1: error: cannot include "": is a directory, not a file
)",
       {1, 1, 0, 0}},
      {"IncludeDevice",
       world("Include \"/dev/null\""),
       R"(scene.pbrt:2:1: error: cannot include "/dev/null": is not a regular file
)",
       {1, 1, 0, 0}},
      {"IncludeNothing",
       world("Include \"\""),
       R"(scene.pbrt:2:1: error: empty file name; nothing is read
)",
       {1, 1, 0, 0}},
      {"IncludeWithoutQuotes",
       world("Include a.pbrt"),
       R"(scene.pbrt:2:9: error: expected a quoted name after Include, found "a.pbrt"
)",
       {1, 1, 0, 0}},
      {"IncludeEndsInAString",
       world("Include \"a\""),
       R"(a:2:7: error: string without its closing quote: "sphere"
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a", "\nShape \"sphere"}}},
      {"IncludeEndsInAnArray",
       world("Include \"a\""),
       R"(a:1:31: error: "[" without its "]": the values of parameter "radius" run into "Shape"
  included from scene.pbrt:2:1
)",
       {1, 1, 1, 0},
       {{"a", "Shape \"sphere\" \"float radius\" [ 2"}}},
      {"IncludeEndsInABlock",
       world("Include \"a\""),
       R"(a:1:1: warning: AttributeBegin without its AttributeEnd before the world ends at scene.pbrt:4:1
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a", "AttributeBegin\n Scale 2 2 2"}}},
      {"IncludeEndsTheWorld",
       world("Include \"a\""),
       R"(scene.pbrt:3:2: error: Shape belongs between WorldBegin and WorldEnd; it is ignored
scene.pbrt:4:1: error: WorldEnd belongs between WorldBegin and WorldEnd; it is ignored
)",
       {0, 0, 0, 0},
       {{"a", "WorldEnd"}}},
      {"IncludeUtf16",
       world("Include \"a\""),
       R"(scene.pbrt:2:1: error: cannot include "a": the file is UTF-16 text (it starts with the byte order mark U+FEFF in 16 bits); save it as UTF-8
)",
       {1, 1, 0, 0},
       {{"a", "\xff\xfeI\0d\0"s}}},
      {"IncludeBinary",
       world("Include \"a\""),
       R"(a:1:1: error: unknown directive "\x89PNG"
  included from scene.pbrt:2:1
a:2:1: error: byte 0x1A does not belong in a pbrt file
  included from scene.pbrt:2:1
a:3:1: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8 (21 times, first here)
  included from scene.pbrt:2:1
a:4:1: error: unknown directive "IHDR"
  included from scene.pbrt:2:1
a:4:8: error: byte 0x02 does not belong in a pbrt file (3 times, first here)
  included from scene.pbrt:2:1
a:4:12: error: byte 0x01 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:13: error: byte 0x08 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:25: error: byte 0x0F does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:42: error: byte 0x07 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:46: error: byte 0x05 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:48: error: byte 0x1D does not belong in a pbrt file
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a", good_png()}}},
      {"IncludeEmpty", world("Include \"a\""), "", {1, 1, 0, 0}, {{"a", ""}}},
      {"IncludeGzipped", world("Include \"a.gz\""), "", {2, 2, 0, 0}, {{"a.gz", gzip(kTriangle)}}},
      {"IncludeGzipTruncated",
       world("Include \"a.gz\""),
       R"(a.gz: error: truncated gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
)",
       {2, 101, 0, 0},
       {{"a.gz", without_end(gzip("Shape \"disk\" Nonsense"), 9)}}},
      {"IncludeGzipTruncatedInAnArray",
       world("Include \"a.gz\""),
       R"(a.gz: error: truncated gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
a.gz:2:31: error: "[" without its "]": the values of parameter "radius" run into "Shape"
  included from scene.pbrt:2:1
)",
       {2, 2, 1, 0},
       {{"a.gz",
         without_end(gzip(std::string(kTriangle) + "\nShape \"sphere\" \"float radius\" [ 2 ] Nonsense"), 15)}}},
      {"IncludeGzipDamaged",
       world("Include \"a.gz\""),
       R"(a.gz: error: damaged gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
a.gz:1:1: error: unknown directive "So9pe"
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a.gz", flipped(gzip("Shape \"disk\""), 12)}}},
      {"IncludeGzipOfTwoBytes",
       world("Include \"a.gz\""),
       R"(scene.pbrt:2:1: error: cannot include "a.gz": truncated gzip data
)",
       {1, 1, 0, 0},
       {{"a.gz", "\x1f\x8b"}}},
      {"IncludeGzipWithNoiseBehind",
       world("Include \"a.gz\""),
       R"(a.gz: error: damaged gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
)",
       {2, 101, 0, 0},
       {{"a.gz", gzip("Shape \"disk\"") + "noise"}}},
      {"PlyGzipTruncated",
       world(ply_shape("a.ply")),
       R"(scene.pbrt:2:1: error: plymesh "a.ply": truncated gzip data; the shape is skipped
)",
       {1, 1, 1, 0},
       {{"a.ply", without_end(gzip(kPly), 1)}}},
      {"PlyGzipChecksumWrong",
       world(ply_shape("a.ply")),
       R"(scene.pbrt:2:1: error: plymesh "a.ply": damaged gzip data; the shape is skipped
)",
       {1, 1, 1, 0},
       {{"a.ply", flipped(gzip(kPly), gzip(kPly).size() - 8)}}},
      {"SpectrumFileGzipTruncated",
       world("Material \"matte\" \"spectrum Kd\" \"a.spd\""),
       R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": truncated gzip data
)",
       {1, 1, 0, 0},
       {{"a.spd", without_end(gzip("400 0.5\n700 0.5\n"), 1)}}},
      with({"IncludeGzipBomb",
            world("Include \"a.gz\""),
            R"(a.gz: error: content exceeds the limit of 1000000 bytes for this file; the rest of the file is skipped
  included from scene.pbrt:2:1
)",
            {1, 1, 0, 0},
            {{"a.gz", bomb}}},
           budget(1'000'000)),
      {"MainFileGzipped",
       gzip(world("Nonsense")),
       R"(scene.pbrt:2:1: error: unknown directive "Nonsense"
)",
       {1, 1, 0, 0}},
      {"MainFileGzipTruncated",
       without_end(gzip(world("Shape \"disk\"")), 12),
       R"(scene.pbrt: error: truncated gzip data; the rest of the file is skipped
scene.pbrt:3:79: warning: the file ends without WorldEnd
)",
       {2, 101, 0, 0}},
      {"MainFileGzipOfTwoBytes", "\x1f\x8b", R"(scene.pbrt: truncated gzip data)", {}, {}, {}, ErrorKind::kInput},
      {"MainFileGzipChecksumWrong",
       flipped(gzip(world("Shape \"disk\"")), gzip(world("Shape \"disk\"")).size() - 8),
       R"(scene.pbrt: error: damaged gzip data; the rest of the file is skipped
)",
       {2, 101, 0, 0}},
      with(
          {"MainFileGzipBomb",
           bomb,
           R"(scene.pbrt: error: content exceeds the limit of 1000000 bytes for this file; the rest of the file is skipped
scene.pbrt: warning: the file ends without WorldBegin: the scene is empty
)",
           {0, 0, 0, 0}},
          budget(1'000'000)),
      with(
          {"MainFileTooLarge",
           world("#" + std::string(2'000'000, ' ')),
           R"(scene.pbrt: error: content exceeds the limit of 1000000 bytes for this file; the rest of the file is skipped
scene.pbrt:1:1: warning: the file ends without WorldEnd
)",
           {0, 0, 0, 0}},
          budget(1'000'000)),
  };
}

// File names and spectrum files

HostileCase ply_case(const std::string& name, const std::string& file, const std::string& diagnostics) {
  return {name, world(ply_shape(file)), diagnostics, {1, 1, 1, 0}};
}
HostileCase spd_case(const std::string& name, const std::string& content, const std::string& diagnostics) {
  return {name, world("Material \"matte\" \"spectrum Kd\" \"a.spd\""), diagnostics, {1, 1, 0, 0}, {{"a.spd", content}}};
}

std::vector<HostileCase> file_names() {
  return {
      ply_case("PlyMissing", "gone.ply",
               R"(scene.pbrt:2:1: error: plymesh "gone.ply": no such file; the shape is skipped
)"),
      ply_case("PlyMissingInAMissingFolder", "no/such/folder/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "no/such/folder/a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameLeadsOutOfTheFilesystem", "../../../../../../../../../../../../gone.ply",
               R"(scene.pbrt:2:1: error: plymesh "/gone.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameAbsolute", "/nonexistent/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "/nonexistent/a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameOfADevice", "/dev/zero",
               R"(scene.pbrt:2:1: error: plymesh "/dev/zero": is not a regular file; the shape is skipped
)"),
      ply_case("PlyNameOfWindows", "C:\\\\models\\\\a.ply",
               R"(scene.pbrt:2:1: error: plymesh "C:\models\a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameWithoutDoubledBackslashes", "models\\a.ply",
               R"(scene.pbrt:2:1: error: plymesh "models/a.ply": no such file; the shape is skipped
scene.pbrt:2:17: warning: file names have back-slashes, "models\a.ply"; read as slashes
)"),
      ply_case("PlyNameOfAFolder", ".",
               R"(scene.pbrt:2:1: error: plymesh "": is a directory, not a file; the shape is skipped
)"),
      ply_case("PlyNameWithAFileAsFolder", "scene.pbrt/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "scene.pbrt/a.ply": cannot open: Not a directory; the shape is skipped
)"),
      ply_case("PlyNameWithSpaces", " a.ply ",
               R"(scene.pbrt:2:1: error: plymesh " a.ply ": no such file; the shape is skipped
)"),
      ply_case("PlyNameEmpty", "", R"(scene.pbrt:2:17: error: empty file name; nothing is read
)"),
      ply_case("PlyNameLooksLikeAnAddress", "http://example.org/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "http:/example.org/a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameWithAPercentSign", "%s%n.ply",
               R"(scene.pbrt:2:1: error: plymesh "%s%n.ply": no such file; the shape is skipped
)"),
      with(ply_case("PlyNameOutsideConfined", "../a.ply",
                    R"(scene.pbrt:2:17: error: file name "../a.ply" leads out of the scene's folder; it is not read
)"),
           confined()),
      with(ply_case("PlyNameAbsoluteConfined", "/dev/null",
                    R"(scene.pbrt:2:17: error: file name "/dev/null" leads out of the scene's folder; it is not read
)"),
           confined()),
      with(ply_case("PlyNameBackslashesConfined", "..\\\\a.ply",
                    R"(scene.pbrt:2:1: error: plymesh "..\a.ply": no such file; the shape is skipped
)"),
           confined()),
      {"PlyWithoutName",
       world("Shape \"plymesh\""),
       R"(scene.pbrt:2:1: error: plymesh without a "string filename"; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyWithTwoNames",
       world("Shape \"plymesh\" \"string filename\" [ \"a.ply\" \"b.ply\" ]"),
       R"(scene.pbrt:2:1: error: plymesh takes one file name, found 2; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyNameMisspelled",
       world("Shape \"plymesh\" \"string file\" \"a.ply\""),
       R"(scene.pbrt:2:1: error: plymesh without a "string filename"; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyMissingThreeTimes",
       world(ply_shape("gone.ply") + ply_shape("./gone.ply") + ply_shape("x/../gone.ply")),
       R"(scene.pbrt:2:1: error: plymesh "gone.ply": no such file; the shape is skipped (3 times, first here)
)",
       {1, 1, 3, 0}},
      {"PlyMissingInAnObject",
       world("ObjectBegin \"o\" " + ply_shape("gone.ply") + "ObjectEnd\nObjectInstance \"o\"\nObjectInstance \"o\""),
       R"(scene.pbrt:2:17: error: plymesh "gone.ply": no such file; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyMissingInAnInclude",
       world("Include \"a\""),
       R"(a:2:3: error: plymesh "gone.ply": no such file; the shape is skipped
  included from scene.pbrt:2:1
)",
       {1, 1, 1, 0},
       {{"a", "\n  " + ply_shape("gone.ply")}}},
      spd_case("SpectrumFileEmpty", "",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileOfText", "400 red\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileOddCount", "400 1 500\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileNotANumber", "400 nan 500 1\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": its values are not finite
)"),
      spd_case("SpectrumFileWithCommas", "400, 1\n500, 1\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileGzipped", gzip("400 0.5\n700 0.5\n"), ""),
      spd_case(
          "SpectrumFileTooLarge", gzip(std::string(17 << 20, ' ')),
          R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": content exceeds the limit of 16777216 bytes for this file
)"),
      {"SpectrumFileMissing",
       world("Material \"matte\" \"spectrum Kd\" \"gone.spd\""),
       R"(scene.pbrt:2:18: error: cannot read spectrum file "gone.spd": no such file
)",
       {1, 1, 0, 0}},
      {"SpectrumFileOfAKnownMetalMissing",
       world("Material \"metal\" \"spectrum eta\" \"Au.eta.spd\""),
       "",
       {1, 1, 0, 0}},
      {"SpectrumFileOfAKnownMetalDamaged",
       world("Material \"metal\" \"spectrum eta\" \"Au.eta.spd\""),
       R"(scene.pbrt:2:18: error: cannot read spectrum file "Au.eta.spd": not a list of wavelength and value pairs
)",
       {1, 1, 0, 0},
       {{"Au.eta.spd", "gold"}}},
  };
}

const bool kRegistered = register_cases("HostileImages", images(), __FILE__) &&
                         register_cases("HostileIncludes", includes(), __FILE__) &&
                         register_cases("HostileFileNames", file_names(), __FILE__);

// What a table cannot hold: things that are no files.

std::string listed_folders(int count) {
  std::string path;
  for (int i = 0; i < count; ++i) path += "a/";
  return path;
}

void make_fifo(const SceneFolder& folder, const char* name) {
  ASSERT_EQ(::mkfifo((folder.path() / name).c_str(), 0600), 0);
}

TEST(HostileFiles, FifosAreNotWaitedFor) {
  const SceneFolder folder;
  make_fifo(folder, "fifo");
  const Imported imported =
      import_text(folder, world("Include \"fifo\"\n" + ply_shape("fifo") +
                                "Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"fifo\"\n"
                                "Material \"matte\" \"spectrum Kd\" \"fifo\""));
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene.pbrt:2:1: error: cannot include \"fifo\": is not a regular file\n"
            "scene.pbrt:3:1: error: plymesh \"fifo\": is not a regular file; the shape is skipped\n"
            "scene.pbrt:4:32: error: texture file \"fifo\" is not a regular file; it counts as white\n"
            "scene.pbrt:5:18: error: cannot read spectrum file \"fifo\": is not a regular file\n");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
}

TEST(HostileFiles, LinksThatLeadOutOfTheFolderAreNotFollowedWhenConfined) {
  const SceneFolder folder;
  folder.write("secret.ply", kPly);
  const auto scene = folder.write("scene/scene.pbrt", world(ply_shape("link.ply")));
  std::filesystem::create_symlink("../secret.ply", folder.path() / "scene/link.ply");
  EXPECT_EQ(import_file(scene).scene.shapes.size(), 2u);
  const Imported imported = import_file(scene, confined());
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene/scene.pbrt:2:17: error: file name \"link.ply\" leads out of the scene's folder; it is not read\n");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
}

TEST(HostileFiles, LinksInACircleEnd) {
  const SceneFolder folder;
  std::filesystem::create_symlink("b.ply", folder.path() / "a.ply");
  std::filesystem::create_symlink("a.ply", folder.path() / "b.ply");
  const Imported imported = import_text(folder, world(ply_shape("a.ply")));
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene.pbrt:2:1: error: plymesh \"a.ply\": cannot open: Too many levels of symbolic links; the shape is "
            "skipped\n");
}

TEST(HostileFiles, LongNamesAreCutInMessages) {
  const SceneFolder folder;
  for (const std::string& name : {std::string(5000, 'a'), listed_folders(3000) + "a.ply"}) {
    const Imported imported = import_text(folder, world(ply_shape(name)));
    ASSERT_EQ(imported.diagnostics.size(), 1u);
    const std::string& message = imported.diagnostics[0].message;
    EXPECT_TRUE(message.starts_with("plymesh \"" + folder.path().string() + "/a"));
    EXPECT_TRUE(message.ends_with("...\": cannot open: File name too long; the shape is skipped"));
    EXPECT_LT(message.size(), 4200u);
    EXPECT_EQ(kept_of(imported), (Kept{1, 1, 1, 0}));
  }
}

/// The text of the Error that importing main_file throws.
std::string refusal_of(const std::filesystem::path& main_file) {
  try {
    (void)import_file(main_file);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return "accepted";
}

TEST(HostileFiles, MainFileMustBeAFile) {
  const SceneFolder folder;
  make_fifo(folder, "fifo");
  EXPECT_EQ(without_folder(refusal_of(folder.path() / "fifo"), folder), "fifo: is not a regular file");
  EXPECT_EQ(without_folder(refusal_of(folder.path() / ""), folder), ": is a directory, not a file");
  EXPECT_EQ(refusal_of("/dev/zero"), "/dev/zero: is not a regular file");
  EXPECT_EQ(refusal_of(""), ": no such file");
  EXPECT_EQ(without_folder(refusal_of(folder.path() / std::string(300, 'x')), folder),
            std::string(300, 'x') + ": cannot open: File name too long");
}

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
  for (size_t row = 0; row < kSide; ++row) rows[row * (1 + kSide / 8)] = 0; // each begins with its filter
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
  for (const auto& [name, content] : {std::pair<std::string, std::string>{"a.png", good_png()},
                                      {"a.tga", tga(3, 2, 6)},
                                      {"a.exr", exr()}}) {
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
