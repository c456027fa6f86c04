#include "runtime/view/window/window.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <vector>

// In this order: GLFW must not include OpenGL's header before its own choice.
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>
#include <GLFW/glfw3.h>
#include <imgui.h>

#include "pbrt_import/base/error.h"
#include "runtime/view/window/panels.h"

namespace packtrace {
namespace {

constexpr double kWaitSeconds = 1.0 / 120.0; ///< between looks at the frame thread without input
constexpr double kDoubleClickSeconds = 0.3;
constexpr double kClickPixels = 3.0;   ///< a press that moves farther is a drag
constexpr double kArrowPixels = 8.0;   ///< distance at which a press takes an arrow
constexpr double kArrowStart = 0.2;    ///< part of an arrow at the centre that cannot be taken: all three meet there
constexpr double kDividerPixels = 6.0; ///< distance at which a press takes the divider

std::string& last_glfw_error() {
  static std::string text;
  return text;
}

[[noreturn]] void fail_to_open(const std::string& problem) {
  throw Error(ErrorKind::kUnsupported,
              problem + (last_glfw_error().empty() ? "" : " (" + last_glfw_error() + ")") +
                  "; --headless SCRIPT and --profile FRAMES need no window, and Xvfb gives one without a display: "
                  "LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -s '-screen 0 1280x800x24' packtrace view FILE");
}

struct KeyName {
  int key;
  const char* name;
};
constexpr KeyName kKeyNames[] = {
    {GLFW_KEY_SPACE, "space"},      {GLFW_KEY_ENTER, "enter"},         {GLFW_KEY_KP_ENTER, "enter"},
    {GLFW_KEY_TAB, "tab"},          {GLFW_KEY_BACKSPACE, "backspace"}, {GLFW_KEY_ESCAPE, "escape"},
    {GLFW_KEY_HOME, "home"},        {GLFW_KEY_PAGE_UP, "pageup"},      {GLFW_KEY_PAGE_DOWN, "pagedown"},
    {GLFW_KEY_LEFT_SHIFT, "shift"}, {GLFW_KEY_RIGHT_SHIFT, "shift"}};

/// The name of a key for ViewControls; empty for keys that it cannot know.
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

/// The texture that holds the picture.
class PictureTexture {
public:
  void make() {
    glGenTextures(1, &texture_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  }
  void upload(const ViewSnapshot& shown) {
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, static_cast<GLsizei>(shown.size.width),
                 static_cast<GLsizei>(shown.size.height), 0, GL_RGB, GL_UNSIGNED_BYTE, shown.rgb.data());
  }
  ImTextureID id() const { return reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(texture_)); }

private:
  GLuint texture_ = 0;
};

ImageSize framebuffer_size(GLFWwindow* window) {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window, &width, &height);
  return {static_cast<uint32_t>(std::max(width, 1)), static_cast<uint32_t>(std::max(height, 1))};
}

} // namespace

struct ViewerWindow::State {
  GLFWwindow* window = nullptr;
  std::string device, title, file;
  PictureTexture texture;
  Panels panels;
  FrameThread* frames = nullptr;
  const WindowActions* actions = nullptr;
  std::shared_ptr<const ViewSnapshot> shown;
  ImageSize size;
  // Keys and mouse, which wait until the panels know where the mouse is.
  struct InputEvent {
    enum class Kind : uint8_t { kKey, kButton, kMouse } kind = Kind::kMouse;
    int code = 0, action = 0, mods = 0;
    double x = 0, y = 0, time_s = 0;
  };
  std::vector<InputEvent> input;
  std::optional<double> unseen_input_s; ///< ViewSnapshot::input_s of a picture that is not on the screen yet
  std::optional<MouseButton> dragged;
  bool moves_divider = false;
  std::optional<size_t> moved_axis; ///< of the gizmo
  double mouse_x = 0, mouse_y = 0, pressed_x = 0, pressed_y = 0, gone = 0, clicked_s = -1;
  int left = 0, top = 0, width = 0, height = 0; ///< of the window before full screen

  void key(int code, int action, int mods);
  void request(ViewRequest asked);
  void button(int code, int action, double time_s);
  void mouse(double x, double y);
  void handle_input();
  void click(double time_s);
  void toggle_full_screen();
  void follow_size();
  void take_snapshot();
  void draw();
  std::optional<std::array<uint32_t, 2>> pixel() const;
  std::optional<size_t> axis_under_mouse() const;
  void drag_axis(size_t axis, double dx, double dy);
};

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

