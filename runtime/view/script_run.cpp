#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"
#include "runtime/view/script.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxScriptFrames = 1'000'000;
constexpr double kFramesPerSecond = 60.0;

/// Runs the lines of a script one after another.
class ScriptRun {
public:
  ScriptRun(const std::string& name, ViewSession& session, ViewControls& controls, ScriptHost& host, Progress& progress)
      : name_(name), session_(session), controls_(controls), host_(host), progress_(progress) {}

  void run(const ScriptLine& line) {
    line_ = &line;
    field_ = line.action;
    value_ = &line.fields.at(line.action);
    try {
      if (!run_frames() && !run_input() && !run_camera() && !run_view() && !run_picture()) run_output();
    } catch (const Error& error) { // of the session: it names no place
      if (error.kind() == ErrorKind::kUsage) fail(error.what());
      throw;
    }
  }

private:
  [[noreturn]] void fail(const std::string& problem) const {
    fail_in_script(name_, line_->number, field_ + ": " + problem);
  }

  bool is(const char* action) const { return line_->action == action; }
  const nlohmann::json* other(const char* field) {
    const auto found = line_->fields.find(field);
    if (found == line_->fields.end()) return nullptr;
    field_ = field;
    return &*found;
  }
  double number(const nlohmann::json& value) const {
    if (!value.is_number() || !std::isfinite(value.get<double>())) fail("must be a number");
    return value.get<double>();
  }
  uint32_t whole(const nlohmann::json& value, uint32_t low, uint32_t high) const {
    const double n = number(value);
    if (!(n >= low && n <= high) || n != std::floor(n))
      fail(fmt::format("must be a whole number from {} to {}", low, high));
    return static_cast<uint32_t>(n);
  }
  std::string text(const nlohmann::json& value) const {
    if (!value.is_string()) fail("must be a text");
    return value.get<std::string>();
  }
  template <size_t N>
  std::array<double, N> numbers(const nlohmann::json& value) const {
    if (!value.is_array() || value.size() != N) fail(fmt::format("must be a list of {} numbers", N));
    std::array<double, N> result{};
    for (size_t i = 0; i < N; ++i) result[i] = number(value[i]);
    return result;
  }
  std::array<uint32_t, 2> pixel() const {
    if (!value_->is_array() || value_->size() != 2) fail("must be a list of 2 numbers");
    return {whole((*value_)[0], 0, 65535), whole((*value_)[1], 0, 65535)};
  }
  size_t pane() {
    const nlohmann::json* const value = other("pane");
    return value != nullptr ? whole(*value, 0, 1) : 0;
  }

  void frame() {
    controls_.advance(1.0 / kFramesPerSecond);
    if (!session_.step(progress_)) throw Error(ErrorKind::kCancelled, "cancelled");
  }
  void frames(uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) frame();
  }

  bool run_frames();
  bool run_input();
  bool run_camera();
  bool run_view();
  bool run_picture();
  void run_output();
  void set_settings();
  void set_camera();
  void split_view();
  void screenshot();
  void report_state();

  const std::string& name_;
  ViewSession& session_;
  ViewControls& controls_;
  ScriptHost& host_;
  Progress& progress_;
  const ScriptLine* line_ = nullptr;
  std::string field_; ///< of which the value is read, for messages
  const nlohmann::json* value_ = nullptr;
};

bool ScriptRun::run_frames() {
  if (is("frames")) {
    frames(whole(*value_, 1, kMaxScriptFrames));
  } else if (is("still")) {
    const uint32_t wanted = whole(*value_, 1, kMaxScriptFrames);
    if (controls_.busy()) fail("something moves on its own: the picture never stands still");
    do frame();
    while (session_.last().still_frames < wanted);
  } else {
    return false;
  }
  return true;
}

bool ScriptRun::run_input() {
  if (is("key")) {
    const std::string key = text(*value_);
    const nlohmann::json* const ctrl = other("ctrl");
    const bool with_ctrl = ctrl != nullptr && ctrl->is_boolean() && ctrl->get<bool>();
    field_ = "key";
    if (controls_.press(key, with_ctrl) != ViewRequest::kNone)
      fail(key + " is a key of the window; scripts have actions instead, such as screenshot and record");
    if (const nlohmann::json* const count = other("frames")) frames(whole(*count, 1, kMaxScriptFrames));
    controls_.release(key);
  } else if (is("drag")) {
    const auto [dx, dy] = numbers<2>(*value_);
    MouseButton button = MouseButton::kLeft;
    if (const nlohmann::json* const name = other("button")) {
      const std::string word = text(*name);
      if (word != "left" && word != "middle" && word != "right") fail("must be left, middle or right");
      button = word == "left" ? MouseButton::kLeft : word == "middle" ? MouseButton::kMiddle : MouseButton::kRight;
    }
    const nlohmann::json* const count = other("frames");
    const uint32_t steps = count != nullptr ? whole(*count, 1, kMaxScriptFrames) : 1;
    for (uint32_t i = 0; i < steps; ++i) {
      controls_.drag(button, dx / steps, dy / steps);
      if (count != nullptr) frame();
    }
  } else if (is("wheel")) {
    controls_.wheel(number(*value_));
  } else {
    return false;
  }
  return true;
}

