#include "runtime/view/window/window.h"

#include <algorithm>
#include <cmath>

#include <backends/imgui_impl_glfw.h>
#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/view/window/window_state.h"

namespace packtrace {
namespace {

constexpr double kWaitSeconds = 1.0 / 120.0; ///< between looks at the frame thread without input

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

ImageSize framebuffer_size(GLFWwindow* window) {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window, &width, &height);
  return {static_cast<uint32_t>(std::max(width, 1)), static_cast<uint32_t>(std::max(height, 1))};
}

} // namespace

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

/// Passes the window's size to the session.
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
