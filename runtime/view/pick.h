#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/view/pane.h"

namespace packtrace {

/// Information about a pixel. Values of layers equal those that `render` writes for the same image.
struct Pick {
  uint32_t x = 0, y = 0;
  bool hit = false; ///< false: only x and y count
  float ao = 0, ao_raw = 0, depth = 0;
  Vec3 normal{0}, albedo{0};
  uint32_t instance = 0;
  /// variance, history, hit_distance and the like, by the names of their layers; empty unless the picture has them.
  std::vector<std::pair<std::string, float>> views;
  // Of the last frame's camera ray in the middle of the pixel; not set where that ray misses.
  struct Surface {
    DVec3 position{0}; ///< world coordinates
    uint32_t instance = 0, triangle = 0, material = 0, geometry = 0;
    uint32_t level = 0, cluster = 0;
    float error_world = 0;    ///< bound of the distance from level 0
    float position_error = 0; ///< bound of |decoded - source| per axis, in object units
    bool back_face = false;
    // Of its cluster; empty for a scene of floats.
    uint32_t cluster_triangles = 0, cluster_vertices = 0;
    std::vector<std::pair<std::string, uint64_t>> cluster_bytes; ///< by stream, each rounded up; then its record
    std::string instance_name, material_name, flags;
  };
  std::optional<Surface> surface;
};

/// The surface that the last frame's camera ray in the middle of a pixel hit; none where it misses. It needs no layers.
/// @param x, y within FrameConfig::size of the loop, which must have rendered a frame
std::optional<Pick::Surface> pick_surface(const ViewFile& file, const FrameLoop& loop, uint32_t x, uint32_t y);

/// Looks up a pixel.
/// @param x, y within the image, which must be resolved
Pick pick_pixel(const ViewFile& file, const PaneRenderer& pane, uint32_t x, uint32_t y);

/// The pick in lines of text without its pixel, "depth 3.25" and the like.
std::vector<std::string> pick_lines(const Pick& pick);

} // namespace packtrace
