#pragma once

#include <array>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/view/view_session.h"

namespace packtrace {

/// A key or several of a kind, for help.
struct KeyHelp {
  std::string_view group, keys, text;
};

/// All keys and mouse actions of the viewer.
std::span<const KeyHelp> key_help();

/// Requests of keys to the program that shows the view.
enum class ViewRequest : uint8_t { kNone, kScreenshot, kRecord, kProfile, kMenu, kHelp, kFullScreen, kQuit };

/// The request of a key; kNone for all others.
ViewRequest view_request(std::string_view key);

enum class MouseButton : uint8_t { kLeft, kMiddle, kRight };

/// Keys and mouse of the viewer: translates them to changes of a session.
class ViewControls {
public:
  /// @param session must outlive this object
  explicit ViewControls(ViewSession& session);

  /// A key goes down. Names are lower case: "w", "1", "space", "enter", "tab", "home", "pageup", "f9".
  /// @param ctrl the Ctrl key is down: stores a bookmark instead of going to it
  /// Throws Error(kUsage) for an unknown key, with the closest name, and for actions that are not possible.
  ViewRequest press(std::string_view key, bool ctrl = false);
  void release(std::string_view key);
  void release_all() { held_.clear(); }
  /// A drag by pixels, x right, y down.
  void drag(MouseButton button, double dx, double dy);
  /// Steps of the mouse wheel, upwards: faster.
  void wheel(double steps);

  /// Advances time before a frame: held keys move the camera, and animations continue.
  void advance(double seconds);
  /// Whether the next frame moves without further input.
  bool busy() const { return ((orbits_ || plays_ || lights_turn_) && !paused_) || flies() || moves_selected(); }

  double speed() const { return speed_; } ///< world units per second
  bool paused() const { return paused_; }
  bool plays() const { return plays_; }
  bool orbits() const { return orbits_; }
  bool lights_turn() const { return lights_turn_; }

  /// Records the camera at each advance() from now on, or ends that.
  void record(bool on);
  bool recording() const { return recording_; }
  /// Keys since the recording began, for a camera path file.
  const std::vector<CameraKey>& recorded() const { return recorded_; }

private:
  bool flies() const;
  bool moves_selected() const;
  bool shades() const;
  bool press_view(std::string_view key);
  bool press_motion(std::string_view key);
  bool press_bookmark(std::string_view key, bool ctrl);
  void cycle_layer(int step);
  void cycle_file(int step);

  ViewSession& session_;
  std::set<std::string, std::less<>> held_;
  double speed_;
  double long_radius_ = 0.0; ///< AO radius to go back to from the short one
  bool orbits_ = false, plays_ = false, lights_turn_ = false, paused_ = false, short_rays_ = false, recording_ = false;
  double recorded_s_ = 0.0;
  std::vector<CameraKey> recorded_;
  std::array<std::optional<CameraKey>, 4> bookmarks_;
};

/// The text of a camera path file with these keys (docs/frames.md).
std::string camera_path_text(const std::vector<CameraKey>& keys);

} // namespace packtrace
