#pragma once

#include <optional>
#include <vector>

#include "pbrt_import/parser.h"
#include "pbrt_import/reporter.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Collects the Camera and Film directives of a scene's options.
class CameraCollector {
public:
  /// @param camera_from_world the current transform. Reports problems; a camera without an inverse is left out.
  void add_camera(const Directive& directive, const DAffine& camera_from_world, Reporter& reporter);
  void add_film(const Directive& directive, Reporter& reporter);

  /// The file's last camera, which pbrt renders with, then the others in file order. A camera has the film that comes
  /// next after it, before another camera; if none does, the one before it.
  std::vector<Camera> finish() const;

private:
  struct Film {
    uint32_t width_px = 640;
    uint32_t height_px = 480;
    std::string name = "pbrt.exr";
  };
  struct Entry {
    Camera camera;
    std::optional<float> frame_aspect;
    std::optional<Film> film;
  };
  std::vector<Entry> entries_;
  Film last_film_;
};

} // namespace packtrace
