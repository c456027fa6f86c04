#include "runtime/commands/commands.h"

#include <array>
#include <cmath>

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/file_bytes.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/image/exr.h"
#include "runtime/image/png.h"
#include "tests/runtime/image/image_test_support.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

constexpr ImageSize kSize{24, 16};

struct Comparison {
  int code = -1;
  std::string out, err;
  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

Comparison compare(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"packtrace", "compare"});
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  CLI::App app("test");
  GlobalOptions globals;
  add_compare_command(app, globals);
  Comparison result;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  result.code = run_verbs(app, globals, static_cast<int>(argv.size()), argv.data());
  std::fflush(stdout);
  result.out = testing::internal::GetCapturedStdout();
  result.err = testing::internal::GetCapturedStderr();
  return result;
}

std::string write_ao(const std::filesystem::path& path, const std::vector<float>& ao) {
  const std::array layers{Layer{"ao", {""}, std::span<const float>(ao)},
                          Layer{"depth", {""}, std::span<const float>(ao)}};
  write_file_bytes(path, encode_exr(kSize, layers));
  return path.string();
}

TEST(CompareCommand, EqualImagesPassEveryLimit) {
  const TemporaryFolder folder;
  const std::string a = write_ao(folder / "a.exr", noise_image(kSize, 1, 1).data);
  const Comparison result = compare({a, a, "--json", "-", "--max-rmse", "0", "--max-mae", "0", "--min-psnr", "100",
                                     "--min-ssim", "1", "--max-flip", "0", "--max-mismatch", "0"});
  EXPECT_EQ(result.code, 0) << result.err;
  const nlohmann::json json = result.json();
  EXPECT_EQ(json["identical"], true);
  EXPECT_EQ(json["passed"], true);
  EXPECT_EQ(json["layer"], "ao");
  EXPECT_EQ(json["metrics"]["rmse"], 0.0);
  EXPECT_EQ(json["metrics"]["ssim"], 1.0);
  EXPECT_TRUE(json["metrics"]["psnr_db"].is_null());
  EXPECT_EQ(json["limits"].size(), 6u);
}

TEST(CompareCommand, EachLimitCanFail) {
  const TemporaryFolder folder;
  const std::string a = write_ao(folder / "a.exr", std::vector<float>(kSize.pixels(), 0.5f));
  const std::string b = write_ao(folder / "b.exr", std::vector<float>(kSize.pixels(), 0.75f));
  for (const auto& [option, pass, fail] : {std::array{"--max-rmse", "0.2501", "0.2499"},
                                           {"--max-mae", "0.2501", "0.2499"},
                                           {"--min-psnr", "12.04", "12.05"},
                                           {"--min-ssim", "0.92", "0.93"},
                                           {"--max-flip", "0.7", "0.1"}}) {
    EXPECT_EQ(compare({a, b, option, pass}).code, 0) << option;
    const Comparison failed = compare({a, b, option, fail, "--json", "-"});
    EXPECT_EQ(failed.code, 5) << option;
    EXPECT_EQ(failed.json()["passed"], false);
    EXPECT_NE(failed.err.find("beyond the limit"), std::string::npos) << failed.err;
  }
}

TEST(CompareCommand, MissesAreLeftOutAndMismatchesReported) {
  const TemporaryFolder folder;
  std::vector<float> a(kSize.pixels(), 0.5f), b = a;
  a[0] = b[0] = kInvalidAo; // no value in either image
  b[1] = kInvalidAo;        // no value in one image
  const std::string file_a = write_ao(folder / "a.exr", a), file_b = write_ao(folder / "b.exr", b);
  const Comparison result = compare({file_a, file_b, "--json", "-"});
  EXPECT_EQ(result.code, 0);
  const nlohmann::json json = result.json();
  EXPECT_EQ(json["compared_pixels"], kSize.pixels() - 2);
  EXPECT_EQ(json["mismatched_pixels"], 1u);
  EXPECT_EQ(json["identical"], false);
  EXPECT_EQ(json["metrics"]["rmse"], 0.0);
  EXPECT_NE(result.err.find("1 pixels have a value in only one"), std::string::npos) << result.err;
  EXPECT_EQ(compare({file_a, file_b, "--max-mismatch", "0.001"}).code, 5);
  EXPECT_EQ(compare({file_a, file_b, "--max-mismatch", "0.01"}).code, 0);
  // In other layers -1 is an ordinary value.
  EXPECT_EQ(compare({file_a, file_b, "--layer", "depth", "--metric", "mae", "--json", "-"}).json()["metrics"]["mae"],
            1.5 / static_cast<double>(kSize.pixels()));
}

TEST(CompareCommand, PngAndExrOfTheSameAoAgree) {
  const TemporaryFolder folder;
  Image ao = noise_image(kSize, 1, 4);
  const std::string png = folder / "a.png", rgb = folder / "rgb.png";
  write_png(png, ao, PngTransfer::kSrgb);
  write_png(rgb, grey_to_rgb(ao), PngTransfer::kSrgb);
  ao.data[7] = kInvalidAo;
  const std::string exr = write_ao(folder / "a.exr", ao.data);
  for (const std::string& picture : {png, rgb}) {
    const Comparison result = compare({picture, exr, "--json", "-", "--max-mae", "0.004"});
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(result.json()["compared_pixels"], kSize.pixels() - 1);
    EXPECT_EQ(result.json()["mismatched_pixels"], 0u);
  }
}

