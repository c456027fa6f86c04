#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pbrt_import/language/graphics_state.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/text/reporter.h"
#include "pbrt_import/scene/scene.h"
#include "pbrt_import/language/transforms.h"

namespace packtrace {

/// Collects the Camera and Film directives of a scene's options.
class CameraCollector {
public:
  /// @param ignored counts what the camera has and renders do without, as ImportStatistics::ignored
  explicit CameraCollector(std::map<std::string, uint64_t>& ignored) : ignored_(ignored) {}

  /// @param camera_from_world the current transforms. Reports problems; a camera is left out if they have no inverse or
  ///   are not known: it would show something else than what was asked for.
  void add_camera(const Directive& directive, const TransformPair& camera_from_world, Reporter& reporter);
  void add_film(const Directive& directive, Reporter& reporter);

  /// Counts a camera that cannot be used; add_camera() does so by itself.
  void leave_out() { ++left_out_; }
  uint64_t left_out() const { return left_out_; }

  /// When the shutter of the camera that pbrt renders with opens; 0 without cameras.
  double shutter_open() const { return entries_.empty() ? 0.0 : entries_.back().camera.shutter_open; }

  /// Gives each camera its film and its place at a time; the keys of those that move are added to animations. Call
  /// once, after the last option. A camera has the film that comes next after it, before another camera; if none does,
  /// the one before it.
  void settle(double time, TransformTimes times, std::vector<AnimatedTransform>& animations, Reporter& reporter);

  /// The file's last camera, which pbrt renders with, then the others in file order.
  std::vector<Camera> finish() const;

private:
  struct PixelRange {
    uint32_t begin = 0;
    uint32_t end = 0;
  };
  struct Film {
    uint32_t width_px = 1280;
    uint32_t height_px = 720;
    PixelRange columns{0, 1280}; ///< inside the crop window
    PixelRange rows{0, 720};     ///< from the top
    std::string name = "pbrt.exr";
    Place place;

    bool cropped() const { return columns.end - columns.begin < width_px || rows.end - rows.begin < height_px; }
  };
  struct Entry {
    Camera camera;
    Place place;
    TransformPair world_from_camera;
    std::optional<float> frame_aspect;
    std::optional<Film> film;
  };

  static void read_crop_window(const Directive& directive, Film& film, Reporter& reporter);
  void fit_to_film(Entry& entry, const Film& film, Reporter& reporter);

  /// Moves an animated camera to where it is at a time.
  static void animate_camera(Entry& entry, double time, TransformTimes times,
                             std::vector<AnimatedTransform>& animations, Reporter& reporter);

  std::map<std::string, uint64_t>& ignored_;
  std::vector<Entry> entries_;
  uint64_t left_out_ = 0;
  Film last_film_;
};

} // namespace packtrace
