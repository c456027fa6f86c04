#include "runtime/view/view_controls.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr double kDegreesPerPixel = 0.2;
constexpr double kOrbitDegreesPerSecond = 20.0;
constexpr double kLightDegreesPerSecond = 30.0;
constexpr double kFaster = 4.0;          ///< with Shift
constexpr double kWheelFactor = 1.25;    ///< of the speed
constexpr double kScenesPerSecond = 0.1; ///< diagonals
constexpr double kShortRays = 0.1;       ///< of the usual radius

constexpr KeyHelp kKeys[] = {
    {"Camera", "W S A D Q E", "fly forwards, back, left, right, down, up; Shift: 4 times as fast"},
    {"Camera", "wheel", "change the speed"},
    {"Camera", "left drag", "look around"},
    {"Camera", "middle drag", "move across the view"},
    {"Camera", "right drag", "turn about the pivot, which a double click sets"},
    {"Camera", "F", "show the whole scene"},
    {"Camera", "Home", "the camera of the start"},
    {"Camera", "F1 F2 F3 F4", "go to a bookmark; Ctrl: set it"},
    {"Views", "0", "ground truth: no denoiser, all rays"},
    {"Views", "1", "raw occlusion of the last frame"},
    {"Views", "2", "denoised occlusion"},
    {"Views", "3", "shaded with materials and lights, or occlusion times albedo; Enter: without occlusion, and back"},
    {"Views", "4", "short or long occlusion rays"},
    {"Views", "Tab, V", "next and previous view"},
    {"Views", "X", "split: two views with a divider"},
    {"Views", "Z", "difference of the two views"},
    {"Views", "PageDown, PageUp", "next and previous file"},
    {"Motion", "C", "the camera turns about its pivot"},
    {"Motion", "T", "the scene's motion plays, or the scene is at rest"},
    {"Motion", "U Y, J M, H K",
     "move the clicked object up and down, away and back, left and right; or drag its arrows"},
    {"Motion", "B", "put the clicked object back"},
    {"Motion", "L", "the lights turn about the scene"},
    {"Motion", "Space", "pause and continue"},
    {"Output", "P", "save the picture, and print the command that makes the same one"},
    {"Output", "R", "record the camera's path, and save it"},
    {"Output", "F9", "profile: 300 frames of an orbit, as a table"},
    {"Window", "Backspace", "show or hide the panels"},
    {"Window", "I", "this help"},
    {"Window", "Alt+Enter, F11", "full screen"},
    {"Window", "Esc", "end"},
};

/// Keys that move something while they are down, and where to: right, up, forwards.
struct FlyKey {
  std::string_view name;
  DVec3 direction;
};
const std::array<FlyKey, 6> kFlyKeys{
    {{"w", {0, 0, 1}}, {"s", {0, 0, -1}}, {"a", {-1, 0, 0}}, {"d", {1, 0, 0}}, {"q", {0, -1, 0}}, {"e", {0, 1, 0}}}};

/// Keys that move the picked instance while they are down, along ViewCamera::level_axes().
const std::array<FlyKey, 6> kMoveKeys{
    {{"u", {0, 1, 0}}, {"y", {0, -1, 0}}, {"j", {0, 0, 1}}, {"m", {0, 0, -1}}, {"h", {-1, 0, 0}}, {"k", {1, 0, 0}}}};

/// The sum of the directions of the keys that are down.
DVec3 held_direction(std::span<const FlyKey> keys, const std::set<std::string, std::less<>>& held) {
  DVec3 direction(0.0);
  for (const FlyKey& key : keys)
    if (held.contains(key.name)) direction += key.direction;
  return direction;
}

struct RequestKey {
  std::string_view name;
  ViewRequest request;
};
constexpr std::array<RequestKey, 7> kRequestKeys{{{"p", ViewRequest::kScreenshot},
                                                  {"r", ViewRequest::kRecord},
                                                  {"f9", ViewRequest::kProfile},
                                                  {"backspace", ViewRequest::kMenu},
                                                  {"i", ViewRequest::kHelp},
                                                  {"f11", ViewRequest::kFullScreen},
                                                  {"escape", ViewRequest::kQuit}}};
constexpr std::array<std::string_view, 25> kOtherKeys{
    "0", "1",     "2", "3", "4", "enter", "tab", "v",  "x",  "z",  "pagedown", "pageup", "c",
    "t", "space", "f", "l", "b", "home",  "f1",  "f2", "f3", "f4", "shift",    "ctrl"};