TEST(CompareCommand, AlphaIsIgnored) {
  const TemporaryFolder folder;
  Image a = noise_image(kSize, 4, 1);
  write_png(folder / "a.png", a, PngTransfer::kSrgb);
  for (size_t i = 3; i < a.data.size(); i += 4) a.data[i] = 0.0f;
  write_png(folder / "b.png", a, PngTransfer::kSrgb);
  const Comparison result = compare({folder / "a.png", folder / "b.png", "-v", "--max-rmse", "0"});
  EXPECT_EQ(result.code, 0);
  EXPECT_NE(result.err.find("alpha"), std::string::npos);
}

TEST(CompareCommand, WritesADifferencePictureOnce) {
  const TemporaryFolder folder;
  std::vector<float> b(kSize.pixels(), 0.5f);
  const std::string file_a = write_ao(folder / "a.exr", b);
  b[5] = 1.0f;
  const std::string file_b = write_ao(folder / "b.exr", b), diff = folder / "diff.png";
  EXPECT_EQ(compare({file_a, file_b, "--diff", diff, "--max-mae", "0"}).code, 5)
      << "the difference picture is written although the limit is exceeded";
  const Image picture = read_png(diff, PngTransfer::kRaw);
  EXPECT_EQ(picture.size, kSize);
  EXPECT_EQ(picture.pixel(5, 0)[2], 1.0f) << "errors above 0.25 are white";
  EXPECT_EQ(picture.pixel(6, 0)[0], 0.0f);
  EXPECT_EQ(compare({file_a, file_b, "--diff", diff}).code, 6) << "it exists already";
  for (const char* metric : {"rmse", "psnr", "ssim", "flip"})
    EXPECT_EQ(compare({file_a, file_b, "--diff", diff, "--force", "--diff-metric", metric}).code, 0);
  EXPECT_EQ(folder.files(), 3u) << "no temporary file is left";
}

TEST(CompareCommand, SmallImagesSkipSsimUnlessItIsAskedFor) {
  const TemporaryFolder folder;
  const std::string a = folder / "a.png";
  write_png(a, Image({4, 4}, 1, 0.5f), PngTransfer::kSrgb);
  const Comparison all = compare({a, a, "--json", "-"});
  EXPECT_EQ(all.code, 0);
  EXPECT_FALSE(all.json()["metrics"].contains("ssim"));
  EXPECT_TRUE(all.json()["metrics"].contains("flip"));
  EXPECT_EQ(compare({a, a, "--metric", "ssim"}).code, 3);
  EXPECT_EQ(compare({a, a, "--min-ssim", "0.5"}).code, 3);
}

TEST(CompareCommand, OnlyTheMetricsAskedForAreComputed) {
  const TemporaryFolder folder;
  const std::string a = write_ao(folder / "a.exr", noise_image(kSize, 1, 1).data);
  const nlohmann::json metrics = compare({a, a, "--json", "-", "--metric", "mae,psnr"}).json()["metrics"];
  EXPECT_EQ(metrics.size(), 2u);
  EXPECT_TRUE(metrics.contains("mae") && metrics.contains("psnr_db"));
}

TEST(CompareCommand, BadInputHasTheRightExitCode) {
  const TemporaryFolder folder;
  const std::string a = write_ao(folder / "a.exr", noise_image(kSize, 1, 1).data), small = folder / "small.png";
  write_png(small, Image({4, 4}, 1), PngTransfer::kSrgb);
  EXPECT_EQ(compare({a, small}).code, 3) << "sizes differ";
  EXPECT_EQ(compare({a, folder / "missing.exr"}).code, 3);
  EXPECT_EQ(compare({a, a, "--layer", "nothing"}).code, 3);
  EXPECT_EQ(compare({small, small, "--layer", "depth"}).code, 3);
  EXPECT_EQ(compare({a}).code, 2);
  EXPECT_EQ(compare({a, a, "--metric", "vmaf"}).code, 2);
  for (const char* limit : {"nan", "-1", "inf", "x", "1e400", ""})
    EXPECT_EQ(compare({a, a, "--max-rmse", limit}).code, 2) << limit;
  EXPECT_EQ(compare({a, a, "--min-ssim", "2"}).code, 2);
  EXPECT_EQ(compare({a, a, "--ppd", "0"}).code, 2);
  EXPECT_EQ(compare({a, a, "--json", folder / "no" / "folder.json"}).code, 6);
}

TEST(CompareCommand, TextIsForPeopleAndQuietIsQuiet) {
  const TemporaryFolder folder;
  const std::string a = write_ao(folder / "a.exr", noise_image(kSize, 1, 1).data);
  EXPECT_NE(compare({a, a, "--max-rmse", "1"}).out.find("limit rmse 1: ok"), std::string::npos);
  const Comparison quiet = compare({a, a, "-q"});
  EXPECT_EQ(quiet.out + quiet.err, "");
}

} // namespace
} // namespace packtrace