void ScriptRun::set_camera() {
  if (value_->is_string()) {
    if (*value_ != "start") fail("must be \"start\" or an object with position and look");
    session_.move_camera([](ViewCamera& camera) { camera.reset(); });
    return;
  }
  if (!value_->is_object()) fail("must be \"start\" or an object with position and look");
  CameraKey key = session_.camera().current_key();
  static constexpr std::array<std::string_view, 4> kFields{"position", "look", "up", "fov"};
  for (const auto& [field, value] : value_->items()) {
    field_ = "camera." + field;
    if (field == "fov") {
      key.fov_degrees = number(value);
      continue;
    }
    if (std::ranges::find(kFields, std::string_view(field)) == kFields.end())
      fail("no such field" + did_you_mean_text(closest_name(field, kFields)));
    const auto v = numbers<3>(value);
    (field == "position" ? key.position : field == "look" ? key.look : key.up) = DVec3(v[0], v[1], v[2]);
  }
  field_ = "camera";
  session_.move_camera([&](ViewCamera& camera) { camera.set(key); });
}

bool ScriptRun::run_camera() {
  if (is("camera")) {
    set_camera();
  } else if (is("pivot")) {
    const auto [x, y] = pixel();
    if (!session_.settle(progress_)) throw Error(ErrorKind::kCancelled, "cancelled");
    if (!session_.set_pivot(x, y)) fail("this pixel shows nothing");
  } else if (is("select")) {
    const auto [x, y] = pixel();
    const size_t at = pane();
    field_ = "select";
    if (!session_.settle(progress_)) throw Error(ErrorKind::kCancelled, "cancelled");
    session_.select(at, x, y);
    if (!session_.selection()) fail("this pixel shows nothing");
  } else if (is("move")) {
    if (value_->is_null()) {
      session_.put_selected_back();
      return true;
    }
    const auto [x, y, z] = numbers<3>(*value_);
    session_.move_selected({x, y, z});
  } else if (is("time")) {
    session_.set_time(value_->is_null() ? std::nullopt : std::optional(number(*value_)));
  } else {
    return false;
  }
  return true;
}

void ScriptRun::set_settings() {
  if (!value_->is_object()) fail("must be an object of settings");
  const nlohmann::json* const chosen = other("pane");
  const uint32_t first = chosen != nullptr ? whole(*chosen, 0, 1) : 0, last = chosen != nullptr ? first : 1;
  for (const auto& [name, value] : value_->items()) {
    field_ = name;
    std::string word;
    if (value.is_string())
      word = value.get<std::string>();
    else if (value.is_boolean())
      word = value.get<bool>() ? "on" : "off";
    else if (value.is_number())
      word = value.dump();
    else
      fail("must be a number, a word, true or false");
    for (uint32_t pane = first; pane <= last; ++pane) session_.set_setting(pane, name, word);
  }
}

void ScriptRun::split_view() {
  const std::string mode = text(*value_);
  if (mode != "off" && mode != "divider" && mode != "difference") fail("must be off, divider or difference");
  session_.set_split(mode == "off"       ? SplitMode::kOff
                     : mode == "divider" ? SplitMode::kDivider
                                         : SplitMode::kDifference);
  if (const nlohmann::json* const divider = other("divider")) session_.set_divider(number(*divider));
  if (const nlohmann::json* const gain = other("gain")) session_.set_gain(number(*gain));
}

bool ScriptRun::run_view() {
  if (is("view")) {
    const size_t at = pane();
    field_ = "view";
    session_.set_layer(at, text(*value_));
  } else if (is("set")) {
    set_settings();
  } else if (is("file")) {
    const size_t at = pane();
    field_ = "file";
    session_.set_file(at, whole(*value_, 0, std::numeric_limits<uint32_t>::max()));
  } else if (is("split")) {
    split_view();
  } else {
    return false;
  }
  return true;
}