void ViewerWindow::State::toggle_full_screen() {
  if (glfwGetWindowMonitor(window) != nullptr) {
    glfwSetWindowMonitor(window, nullptr, left, top, width, height, GLFW_DONT_CARE);
    return;
  }
  GLFWmonitor* const monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* const mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
  if (mode == nullptr) return;
  glfwGetWindowPos(window, &left, &top);
  glfwGetWindowSize(window, &width, &height);
  glfwSetWindowMonitor(window, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

/// Tells the session the window's size.
void ViewerWindow::State::follow_size() {
  const ImageSize now = framebuffer_size(window);
  if (now == size) return;
  size = now;
  frames->post([now](ViewSession& session, ViewControls&) { session.resize(now); }, FrameThread::Urgency::kNow);
}

void ViewerWindow::State::take_snapshot() {
  const std::shared_ptr<const ViewSnapshot> latest = frames->snapshot();
  if (!latest || latest == shown) return;
  shown = latest;
  texture.upload(*shown);
  panels.add_frame(*shown);
  if (shown->input_s) unseen_input_s = shown->input_s;
  const ViewFrame& f = shown->frame;
  std::string text =
      fmt::format("{} - packtrace - {:.0f} fps, {:.1f} ms - {} - {} x {}, {} spp - {}",
                  shown->files[shown->pane_files[0]], panels.fps(), shown->frame_ms, device, f.traced.width,
                  f.traced.height, shown->spp, f.moving ? "moving" : fmt::format("{} frames", f.still_frames));
  if (text == title) return;
  title = std::move(text);
  glfwSetWindowTitle(window, title.c_str());
}

void ViewerWindow::State::draw() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  handle_input();
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  if (shown) {
    ImDrawList* const back = ImGui::GetBackgroundDrawList();
    back->AddImage(texture.id(), {0, 0}, screen);
    if (shown->split == SplitMode::kDivider) {
      const float x = std::round(static_cast<float>(shown->divider) * screen.x);
      back->AddLine({x, 0}, {x, screen.y}, IM_COL32(255, 160, 40, 255), 2.0f);
    }
    if (shown->gizmo && panels.shown) draw_gizmo(*shown->gizmo, moved_axis);
    frames->set_pick(panels.shown && !ImGui::GetIO().WantCaptureMouse && !dragged ? pixel() : std::nullopt);
    panels.draw(*shown, *frames, *actions);
  } else {
    draw_loading(file, frames->loading());
  }
  ImGui::Render();
  const ImageSize pixels = framebuffer_size(window);
  glViewport(0, 0, static_cast<GLsizei>(pixels.width), static_cast<GLsizei>(pixels.height));
  glClearColor(0.2f, 0.2f, 0.22f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window);
  if (unseen_input_s) panels.latency.add(1e3 * (input_clock_s() - *unseen_input_s));
  unseen_input_s.reset();
}

namespace {

ViewerWindow::State& state_of(GLFWwindow* window) {
  return *static_cast<ViewerWindow::State*>(glfwGetWindowUserPointer(window));
}

} // namespace

ViewerWindow::ViewerWindow(ImageSize size, std::string device, const std::string& file)
    : state_(std::make_unique<State>()) {
  glfwSetErrorCallback([](int, const char* text) { last_glfw_error() = text; });
  if (glfwInit() != GLFW_TRUE) fail_to_open("there is no display to open a window on");
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "packtrace");
  GLFWwindow* const window =
      glfwCreateWindow(static_cast<int>(std::min(size.width, 16384u)), static_cast<int>(std::min(size.height, 16384u)),
                       ("loading " + file + " - packtrace").c_str(), nullptr, nullptr);
  if (window == nullptr) {
    glfwTerminate();
    fail_to_open("no window with OpenGL 3.3 can be opened");
  }
  state_->window = window;
  state_->device = std::move(device);
  state_->file = file;
  state_->size = size;
  glfwMakeContextCurrent(window);
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(window, state_.get());
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int mods) {
    state_of(w).input.push_back({State::InputEvent::Kind::kKey, key, action, mods, 0, 0, 0});
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int b, int action, int) {
    state_of(w).input.push_back({State::InputEvent::Kind::kButton, b, action, 0, 0, 0, glfwGetTime()});
  });
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    state_of(w).input.push_back({State::InputEvent::Kind::kMouse, 0, 0, 0, x, y, 0});
  });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double y) {
    if (!state_of(w).panels.any() || !ImGui::GetIO().WantCaptureMouse)
      state_of(w).frames->post([y](ViewSession&, ViewControls& controls) { controls.wheel(y); });
  });
  glfwSetWindowFocusCallback(window, [](GLFWwindow* w, int focused) {
    if (focused == GLFW_FALSE)
      state_of(w).frames->post([](ViewSession&, ViewControls& controls) { controls.release_all(); });
  });
  glfwSetDropCallback(window, [](GLFWwindow* w, int count, const char** names) {
    for (int i = 0; i < count; ++i) state_of(w).actions->dropped(names[i]);
  });
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr; // writes no file
  ImGui::StyleColorsDark();
  ImGui_ImplGlfw_InitForOpenGL(window, true); // calls the callbacks above, too
  ImGui_ImplOpenGL3_Init("#version 330 core");
  state_->texture.make();
}

ViewerWindow::~ViewerWindow() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(state_->window);
  glfwTerminate();
}

const InputLatency& ViewerWindow::latency() const { return state_->panels.latency; }

void ViewerWindow::run(FrameThread& frames, const WindowActions& actions) {
  state_->frames = &frames;
  state_->actions = &actions;
  while (glfwWindowShouldClose(state_->window) == GLFW_FALSE && !Progress::cancelled()) {
    glfwWaitEventsTimeout(kWaitSeconds);
    state_->follow_size();
    state_->take_snapshot();
    state_->draw();
    if (const std::exception_ptr failure = frames.failure()) std::rethrow_exception(failure);
  }
}

} // namespace packtrace
