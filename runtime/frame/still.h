#pragma once

#include "runtime/frame/frame_loop.h"

namespace packtrace {

/// Settings for rendering one still view.
struct StillConfig : FrameConfig {
  uint32_t frames = 32; ///< [1, 65536]: each frame traces AoConfig::spp samples per pixel

  /// Throws Error(kUsage) naming the option that is out of range.
  void validate() const;
};

/// Renders some more frames of a camera, and the image.
/// @param progress advances by `frames` times FrameLoop::frame_pixels(); the caller begins the phase
/// Throws as FrameLoop::next_frame() does.
PictureReport render_picture(FrameLoop& loop, const Camera& camera, double time_s, uint32_t frames,
                             RenderedImage& image, Progress& progress);

/// Renders a still view with a frame loop that has rendered no frame since it was made or reset. The image does not
/// depend on the number of threads.
/// @param stop_if_nothing_visible return after a first frame whose camera rays all miss; the image is then empty
/// Throws as FrameLoop::next_frame() does.
PictureReport render_still(FrameLoop& loop, const Camera& camera, double time_s, uint32_t frames,
                           bool stop_if_nothing_visible, RenderedImage& image, Progress& progress);

} // namespace packtrace