bool ScriptRun::run_picture() {
  if (is("size")) {
    const auto [width, height] = pixel();
    session_.resize({width, height});
  } else if (is("quality")) {
    session_.fix_quality(value_->is_null() ? std::nullopt : std::optional(whole(*value_, 0, kCheapestStep)));
  } else if (is("target_ms")) {
    session_.set_target_ms(number(*value_));
  } else if (is("keys")) {
    const std::string file = text(*value_);
    const size_t shown = session_.pane(0).file;
    if (session_.hand_moves(shown).empty()) fail("nothing was moved");
    host_.save_text(file, session_.hand_moves(shown).keys_text(session_.files()[shown]));
    session_.set_keys_file(shown, file);
  } else if (is("record")) {
    if (value_->is_boolean() && value_->get<bool>()) {
      controls_.record(true);
      return true;
    }
    const std::string file = text(*value_);
    if (!controls_.recording()) fail("nothing was recorded; begin with \"record\": true");
    if (controls_.recorded().size() < 2) fail("a path needs at least two frames");
    controls_.record(false);
    host_.save_text(file, camera_path_text(controls_.recorded()));
  } else {
    return false;
  }
  return true;
}

void ScriptRun::screenshot() {
  std::vector<std::string> files;
  if (value_->is_array())
    for (const nlohmann::json& name : *value_) files.push_back(text(name));
  else
    files.push_back(text(*value_));
  const size_t at = pane();
  field_ = "screenshot";
  host_.save_pane(session_, at, files);
  host_.report({{"screenshot", files}, {"pane", at}, {"command", session_.command(at)}});
}

void ScriptRun::report_state() {
  const ViewFrame& last = session_.last();
  const CameraKey key = session_.camera().current_key();
  host_.report({{"report",
                 {{"moving", last.moving},
                  {"still_frames", last.still_frames},
                  {"quality_step", last.quality_step},
                  {"traced", {last.traced.width, last.traced.height}},
                  {"view", {session_.pane(0).layer, session_.pane(1).layer}},
                  {"camera", camera_key_text(key)}}}});
}

void ScriptRun::run_output() {
  if (!is("report") && !session_.settle(progress_)) throw Error(ErrorKind::kCancelled, "cancelled");
  if (is("screenshot")) {
    screenshot();
  } else if (is("screen")) {
    host_.save_screen(session_, text(*value_));
  } else if (is("pick")) {
    const auto [x, y] = pixel();
    const size_t at = pane();
    field_ = "pick";
    host_.report({{"pick", pick_json(session_.pick(at, x, y))}});
  } else if (is("metrics")) {
    const DifferenceMetrics m = session_.metrics();
    nlohmann::json json = {{"pixels", m.pixels}};
    if (m.pixels > 0) json.update({{"rmse", m.rmse}, {"psnr", m.psnr}, {"flip", m.flip}});
    host_.report({{"metrics", json}});
  } else {
    report_state();
  }
}

} // namespace

void run_script(const std::vector<ScriptLine>& script, const std::string& name, ViewSession& session,
                ViewControls& controls, ScriptHost& host, Progress& progress) {
  ScriptRun run(name, session, controls, host, progress);
  for (const ScriptLine& line : script) run.run(line);
}

nlohmann::json pick_json(const Pick& p) {
  const auto vector = [](const auto& v) { return nlohmann::json{v.x, v.y, v.z}; };
  nlohmann::json json = {{"pixel", {p.x, p.y}}, {"hit", p.hit}};
  if (!p.hit) return json;
  json.update({{"ao", p.ao},
               {"ao_raw", p.ao_raw},
               {"depth", p.depth},
               {"normal", vector(p.normal)},
               {"albedo", vector(p.albedo)},
               {"instance", p.instance}});
  for (const auto& [view, value] : p.views) json[view] = value;
  if (!p.surface) return json;
  const Pick::Surface& s = *p.surface;
  json["surface"] = {{"position", vector(s.position)},
                     {"instance_name", s.instance_name},
                     {"material", s.material},
                     {"material_name", s.material_name},
                     {"flags", s.flags},
                     {"geometry", s.geometry},
                     {"triangle", s.triangle},
                     {"back_face", s.back_face},
                     {"level", s.level},
                     {"cluster", s.cluster},
                     {"error_world", s.error_world},
                     {"position_error", s.position_error}};
  if (s.cluster_bytes.empty()) return json;
  nlohmann::json& cluster = json["surface"]["cluster_bytes"];
  for (const auto& [name, bytes] : s.cluster_bytes) cluster[name] = bytes;
  json["surface"]["cluster_triangles"] = s.cluster_triangles;
  json["surface"]["cluster_vertices"] = s.cluster_vertices;
  return json;
}

} // namespace packtrace
