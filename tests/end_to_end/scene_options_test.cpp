// Tests --world and --time on every verb that reads scenes, crop windows, and what info reports about a scene.

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/command.h"

namespace packtrace::test {
namespace {

/// A triangle that moves by 8 along x, then a second world with two static triangles.
constexpr const char* kScene = R"(Camera "perspective"
Film "image" "integer xresolution" 20 "integer yresolution" 10 "float cropwindow" [.25 .75 .2 .5] "string filename" "a.exr"
TransformTimes 2 4
WorldBegin
LightSource "infinite"
Material "glass"
ActiveTransform EndTime Translate 8 0 0 ActiveTransform All
Shape "trianglemesh" "integer indices" [0 1 2] "point P" [-1 -1 2  1 -1 2  0 1 2]
WorldEnd
WorldBegin
Shape "trianglemesh" "integer indices" [0 1 2] "point P" [-1 -1 2  1 -1 2  0 1 2]
Shape "trianglemesh" "integer indices" [0 1 2] "point P" [-1 -1 3  1 -1 3  0 1 3]
WorldEnd
)";

class SceneOptions : public testing::Test {
protected:
  SceneOptions() { write_text(scene_, kScene); }

  /// Runs a verb that must succeed and returns its JSON.
  static nlohmann::json json_of(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--json", "-"});
    const CommandResult result = run_packtrace(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out, nullptr, false);
  }

  TemporaryFolder directory_;
  std::string scene_ = directory_ / "scene.pbrt";
  std::string baked_ = directory_ / "scene.ptk";
  std::string image_ = directory_ / "image.png";
};

TEST_F(SceneOptions, InfoTellsOfTheFirstWorldAtItsStart) {
  const nlohmann::json info = json_of({"info", scene_});
  EXPECT_EQ(info["worlds"], 2);
  EXPECT_EQ(info["world"], 1);
  EXPECT_EQ(info["time"], 0.0);
  EXPECT_EQ(info["bounds"]["hi"][0], 1.0);
  EXPECT_EQ(info["shapes"], nlohmann::json({{"trianglemesh", 1}}));
  EXPECT_EQ(info["materials_by_kind"], nlohmann::json({{"glass", 1}}));
  EXPECT_EQ(info["animated"],
            nlohmann::json({{"shapes", 1}, {"instances", 0}, {"cameras", 0}, {"begin_s", 2.0}, {"end_s", 4.0}}));
  EXPECT_EQ(info["ignored"], nlohmann::json({{"light_sources", 1}}));
  ASSERT_EQ(info["camera_list"].size(), 1u);
  EXPECT_EQ(info["camera_list"][0]["projection"], "perspective");
  EXPECT_EQ(info["camera_list"][0]["width"], 10);
  EXPECT_EQ(info["camera_list"][0]["height"], 3);
  EXPECT_EQ(info["camera_list"][0]["fov"], 90.0);
}

TEST_F(SceneOptions, InfoSaysTheSameInText) {
  const CommandResult result = run_packtrace({"info", scene_, "--time", "3"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* part : {"shapes   trianglemesh 1   (0 skipped, 0 absent)", "materials by kind   glass 1\n",
                           "camera   perspective 10x3 \"a.exr\"\n", "world 1 of 2\n",
                           "animated   shapes 1   instances 0   cameras 0   from time 2 to 4 (shown at 3)\n",
                           "ignored   light sources 1\n"})
    EXPECT_NE(result.out.find(part), std::string::npos) << part << "\nis not in\n" << result.out;
}

TEST_F(SceneOptions, TimeAndWorldReachEveryVerb) {
  EXPECT_EQ(json_of({"info", scene_, "--time", "3"})["bounds"]["hi"][0], 5.0);
  EXPECT_EQ(json_of({"info", scene_, "--world", "2"})["triangles"], 2);
  EXPECT_NEAR(json_of({"bake", scene_, "-o", baked_, "--time", "4"})["bounds"]["hi"][0].get<double>(), 9.0, 0.1);
  EXPECT_EQ(json_of({"bake", scene_, "-o", baked_, "--force", "--world", "2"})["triangles"], 2);
  const auto hits = [&](const std::string& time) {
    return json_of({"render", scene_, "-o", image_, "--force", "--frames", "1", "--size", "16x16", "--camera", "0",
                    "--time", time})["hit_pixels"];
  };
  EXPECT_GT(hits("2"), 0);
  EXPECT_EQ(hits("4"), 0);
}

TEST_F(SceneOptions, RendersHaveTheSizeOfTheCropWindow) {
  const nlohmann::json rendered = json_of({"render", scene_, "-o", image_, "--frames", "1"});
  EXPECT_EQ(rendered["width"], 10);
  EXPECT_EQ(rendered["height"], 3);
}

TEST_F(SceneOptions, AMissingWorldIsAnInputErrorThatCountsThem) {
  for (const char* verb : {"info", "bake", "render"}) {
    std::vector<std::string> arguments = {verb, scene_, "--world", "3"};
    if (arguments[0] != "info") arguments.insert(arguments.end(), {"-o", arguments[0] == "bake" ? baked_ : image_});
    const CommandResult result = run_packtrace(arguments);
    EXPECT_EQ(result.exit_code, 3) << verb;
    EXPECT_NE(result.err.find("there is no world 3: the file has 2"), std::string::npos) << result.err;
  }
}

TEST_F(SceneOptions, NonsenseIsAUsageError) {
  for (const auto& [option, value] :
       {std::pair{"--world", "0"}, std::pair{"--world", "-1"}, std::pair{"--time", "nan"}, std::pair{"--time", "soon"}})
    EXPECT_EQ(run_packtrace({"info", scene_, option, value}).exit_code, 2) << option << ' ' << value;
}

TEST_F(SceneOptions, BakedFilesHaveNoneToChoose) {
  ASSERT_EQ(run_packtrace({"bake", scene_, "-o", baked_, "-q"}).exit_code, 0);
  for (const auto& [option, value] : {std::pair{"--world", "2"}, std::pair{"--time", "0"}}) {
    EXPECT_EQ(run_packtrace({"info", baked_, option, value}).exit_code, 2) << option;
    EXPECT_EQ(run_packtrace({"render", baked_, "-o", image_, option, value}).exit_code, 2) << option;
  }
}

} // namespace
} // namespace packtrace::test
