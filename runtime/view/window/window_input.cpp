// Keys and mouse of the window.

#include <algorithm>
#include <cmath>
#include <string_view>

#include "runtime/view/window/window_state.h"

namespace packtrace {
namespace {

constexpr double kDoubleClickSeconds = 0.3;
constexpr double kClickPixels = 3.0;   ///< a press that moves farther is a drag
constexpr double kArrowPixels = 8.0;   ///< distance at which a press takes an arrow
constexpr double kArrowStart = 0.2;    ///< part of an arrow at the centre that cannot be taken: all three meet there
constexpr double kDividerPixels = 6.0; ///< distance at which a press takes the divider

struct KeyName {
  int key;
  const char* name;
};
constexpr KeyName kKeyNames[] = {
    {GLFW_KEY_SPACE, "space"},      {GLFW_KEY_ENTER, "enter"},         {GLFW_KEY_KP_ENTER, "enter"},
    {GLFW_KEY_TAB, "tab"},          {GLFW_KEY_BACKSPACE, "backspace"}, {GLFW_KEY_ESCAPE, "escape"},
    {GLFW_KEY_HOME, "home"},        {GLFW_KEY_PAGE_UP, "pageup"},      {GLFW_KEY_PAGE_DOWN, "pagedown"},
    {GLFW_KEY_LEFT_SHIFT, "shift"}, {GLFW_KEY_RIGHT_SHIFT, "shift"}};

/// The name of a key for ViewControls; empty for unknown keys.
std::string key_name(int key) {
  if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z) return {static_cast<char>('a' + (key - GLFW_KEY_A))};
  if (key >= GLFW_KEY_0 && key <= GLFW_KEY_9) return {static_cast<char>('0' + (key - GLFW_KEY_0))};
  if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12) return "f" + std::to_string(1 + key - GLFW_KEY_F1);
  for (const KeyName& known : kKeyNames)
    if (known.key == key) return known.name;
  return {};
}

/// Whether a key moves something while it is down.
bool moves(const std::string& key) {
  return key.size() == 1 && std::string_view("wasdqeuyjmhk").find(key) != std::string_view::npos;
}

} // namespace

void ViewerWindow::State::request(ViewRequest asked) {
  switch (asked) {
  case ViewRequest::kScreenshot:
    frames->post_reading(actions->screenshot);
    break;
  case ViewRequest::kRecord:
    frames->post(actions->record);
    break;
  case ViewRequest::kProfile:
    frames->post(actions->profile);
    break;
  case ViewRequest::kMenu:
    panels.shown = !panels.shown;
    break;
  case ViewRequest::kHelp:
    panels.help = !panels.help;
    break;
  case ViewRequest::kFullScreen:
    toggle_full_screen();
    break;
  case ViewRequest::kQuit:
    glfwSetWindowShouldClose(window, GLFW_TRUE);
    break;
  case ViewRequest::kNone:
    break;
  }
}

void ViewerWindow::State::key(int code, int action, int mods) {
  const std::string name = key_name(code);
  if (name.empty() || (action == GLFW_PRESS && ImGui::GetIO().WantTextInput)) return;
  if (action == GLFW_RELEASE) {
    frames->post([name](ViewSession&, ViewControls& controls) { controls.release(name); });
    return;
  }
  if (action != GLFW_PRESS) return; // repetitions: held keys are known to the controls
  if (name == "enter" && (mods & GLFW_MOD_ALT) != 0) return toggle_full_screen();
  if (const ViewRequest asked = view_request(name); asked != ViewRequest::kNone) return request(asked);
  const bool ctrl = (mods & GLFW_MOD_CONTROL) != 0;
  frames->post([name, ctrl](ViewSession&, ViewControls& controls) { controls.press(name, ctrl); },
               moves(name) ? FrameThread::Urgency::kMoves : FrameThread::Urgency::kAfterFrame);
}

std::optional<std::array<uint32_t, 2>> ViewerWindow::State::pixel() const {
  int window_width = 0, window_height = 0;
  glfwGetWindowSize(window, &window_width, &window_height);
  if (window_width <= 0 || window_height <= 0 || mouse_x < 0 || mouse_y < 0) return std::nullopt;
  const auto x = static_cast<uint32_t>(mouse_x * size.width / window_width);
  const auto y = static_cast<uint32_t>(mouse_y * size.height / window_height);
  if (x >= size.width || y >= size.height) return std::nullopt;
  return std::array{x, y};
}