[[noreturn]] void refuse_key(std::string_view key) {
  std::vector<std::string_view> known(kOtherKeys.begin(), kOtherKeys.end());
  for (const FlyKey& fly : kFlyKeys) known.push_back(fly.name);
  for (const FlyKey& move : kMoveKeys) known.push_back(move.name);
  for (const RequestKey& request : kRequestKeys) known.push_back(request.name);
  throw Error(ErrorKind::kUsage, "no such key: " + std::string(key) + did_you_mean_text(closest_name(key, known)));
}

} // namespace

std::span<const KeyHelp> key_help() { return kKeys; }

ViewRequest view_request(std::string_view key) {
  const auto found = std::ranges::find(kRequestKeys, key, &RequestKey::name);
  return found != kRequestKeys.end() ? found->request : ViewRequest::kNone;
}

ViewControls::ViewControls(ViewSession& session) : session_(session) {
  const double diagonal = session.files().front().at_rest.source->world_bounds().diagonal();
  speed_ = diagonal > 0.0 && std::isfinite(diagonal) ? kScenesPerSecond * diagonal : 1.0;
}

bool ViewControls::flies() const {
  return std::ranges::any_of(kFlyKeys, [&](const FlyKey& key) { return held_.contains(key.name); });
}

bool ViewControls::moves_selected() const {
  return session_.selection() &&
         std::ranges::any_of(kMoveKeys, [&](const FlyKey& key) { return held_.contains(key.name); });
}

ViewRequest ViewControls::press(std::string_view key, bool ctrl) {
  if (const ViewRequest request = view_request(key); request != ViewRequest::kNone) return request;
  const bool moves = std::ranges::find(kMoveKeys, key, &FlyKey::name) != kMoveKeys.end();
  if (moves) session_.move_selected(DVec3(0.0)); // throws at once if that is not possible
  const bool held =
      moves || key == "shift" || key == "ctrl" || std::ranges::find(kFlyKeys, key, &FlyKey::name) != kFlyKeys.end();
  if (held)
    held_.insert(std::string(key));
  else if (!press_view(key) && !press_motion(key) && !press_bookmark(key, ctrl))
    refuse_key(key);
  return ViewRequest::kNone;
}

void ViewControls::release(std::string_view key) {
  if (const auto it = held_.find(key); it != held_.end()) held_.erase(it);
}

/// Whether the file of the first pane holds what shading needs.
bool ViewControls::shades() const { return session_.files()[session_.pane(0).file].at_rest.source->has_shading(); }

bool ViewControls::press_view(std::string_view key) {
  ViewSession& s = session_;
  if (key == "0")
    s.set_layer(0, PaneState::kGroundTruth);
  else if (key == "1")
    s.set_layer(0, "ao_raw");
  else if (key == "2")
    s.set_layer(0, "ao");
  else if (key == "3")
    s.set_layer(0, shades() ? PaneState::kPbrAo : "shaded");
  else if (key == "enter" && shades())
    s.set_layer(0, s.pane(0).layer == PaneState::kPbrAo ? "pbr" : PaneState::kPbrAo);
  else if (key == "enter")
    s.set_layer(0, s.pane(0).layer == "shaded" ? "albedo" : "shaded");
  else if (key == "tab")
    cycle_layer(1);
  else if (key == "v")
    cycle_layer(-1);
  else if (key == "pagedown")
    cycle_file(1);
  else if (key == "pageup")
    cycle_file(-1);
  else if (key == "x")
    s.set_split(s.split() == SplitMode::kDivider ? SplitMode::kOff : SplitMode::kDivider);
  else if (key == "z")
    s.set_split(s.split() == SplitMode::kDifference ? SplitMode::kOff : SplitMode::kDifference);
  else if (key == "4") {
    const AoConfig& ao = s.pane(0).config.ao;
    const double usual = double{ao_radius(ao, s.files()[s.pane(0).file].at_rest.source->world_bounds())};
    if (!short_rays_) long_radius_ = double{ao.radius};
    const std::string radius =
        setting_text(short_rays_ ? long_radius_ : double{static_cast<float>(kShortRays * usual)});
    for (const size_t pane : {size_t{0}, size_t{1}}) s.set_setting(pane, "ao.radius", radius);
    short_rays_ = !short_rays_;
  } else
    return false;
  return true;
}

bool ViewControls::press_motion(std::string_view key) {
  ViewSession& s = session_;
  if (key == "c") {
    orbits_ = !orbits_;
  } else if (key == "t") {
    if (plays_)
      s.set_time(std::nullopt);
    else
      s.set_time(s.files()[s.pane(0).file].begin_s);
    plays_ = !plays_;
  } else if (key == "b") {
    s.put_selected_back();
  } else if (key == "l") {
    lights_turn_ = !lights_turn_;
  } else if (key == "space") {
    paused_ = !paused_;
  } else if (key == "f") {
    s.frame_scene();
  } else if (key == "home") {
    s.move_camera([](ViewCamera& camera) { camera.reset(); });
  } else
    return false;
  return true;
}

