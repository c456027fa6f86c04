// Shaders of images and voxels, and options without effect.

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "runtime/image/png.h"
#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

class ImageBench : public Workbench {
public:
  ImageBench() {
    Image image(ImageSize{80, 40}, 3);
    for (uint32_t y = 0; y < 40; ++y)
      for (uint32_t x = 0; x < 80; ++x) {
        const std::span<float> pixel = image.pixel(x, y);
        pixel[0] = static_cast<float>(x) / 80.0f, pixel[1] = static_cast<float>(y) / 40.0f, pixel[2] = 0.25f;
      }
    const std::vector<std::byte> bytes = encode_png(image, PngTransfer::kSrgb);
    write_text(picture(), std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }
  std::string picture() const { return *this / "picture.png"; }
  CommandResult export_it(std::vector<std::string> more, const std::string& input = {}) const {
    more.insert(more.begin(), {"export", input.empty() ? picture() : input, "-o", *this / "x.glsl", "--force"});
    return run_packtrace(more);
  }
};

TEST(ShaderExport, AnImageBecomesAShaderWithItsError) {
  const ImageBench bench;
  for (const char* format : {"bit", "grey", "r2g4b2"}) {
    const CommandResult result = bench.export_it({"--image-format", format, "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const nlohmann::json report = nlohmann::json::parse(result.out);
    EXPECT_EQ(report.at("layout"), "glsl");
    EXPECT_EQ(report.at("format"), format);
    EXPECT_EQ(report.at("size"), nlohmann::json({80, 40}));
    EXPECT_GT(report.at("psnr_db"), 15.0);
    EXPECT_LE(report.at("elements"), 817);
    EXPECT_NE(read_text(bench / "x.glsl").find("mainImage"), std::string::npos);
  }
  const CommandResult text = bench.export_it({"--image-size", "20", "--shader", "glsl450"});
  EXPECT_NE(text.out.find("20 x 10 texels in 50 of 4,096 array elements"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("PSNR"), std::string::npos);
}

TEST(ShaderExport, WhatDoesNotFitIsRefusedWithTheLargestThatDoes) {
  const ImageBench bench;
  const CommandResult refused = bench.export_it({"--max-elements", "100"});
  EXPECT_EQ(refused.exit_code, 5);
  ASSERT_NE(refused.err.find("the largest that fits is --image-size 28"), std::string::npos) << refused.err;
  EXPECT_EQ(bench.export_it({"--max-elements", "100", "--image-size", "28"}).exit_code, 0);
  EXPECT_EQ(bench.export_it({"--max-elements", "100", "--image-size", "29"}).exit_code, 5);
  EXPECT_EQ(bench.export_it({"--image-size", "81"}).exit_code, 2);
  EXPECT_EQ(bench.export_it({"--image-size", "0"}).exit_code, 2);
}

/// 2 x 1 texels of 32 bits: opaque red, and blue of half the opacity.
std::string tga_with_alpha(char alpha_bits) {
  const std::string header{0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 32, alpha_bits};
  return header + std::string("\x00\x00\xff\xff\xff\x00\x00\x80", 8);
}

TEST(ShaderExport, AlphaIsNotLostWithoutAWarning) {
  const ImageBench bench;
  EXPECT_EQ(bench.export_it({}).err.find("warning"), std::string::npos);
  const std::string picture = bench / "alpha.tga";
  write_text(picture, tga_with_alpha(8));
  const CommandResult warned = bench.export_it({"--json", "-"}, picture);
  EXPECT_EQ(warned.exit_code, 0);
  EXPECT_NE(warned.err.find("alpha.tga: warning: alpha is ignored: 1 of 2 texels are not opaque"), std::string::npos)
      << warned.err;
  EXPECT_EQ(nlohmann::json::parse(warned.out).at("transparent_texels"), 1);
  write_text(picture, tga_with_alpha(0)); // the same bytes without a meaning
  EXPECT_EQ(bench.export_it({}, picture).err.find("warning"), std::string::npos);
}

TEST(ShaderExport, DamagedImagesAreRefused) {
  const ImageBench bench;
  const std::string whole = read_text(bench.picture()), cut = bench / "cut.png";
  for (size_t bytes = 0; bytes < whole.size(); bytes += whole.size() / 9) {
    write_text(cut, whole.substr(0, bytes));
    const CommandResult result = bench.export_it({}, cut);
    EXPECT_EQ(result.exit_code, 3) << bytes;
    EXPECT_NE(result.err.find(cut), std::string::npos) << result.err;
  }
  EXPECT_EQ(bench.export_it({}, bench.scene()).exit_code, 3); // a .pbrt file
  EXPECT_EQ(bench.export_it({}, bench / "absent.png").exit_code, 3);
}

TEST(ShaderExport, OptionsWithoutEffectAreErrors) {
  const ImageBench bench;
  bench.bake();
  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& name) {
    const CommandResult result = run_packtrace(arguments);
    EXPECT_EQ(result.exit_code, 2) << name << result.err;
    EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
  };
  for (const std::string option : {"--proxy-fill", "--proxy-dag", "--proxy-materials"})
    for (const std::string file : {"x.glb", "x.v16", "x.pbrt", "x.obj"})
      refused({"export", bench.baked(), "-o", bench / file, option}, option);
  for (const auto& [option, value] : {std::pair{"--up", "z"},
                                      {"--geometry", "0"},
                                      {"--shader", "glsl450"},
                                      {"--max-elements", "9"},
                                      {"--texture", "0"},
                                      {"--image-size", "9"},
                                      {"--image-format", "bit"},
                                      {"--proxy", "off"},
                                      {"--proxy-bits", "16"},
                                      {"--proxy-voxels", "9"},
                                      {"--proxy-surface", "thin"}})
    refused({"export", bench.baked(), "-o", bench / "x.glb", option, value}, option);
  refused({"export", bench.baked(), "-o", bench / "x.glsl", "--image-size", "9"}, "--image-size");
  refused({"export", bench.baked(), "-o", bench / "x.glsl", "--proxy", "off"}, "--proxy off");
  refused({"export", bench.picture(), "-o", bench / "x.glsl", "--proxy-fill"}, "--proxy-fill");
  refused({"export", bench.picture(), "-o", bench / "x.glsl", "--texture", "0"}, "--texture");
  refused({"bake", bench.scene(), "-o", bench / "x.ptk", "--proxy-fill"}, "--proxy-fill");
  for (const char* option : {"--no-legend", "--fast-edges", "--ao-no-falloff"})
    refused({"render", bench.baked(), "-o", bench / "x.png", "--view", "voxels", option}, option);
  refused({"render", bench.baked(), "-o", bench / "x.png", "--view", "sdf", "--proxy-beyond", "8"}, "--proxy-beyond");
  refused({"render", bench.baked(), "-o", bench / "x.png", "--proxy-error", "0.1"}, "--proxy-error requires");
  refused(
      {"bake", bench.scene(), "-o", bench / "x.ptk", "--proxy", "voxels", "--proxy-surface", "matched", "--proxy-fill"},
      "--proxy-fill has no effect");
  const CommandResult without =
      run_packtrace({"render", bench.baked(), "-o", bench / "x.png", "--frames", "1", "--proxy-beyond", "8"});
  EXPECT_EQ(without.exit_code, 4);
  EXPECT_NE(without.err.find("bake it with --proxy voxels"), std::string::npos) << without.err;
}

} // namespace
} // namespace packtrace::test
