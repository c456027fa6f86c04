// Pictures of layers, denoised as users do it.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/file_bytes.h"
#include "runtime/image/exr.h"
#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Rendered pictures of the small scene that are not denoised.
class DenoiseBench : public Workbench {
public:
  void render(const std::string& output, const std::vector<std::string>& options = {}) const {
    std::vector<std::string> arguments{"render", scene(), "--size", "48x32", "-o", output, "-q", "--force"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const CommandResult result = run_packtrace(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  void render_sequence(int pictures) const {
    render(*this / "in_%02d.exr",
           {"--path", "orbit:8", "--frames", std::to_string(pictures), "--subframes", "1", "--denoiser", "off"});
  }
  CommandResult denoise(const std::vector<std::string>& options) const {
    std::vector<std::string> arguments{"denoise"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_packtrace(arguments);
  }
  std::vector<float> layer(const std::string& name, const std::string& layer_name) const {
    return read_exr(*this / name, layer_name).data;
  }
};

bool says(const CommandResult& result, const std::string& part) { return result.err.find(part) != std::string::npos; }

/// A picture with the given channels, all 0.5.
void write_channels(const std::string& file, const std::vector<std::string>& channels, ImageSize size = {8, 8}) {
  const std::vector<float> values(size.pixels(), 0.5f);
  std::vector<Layer> layers;
  for (const std::string& channel : channels) layers.push_back({channel, {""}, std::span<const float>(values)});
  write_file_bytes(file, encode_exr(size, layers));
}

const std::vector<std::string> kChannels{"ao", "depth", "normal.X", "normal.Y", "normal.Z"};

TEST(Denoise, OneFrameIsWhatRenderDenoises) {
  const DenoiseBench bench;
  bench.render(bench / "in.exr", {"--frames", "1", "--denoiser", "off"});
  bench.render(bench / "truth.exr", {"--frames", "1"});
  const CommandResult result =
      bench.denoise({bench / "in.exr", "-o", bench / "out.exr", "--json", bench / "a.json", "--stratified"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::vector<float> in = bench.layer("in.exr", "ao"), out = bench.layer("out.exr", "ao");
  const std::vector<float> truth = bench.layer("truth.exr", "ao");
  double largest = 0.0, noise = 0.0;
  for (size_t i = 0; i < out.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(out[i] - truth[i])));
    noise = std::max(noise, std::abs(static_cast<double>(in[i] - truth[i])));
  }
  EXPECT_LT(largest, 0.01) << "normals are stored with 16 bits";
  EXPECT_GT(noise, 0.1);
  EXPECT_EQ(bench.layer("out.exr", "albedo"), bench.layer("in.exr", "albedo"));
  const Json report = Json::parse(read_text(bench / "a.json"));
  EXPECT_EQ(report.at("verb"), "denoise");
  EXPECT_EQ(report.at("channels").at("ao"), Json({"ao"}));
  EXPECT_EQ(report.at("denoiser").at("preset"), "ours");
  EXPECT_EQ(report.at("list")[0].at("history_start"), "first");
}

TEST(Denoise, SequencesCarryTheirHistory) {
  const DenoiseBench bench;
  bench.render_sequence(4);
  const CommandResult result = bench.denoise(
      {bench / "in_%02d.exr", "-o", bench / "out_%02d.exr", "-o", bench / "out_%02d.png", "--json", bench / "a.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(read_text(bench / "a.json"));
  EXPECT_EQ(report.at("pictures"), 4);
  EXPECT_EQ(report.at("shots"), 1);
  for (const char* name : {"out_00.exr", "out_03.exr", "out_00.png", "out_03.png"})
    EXPECT_TRUE(fs::exists(bench / name)) << name;
  const auto cut =
      bench.denoise({bench / "in_%02d.exr", "-o", bench / "cut_%02d.exr", "--cut", "2", "--json", bench / "b.json"});
  ASSERT_EQ(cut.exit_code, 0) << cut.err;
  const Json list = Json::parse(read_text(bench / "b.json")).at("list");
  EXPECT_EQ(list[2].at("history_start"), "cut");
  EXPECT_EQ(list[2].at("history"), 1.0);
  EXPECT_EQ(bench.layer("cut_01.exr", "ao"), bench.layer("out_01.exr", "ao"));
  EXPECT_NE(bench.layer("cut_02.exr", "ao"), bench.layer("out_02.exr", "ao"));
  EXPECT_EQ(bench.denoise({bench / "in_%02d.exr", "-o", bench / "c_%02d.exr", "--cut", "9"}).exit_code, 2);
}

TEST(Denoise, SomePicturesOfASequenceCanBeChosen) {
  const DenoiseBench bench;
  bench.render_sequence(4);
  ASSERT_EQ(
      bench.denoise({bench / "in_%02d.exr", "-o", bench / "a_%02d.exr", "--start", "1", "--frames", "2"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(bench / "a_01.exr") && fs::exists(bench / "a_02.exr"));
  EXPECT_FALSE(fs::exists(bench / "a_00.exr") || fs::exists(bench / "a_03.exr"));
  ASSERT_EQ(bench.denoise({bench / "in_03.exr", bench / "in_02.exr", "-o", bench / "b_%d.exr"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(bench / "b_0.exr") && fs::exists(bench / "b_1.exr"));
  fs::remove(bench / "in_02.exr");
  const CommandResult gap = bench.denoise({bench / "in_%02d.exr", "-o", bench / "c_%02d.exr"});
  EXPECT_EQ(gap.exit_code, 3);
  EXPECT_TRUE(says(gap, "in_02.exr: this picture of the sequence is missing, but there is")) << gap.err;
  const CommandResult none = bench.denoise({bench / "no_%02d.exr", "-o", bench / "c_%02d.exr"});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_TRUE(says(none, "no_%02d.exr")) << none.err;
  EXPECT_FALSE(fs::exists(bench / "c_00.exr"));
}

TEST(Denoise, PicturesOfAStillViewMakeOnePicture) {
  const DenoiseBench bench;
  bench.render(bench / "in_%02d.exr", {"--path", "scene", "--frames", "8", "--subframes", "1", "--denoiser", "off"});
  bench.render(bench / "truth.exr", {"--frames", "8"});
  const CommandResult result = bench.denoise(
      {bench / "in_%02d.exr", "-o", bench / "out.exr", "--still", "--json", bench / "a.json", "--stratified"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Json::parse(read_text(bench / "a.json")).at("channels").at("ao"), Json({"ao_raw"}));
  const std::vector<float> out = bench.layer("out.exr", "ao_raw"), truth = bench.layer("truth.exr", "ao");
  double sum = 0.0;
  for (size_t i = 0; i < out.size(); ++i) sum += std::abs(static_cast<double>(out[i] - truth[i]));
  EXPECT_LT(sum / static_cast<double>(out.size()), 0.005);
  EXPECT_EQ(bench.denoise({bench / "in_%02d.exr", "-o", bench / "b.exr"}).exit_code, 2) << "which picture?";
}

TEST(Denoise, PicturesOfManySamplesKeepTheirDetail) {
  const DenoiseBench bench;
  bench.render(bench / "in.exr", {"--frames", "1", "--spp", "16", "--denoiser", "off", "--no-jitter"});
  bench.render(bench / "truth.exr", {"--frames", "64", "--spp", "16", "--denoiser", "off", "--no-jitter"});
  const std::vector<float> truth = bench.layer("truth.exr", "ao");
  const auto error = [&](const char* samples) {
    const CommandResult result = bench.denoise({bench / "in.exr", "-o", bench / "out.exr", "--stratified", "--samples",
                                                samples, "--json", bench / "a.json", "--force"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(read_text(bench / "a.json")).at("samples"), std::stoi(samples));
    const std::vector<float> out = bench.layer("out.exr", "ao");
    double sum = 0.0;
    for (size_t i = 0; i < out.size(); ++i) sum += std::pow(static_cast<double>(out[i] - truth[i]), 2.0);
    return std::sqrt(sum / static_cast<double>(out.size()));
  };
  EXPECT_LT(error("16"), 0.9 * error("1"));
  EXPECT_EQ(bench.denoise({bench / "in.exr", "-o", bench / "b.exr", "--samples", "4", "--still"}).exit_code, 2);
  for (const char* const wrong : {"0", "65537", "1.5", "-1", "x"})
    EXPECT_EQ(bench.denoise({bench / "in.exr", "-o", bench / "b.exr", "--samples", wrong}).exit_code, 2) << wrong;
}

TEST(Denoise, LayersAreChosenAsInRender) {
  const DenoiseBench bench;
  bench.render(bench / "in.exr", {"--frames", "1", "--denoiser", "off"});
  ASSERT_EQ(bench.denoise({bench / "in.exr", "-o", bench / "a.exr", "--aov", "ao,depth"}).exit_code, 0);
  EXPECT_EQ(exr_info(read_file_bytes(bench / "a.exr"), "a").layers.size(), 2u);
  ASSERT_EQ(bench.denoise({bench / "in.exr", "-o", bench / "b.png", "--aov", "ao,shaded"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(bench / "b.ao.png") && fs::exists(bench / "b.shaded.png"));
  write_channels(bench / "plain.exr", kChannels);
  const CommandResult none = bench.denoise({bench / "plain.exr", "-o", bench / "c.png", "--aov", "shaded"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_TRUE(says(none, "no layer for albedo; name it with --albedo")) << none.err;
  EXPECT_EQ(bench.denoise({bench / "plain.exr", "-o", bench / "c.exr", "--aov", "x"}).exit_code, 2);
}

TEST(Denoise, MissingLayersAreSaidWithWhatThereIs) {
  const DenoiseBench bench;
  write_channels(bench / "a.exr", {"ao", "depth", "bump"});
  const CommandResult result = bench.denoise({bench / "a.exr", "-o", bench / "b.exr"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_TRUE(says(result, "it has no layer for normal")) << result.err;
  EXPECT_TRUE(says(result, "--normal; its channels are ao, bump, depth")) << result.err;
  EXPECT_EQ(bench.denoise({bench / "a.exr", "-o", bench / "b.exr", "--normal", "bump,bump,bump"}).exit_code, 0);
}

TEST(Denoise, SizesMayChangeWithinASequence) {
  const DenoiseBench bench;
  write_channels(bench / "in_0.exr", kChannels);
  write_channels(bench / "in_1.exr", kChannels, {16, 4});
  const CommandResult result = bench.denoise({bench / "in_%d.exr", "-o", bench / "out_%d.exr"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(says(result, "in_1.exr: warning: another size than the picture before")) << result.err;
  EXPECT_TRUE(says(result, "no layer for motion (--motion)")) << result.err;
}

TEST(Denoise, WrongFilesAndOptionsAreRefused) {
  const DenoiseBench bench;
  const std::string good = bench / "a.exr", out = bench / "b.exr";
  write_channels(good, kChannels);
  const auto code = [&](const std::vector<std::string>& options) { return bench.denoise(options).exit_code; };
  EXPECT_EQ(code({good}), 2) << "no output";
  EXPECT_EQ(code({good, "-o", good, "--force"}), 2) << "the output is the input";
  EXPECT_EQ(code({good, "-o", bench / "b.jpg"}), 2);
  EXPECT_EQ(code({good, "-o", out, "--depth-kind", "distance"}), 2) << "no field of view";
  EXPECT_EQ(code({good, "-o", out, "--motion-scale", "1"}), 2);
  EXPECT_EQ(code({good, "-o", out, "--denoiser-set", "nothing=1"}), 2);
  EXPECT_EQ(code({good, "-o", out, "--frames", "3"}), 2);
  EXPECT_EQ(code({good, "-o", bench / "none/b.exr"}), 6) << "no folder";
  EXPECT_EQ(code({bench / "none.exr", "-o", out}), 3);
  write_text(bench / "text.exr", "no picture");
  EXPECT_EQ(code({bench / "text.exr", "-o", out}), 3);
  const std::string bytes = read_text(good);
  write_text(bench / "cut.exr", bytes.substr(0, bytes.size() - 20));
  const CommandResult cut = bench.denoise({bench / "cut.exr", "-o", out});
  EXPECT_EQ(cut.exit_code, 3);
  EXPECT_TRUE(says(cut, "cut.exr: ")) << cut.err;
  EXPECT_EQ(code({good, "-o", out, "--max-memory", "10K"}), 3);
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(code({good, "-o", out}), 0);
  EXPECT_EQ(code({good, "-o", out}), 6) << "it exists";
  EXPECT_EQ(code({good, "-o", out, "--force"}), 0);
}

TEST(Denoise, TheResultDoesNotDependOnTheThreads) {
  const DenoiseBench bench;
  bench.render_sequence(3);
  for (const char* threads : {"1", "3"})
    ASSERT_EQ(
        bench.denoise({bench / "in_%02d.exr", "-o", bench / (std::string(threads) + "_%02d.exr"), "--threads", threads})
            .exit_code,
        0);
  EXPECT_EQ(read_text(bench / "1_02.exr"), read_text(bench / "3_02.exr"));
}

} // namespace
} // namespace packtrace::test