bool ViewControls::press_bookmark(std::string_view key, bool ctrl) {
  if (key.size() != 2 || key[0] != 'f' || key[1] < '1' || key[1] > '4') return false;
  std::optional<CameraKey>& bookmark = bookmarks_[static_cast<size_t>(key[1] - '1')];
  if (ctrl)
    bookmark = session_.camera().current_key();
  else if (bookmark)
    session_.move_camera([&](ViewCamera& camera) { camera.set(*bookmark); });
  return true;
}

/// Goes on to the next layer that the first pane can show.
void ViewControls::cycle_layer(int step) {
  const std::vector<std::string> names = view_layer_names();
  const auto count = static_cast<int>(names.size());
  int at = static_cast<int>(std::ranges::find(names, session_.pane(0).layer) - names.begin());
  for (int tries = 0; tries < count; ++tries) {
    at = (at + step + count) % count;
    try {
      session_.set_layer(0, names[static_cast<size_t>(at)]);
      return;
    } catch (const Error&) { // it needs a denoiser or levels; the next one may not
    }
  }
}

void ViewControls::cycle_file(int step) {
  const size_t count = session_.files().size();
  session_.set_file(0, (session_.pane(0).file + count + static_cast<size_t>(step + static_cast<int>(count))) % count);
}

void ViewControls::drag(MouseButton button, double dx, double dy) {
  session_.move_camera([&](ViewCamera& camera) {
    if (button == MouseButton::kLeft)
      camera.look(dx * kDegreesPerPixel, -dy * kDegreesPerPixel);
    else if (button == MouseButton::kRight)
      camera.turn(dx * kDegreesPerPixel, -dy * kDegreesPerPixel);
    else {
      const double distance = glm::length(camera.pivot() - DVec3(camera.camera().world_from_camera[3]));
      const double pixel = 2.0 * distance * std::tan(glm::radians(camera.camera().fov_degrees) / 2.0) /
                           std::min(session_.size().width, session_.size().height);
      camera.move({-dx * pixel, dy * pixel, 0.0});
    }
  });
}

void ViewControls::wheel(double steps) { speed_ *= std::pow(kWheelFactor, std::clamp(steps, -40.0, 40.0)); }

void ViewControls::advance(double seconds) {
  const DVec3 direction = held_direction(kFlyKeys, held_), by_hand = held_direction(kMoveKeys, held_);
  const double distance = speed_ * seconds * (held_.contains("shift") ? kFaster : 1.0);
  if (direction != DVec3(0.0)) session_.move_camera([&](ViewCamera& camera) { camera.move(direction * distance); });
  if (by_hand != DVec3(0.0) && session_.selection())
    session_.move_selected(session_.camera().level_axes() * by_hand * distance);
  if (orbits_ && !paused_)
    session_.move_camera([&](ViewCamera& camera) { camera.turn(kOrbitDegreesPerSecond * seconds, 0.0); });
  if (lights_turn_ && !paused_)
    session_.turn_lights(double{session_.pane(0).config.shade.light_turn} + kLightDegreesPerSecond * seconds);
  if (plays_ && !paused_ && session_.time()) {
    const ViewFile& file = session_.files()[session_.pane(0).file];
    const double next = *session_.time() + seconds;
    session_.set_time(file.end_s > file.begin_s && next > file.end_s ? file.begin_s : next);
  }
  if (!recording_) return;
  CameraKey key = session_.camera().current_key();
  key.time_s = recorded_s_;
  recorded_.push_back(key);
  recorded_s_ += seconds;
}

void ViewControls::record(bool on) {
  recording_ = on;
  if (!on) return;
  recorded_.clear();
  recorded_s_ = 0.0;
}

std::string camera_path_text(const std::vector<CameraKey>& keys) {
  const auto vector = [](DVec3 v) { return fmt::format("[{:.9g}, {:.9g}, {:.9g}]", v.x, v.y, v.z); };
  std::string text = "{\"keys\": [\n";
  for (size_t i = 0; i < keys.size(); ++i)
    text += fmt::format("  {{\"time\": {:.6f}, \"position\": {}, \"look\": {}, \"up\": {}, \"fov\": {:.9g}}}{}\n",
                        keys[i].time_s, vector(keys[i].position), vector(keys[i].look), vector(keys[i].up),
                        keys[i].fov_degrees, i + 1 < keys.size() ? "," : "");
  return text + "]}\n";
}

} // namespace packtrace
