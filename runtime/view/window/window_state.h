#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

// In this order: GLFW must not include OpenGL's header before its own choice.
#include <backends/imgui_impl_opengl3.h>
#include <GLFW/glfw3.h>
#include <imgui.h>

#include "runtime/view/window/panels.h"
#include "runtime/view/window/window.h"

namespace packtrace {

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

/// State of the window. All functions run in its thread.
struct ViewerWindow::State {
  GLFWwindow* window = nullptr;
  std::string device, title, file;
  PictureTexture texture;
  Panels panels;
  FrameThread* frames = nullptr;
  const WindowActions* actions = nullptr;
  std::shared_ptr<const ViewSnapshot> shown;
  ImageSize size;
  // Input events, which are handled after the panels have the position of the mouse.
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

} // namespace packtrace
