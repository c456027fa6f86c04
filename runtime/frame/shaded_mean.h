#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/shade/path_tracer.h"

namespace packtrace {

/// Mean of shaded frames, per traced pixel.
class ShadedMean {
public:
  void clear() { frames_ = 0; }
  bool empty() const { return frames_ == 0; }

  /// Adds a frame of the same size as the others since clear().
  void add(const ShadedFrame& frame);

  /// Box-filters the means into the layers pbr, direct and specular of an image.
  /// @param ao denoised, one value per traced pixel; negative: none
  void resolve(const FrameConfig& config, std::span<const float> ao, RenderedImage& image) const;

  std::vector<std::byte> save() const;
  /// @return false if the bytes are not those of save() for that number of pixels
  bool restore(size_t pixels, std::span<const std::byte> bytes);

private:
  struct Means {
    Vec3 direct{0.0f}, specular{0.0f}, ambient{0.0f};
  };
  uint32_t frames_ = 0;
  std::vector<Means> means_;
};

} // namespace packtrace