void ViewerWindow::State::click(double time_s) {
  const auto at = pixel();
  if (!at) return;
  const bool twice = time_s - clicked_s < kDoubleClickSeconds;
  clicked_s = twice ? -1.0 : time_s;
  frames->post_reading([at, twice, picked = actions->picked](ViewSession& session, ViewControls&) {
    if (twice)
      session.set_pivot((*at)[0], (*at)[1]);
    else {
      const size_t pane = session.pane_at((*at)[0]);
      session.select(pane, (*at)[0], (*at)[1]);
      picked(session, pane, session.pick(pane, (*at)[0], (*at)[1]));
    }
  });
}

void ViewerWindow::State::button(int code, int action, double time_s) {
  if (action == GLFW_RELEASE) {
    const bool clicked = dragged == MouseButton::kLeft && !moves_divider && !moved_axis && gone < kClickPixels;
    dragged.reset();
    moves_divider = false;
    moved_axis.reset();
    if (clicked) click(time_s);
    return;
  }
  if (panels.any() && ImGui::GetIO().WantCaptureMouse) return;
  dragged = code == GLFW_MOUSE_BUTTON_LEFT    ? MouseButton::kLeft
            : code == GLFW_MOUSE_BUTTON_RIGHT ? MouseButton::kRight
                                              : MouseButton::kMiddle;
  pressed_x = mouse_x, pressed_y = mouse_y, gone = 0.0;
  int window_width = 1;
  glfwGetWindowSize(window, &window_width, nullptr);
  moves_divider = dragged == MouseButton::kLeft && shown && shown->split == SplitMode::kDivider &&
                  std::abs(mouse_x - shown->divider * window_width) < kDividerPixels;
  if (dragged == MouseButton::kLeft && !moves_divider && panels.shown) moved_axis = axis_under_mouse();
}

void ViewerWindow::State::mouse(double x, double y) {
  const double dx = x - mouse_x, dy = y - mouse_y;
  mouse_x = x, mouse_y = y;
  if (!dragged) return;
  const double before = gone;
  gone = std::max(gone, std::hypot(x - pressed_x, y - pressed_y));
  if (gone < kClickPixels) return;
  int window_width = 1;
  glfwGetWindowSize(window, &window_width, nullptr);
  if (moves_divider) {
    frames->post([at = x / window_width](ViewSession& session, ViewControls&) { session.set_divider(at); });
    return;
  }
  if (moved_axis) {
    drag_axis(*moved_axis, before < kClickPixels ? x - pressed_x : dx, before < kClickPixels ? y - pressed_y : dy);
    return;
  }
  // The first step makes up for the pixels after which a press became a drag.
  const double step_x = before < kClickPixels ? x - pressed_x : dx, step_y = before < kClickPixels ? y - pressed_y : dy;
  frames->post(
      [b = *dragged, step_x, step_y](ViewSession&, ViewControls& controls) { controls.drag(b, step_x, step_y); },
      FrameThread::Urgency::kMoves);
}

/// The arrow of the gizmo under the mouse.
std::optional<size_t> ViewerWindow::State::axis_under_mouse() const {
  if (!shown || !shown->gizmo) return std::nullopt;
  int window_width = 1, window_height = 1;
  glfwGetWindowSize(window, &window_width, &window_height);
  const glm::dvec2 scale(window_width, window_height), centre = shown->gizmo->centre * scale;
  std::optional<size_t> nearest;
  double nearest_px = kArrowPixels;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!shown->gizmo->tips[axis]) continue;
    const glm::dvec2 arrow = *shown->gizmo->tips[axis] * scale - centre, mouse = glm::dvec2(mouse_x, mouse_y) - centre;
    const double length2 = std::max(glm::dot(arrow, arrow), 1e-9);
    const double along = std::clamp(glm::dot(mouse, arrow) / length2, 0.0, 1.0);
    const double away_px = glm::length(mouse - along * arrow);
    if (along > kArrowStart && away_px < nearest_px) nearest_px = away_px, nearest = axis;
  }
  return nearest;
}

void ViewerWindow::State::drag_axis(size_t axis, double dx, double dy) {
  int window_width = 1, window_height = 1;
  glfwGetWindowSize(window, &window_width, &window_height);
  const glm::dvec2 by(dx / std::max(window_width, 1), dy / std::max(window_height, 1));
  frames->post([axis, by](ViewSession& session, ViewControls&) { session.drag_gizmo(axis, by); },
               FrameThread::Urgency::kMoves);
}

void ViewerWindow::State::handle_input() {
  for (const InputEvent& event : input) switch (event.kind) {
    case InputEvent::Kind::kKey:
      key(event.code, event.action, event.mods);
      break;
    case InputEvent::Kind::kButton:
      button(event.code, event.action, event.time_s);
      break;
    case InputEvent::Kind::kMouse:
      mouse(event.x, event.y);
      break;
    }
  input.clear();
}

} // namespace packtrace
