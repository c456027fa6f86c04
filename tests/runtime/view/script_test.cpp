#include "runtime/view/script.h"

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/runtime/view/view_bench.h"

namespace packtrace {
namespace {

using test::ViewBench;

class RecordingHost : public ScriptHost {
public:
  void save_pane(ViewSession&, size_t, const std::vector<std::string>& files) override { saved = files; }
  void save_screen(ViewSession&, const std::string& file) override { saved = {file}; }
  void save_text(const std::string&, const std::string& content) override { text = content; }
  void report(const nlohmann::json& result) override { results.push_back(result); }

  std::vector<std::string> saved;
  std::string text;
  std::vector<nlohmann::json> results;
};

/// Runs a script on a new session; returns the message of its failure, or "".
std::string failure_of(const std::string& script, RecordingHost& host) {
  const ViewBench bench;
  ViewSession session = bench.session();
  ViewControls controls(session);
  Progress progress;
  try {
    run_script(parse_script(script, "a.jsonl"), "a.jsonl", session, controls, host, progress);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
    return error.what();
  }
  return {};
}

TEST(Script, ActionsRunInTheirOrder) {
  RecordingHost host;
  EXPECT_EQ(failure_of("# a comment\n\n{\"frames\": 2}\n{\"key\": \"w\", \"frames\": 3}\n{\"still\": 4}\n"
                       "{\"report\": true}\n{\"pick\": [24, 16]}\n{\"screenshot\": [\"a.png\", \"a.exr\"]}\n",
                       host),
            "");
  ASSERT_EQ(host.results.size(), 3u);
  EXPECT_EQ(host.results[0].at("report").at("still_frames"), 4);
  EXPECT_TRUE(host.results[1].at("pick").at("hit"));
  const auto command = host.results[2].at("command").get<std::vector<std::string>>();
  EXPECT_EQ(command[2], "ball.pbrt");
  EXPECT_EQ(host.saved, (std::vector<std::string>{"a.png", "a.exr"}));
}

TEST(Script, EveryActionHasAnExampleThatWorks) {
  RecordingHost host;
  EXPECT_EQ(failure_of(
                "{\"select\": [24, 16]}\n{\"move\": [0, 1, 0]}\n{\"keys\": \"moved.json\"}\n{\"move\": null}\n"
                "{\"view\": \"depth\", \"pane\": 1}\n{\"set\": {\"ao.lambda\": 3, \"jitter\": false}}\n"
                "{\"set\": {\"ao-rate\": \"checkerboard\"}, \"pane\": 1}\n{\"file\": 0, \"pane\": 1}\n"
                "{\"split\": \"divider\", \"divider\": 0.3}\n{\"size\": [20, 10]}\n{\"quality\": 2}\n"
                "{\"drag\": [10, 4], \"button\": \"right\", \"frames\": 2}\n{\"quality\": null}\n{\"wheel\": -1}\n"
                "{\"camera\": {\"position\": [0, 2, -7], \"fov\": 40}}\n{\"frames\": 1}\n{\"pivot\": [10, 5]}\n"
                "{\"target_ms\": 0}\n{\"time\": null}\n{\"record\": true}\n{\"frames\": 3}\n"
                "{\"record\": \"path.json\"}\n{\"view\": \"ao\", \"pane\": 1}\n{\"split\": \"difference\", "
                "\"gain\": 4}\n{\"still\": 2}\n{\"metrics\": true}\n{\"screen\": \"s.png\"}\n{\"camera\": \"start\"}\n",
                host),
            "");
  EXPECT_NE(host.text.find("position"), std::string::npos);
  EXPECT_TRUE(host.results.back().at("metrics").contains("rmse"));
}

TEST(Script, MistakesAreNamedWithLineFieldAndNearestName) {
  const std::pair<const char*, const char*> cases[] = {
      {"{\"frames\": 1}\n{\"frame\": 1}", "a.jsonl:2: frame: no such field; did you mean frames?"},
      {"{\"frames\": 0}", "a.jsonl:1: frames: must be a whole number from 1"},
      {"{\"frames\": 1.5}", "a.jsonl:1: frames: must be a whole number"},
      {"\n{\"frames\": }", "a.jsonl:2: column 12: not JSON"},
      {"{\"frames\": 1e400}", "a.jsonl:1: a number is too large"},
      {"[1]", "a.jsonl:1: must be an object"},
      {"{}", "a.jsonl:1: no action; actions are frames, still"},
      {"{\"still\": 1, \"pick\": [0, 0]}", "a.jsonl:1: pick and still: a line has one action"},
      {"{\"still\": 1, \"pane\": 0}", "a.jsonl:1: pane: has no meaning with still"},
      {"{\"key\": \"w\", \"frames\": \"x\"}", "a.jsonl:1: frames: must be a number"},
      {"{\"key\": \"ente\"}", "a.jsonl:1: key: no such key: ente; did you mean enter?"},
      {"{\"key\": \"p\"}", "a.jsonl:1: key: p is a key of the window"},
      {"{\"view\": \"dept\"}", "a.jsonl:1: view: no such view: dept; did you mean depth?"},
      {"{\"set\": {\"ao.lambda\": 99}}", "a.jsonl:1: ao.lambda: ambient occlusion: lambda is 99"},
      {"{\"set\": {\"ao.lamda\": 1}}", "a.jsonl:1: ao.lamda: "},
      {"{\"camera\": {\"positon\": [0, 0, 0]}}", "a.jsonl:1: camera.positon: no such field; did you mean position?"},
      {"{\"camera\": {\"position\": [0, 1]}}", "a.jsonl:1: camera.position: must be a list of 3 numbers"},
      {"{\"camera\": {\"up\": [0, 0, 0]}}", "a.jsonl:1: camera: camera: up is parallel"},
      {"{\"pick\": [48, 5]}", "a.jsonl:1: pick: pixel 48, 5 is outside"},
      {"{\"metrics\": true}", "a.jsonl:1: metrics: two views are needed"},
      {"{\"split\": \"both\"}", "a.jsonl:1: split: must be off, divider or difference"},
      {"{\"size\": [0, 5]}", "a.jsonl:1: size: image size must be at least 1x1"},
      {"{\"record\": \"a.json\"}", "a.jsonl:1: record: nothing was recorded"},
      {"{\"key\": \"c\"}\n{\"still\": 2}", "a.jsonl:2: still: something moves on its own"},
      {"{\"time\": 1}", "a.jsonl:1: time: nothing moves in ball.pbrt"},
      {"{\"select\": [24, 0]}", "a.jsonl:1: select: this pixel shows nothing"},
      {"{\"move\": [0, 1, 0]}", "a.jsonl:1: move: nothing is picked"},
      {"{\"select\": [24, 30]}\n{\"move\": [0, 1, 0]}", "a.jsonl:2: move: \"quad\" is part of the world's geometry"},
      {"{\"keys\": \"a.json\"}", "a.jsonl:1: keys: nothing was moved"},
      {"{\"view\": \"pbr\"}", "a.jsonl:1: view: pbr: ball.pbrt holds no materials and lights"},
      {"{\"file\": 3}", "a.jsonl:1: file: there is no file 3"},
  };
  for (const auto& [script, message] : cases) {
    RecordingHost host;
    const std::string failure = failure_of(script, host);
    EXPECT_EQ(failure.substr(0, std::string(message).size()), message) << script;
  }
}

} // namespace
} // namespace packtrace
