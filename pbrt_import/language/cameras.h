#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pbrt_import/language/graphics_state.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/language/transforms.h"
#include "pbrt_import/scene/scene.h"
#include "pbrt_import/text/reporter.h"

namespace packtrace {

/// Collects the Camera and Film directives of a scene's options.
class CameraCollector {
public:
  /// @param ignored receives counts of camera features that renders do not support, as in ImportStatistics::ignored
  explicit CameraCollector(std::map<std::string, uint64_t>& ignored) : ignored_(ignored) {}

  /// Reads a Camera directive and reports its problems. The camera is left out if the current transform is not
  /// invertible or not known, because it would show a different view.
  /// @param camera_from_world current transforms at both ends of the shutter interval
  void add_camera(const Directive& directive, const TransformPair& camera_from_world, Reporter& reporter);
  void add_film(const Directive& directive, Reporter& reporter);

  /// Counts a camera that is left out. add_camera() counts those that it leaves out itself.
  void leave_out() { ++left_out_; }
  uint64_t left_out() const { return left_out_; }

  /// Shutter opening time of the last camera, which pbrt renders with; 0 without cameras.
  double shutter_open() const { return entries_.empty() ? 0.0 : entries_.back().camera.shutter_open; }

  /// Assigns a film to each camera and evaluates its transform at `time`; the keys of animated cameras are appended to
  /// `animations`. A camera uses the first film that follows it before the next camera, or else the film of the camera
  /// before it. Call once, after the last option directive.
  void settle(double time, TransformTimes times, std::vector<AnimatedTransform>& animations, Reporter& reporter);

  /// Tracks of the cameras in the order of finish(); kNoTrack: it follows none.
  std::vector<uint32_t> tracks() const;
  /// Cameras with the last one of the file first, since pbrt renders with it; the others follow in file order.
  std::vector<Camera> finish() const;

private:
  struct PixelRange {
    uint32_t begin = 0;
    uint32_t end = 0;
  };
  struct Film {
    uint32_t width_px = 1280;
    uint32_t height_px = 720;
    PixelRange columns{0, 1280}; ///< half-open range inside the crop window
    PixelRange rows{0, 720};     ///< half-open range inside the crop window, counted from the top
    std::string name = "pbrt.exr";
    Place place;

    bool cropped() const { return columns.end - columns.begin < width_px || rows.end - rows.begin < height_px; }
  };
  struct Entry {
    Camera camera;
    Place place;
    TransformPair world_from_camera;
    uint32_t track = kNoTrack;
    std::optional<float> frame_aspect;
    std::optional<Film> film;
  };

  static void read_crop_window(const Directive& directive, Film& film, Reporter& reporter);
  void fit_to_film(Entry& entry, const Film& film, Reporter& reporter);

  /// Sets the camera's transform to its animation evaluated at `time`.
  static void animate_camera(Entry& entry, double time, TransformTimes times,
                             std::vector<AnimatedTransform>& animations, Reporter& reporter);

  std::map<std::string, uint64_t>& ignored_;
  std::vector<Entry> entries_;
  uint64_t left_out_ = 0;
  Film last_film_;
};

} // namespace packtrace
