#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/shade/path_tracer.h"

namespace packtrace {

struct ShadedGuides; // runtime/frame/shaded_filter.h

/// Accumulated shading of a traced pixel.
struct ShadedPixel {
  Vec3 direct{0.0f}, specular{0.0f}, ambient{0.0f}; ///< means, linear sRGB radiance
  float direct_square = 0.0f;                       ///< mean of the squared luminance of `direct`
  float specular_square = 0.0f;
  float direct_frames = 0.0f; ///< length of the history, fractional after a movement
  float specular_frames = 0.0f;
  float ambient_frames = 0.0f;
};

/// How a frame continues the previous ones.
enum class ShadedHistory : uint8_t {
  kNone,       ///< it begins anew
  kSamePixels, ///< nothing has moved: plain means
  kMotion,     ///< the camera has moved: surfaces take their means along
  kChanged,    ///< so have things or lights: the means are followed for a few frames only
};

/// Means of shaded frames, per traced pixel.
class ShadedMean {
public:
  void clear() { pixels_.clear(), surfaces_.clear(); }
  bool empty() const { return pixels_.empty(); }

  /// Adds a frame of the same size as the others since clear(). Where something has moved, a pixel continues the means
  /// of the 2 x 2 pixels around the place where the frame before saw the same point (GBuffer::motion_px), as far as
  /// their instance, material, normal, depth and albedo agree. Direct light is taken relative to the albedo, so that
  /// textures stay sharp. Reflections move differently from the surface: their means follow for fewer frames, and
  /// within three standard deviations of the noise around the mean of the new frame's 7 x 7 pixels. The ambient light
  /// has no noise and begins anew. A pixel whose direct or specular light is not finite keeps its means.
  /// @param gbuffer of the frame, of which motion is read
  /// @return number of these pixels
  uint64_t add(const ShadedFrame& frame, const GBuffer& gbuffer, ShadedHistory history);

  std::span<const ShadedPixel> pixels() const { return pixels_; }
  /// pixels() without their noise: filter_shading(). Valid until the next add().
  std::span<const ShadedPixel> denoised(const ShadedGuides& guides);

  std::vector<std::byte> save() const;
  /// @return false if the bytes are not those of save() for that number of pixels
  bool restore(size_t pixels, std::span<const std::byte> bytes);
  /// Keeps the surfaces that the next moving frame compares with; without them, that frame restarts.
  /// @param gbuffer of the last frame
  void keep_surfaces(const GBuffer& gbuffer);

private:
  struct Surface {
    float view_z = 0.0f;
    uint32_t instance = kNoInstance, material = 0;
    Vec3 normal{0.0f}, albedo{0.0f};
  };
  ShadedPixel reprojected(const GBuffer& gbuffer, size_t pixel, int x, int y) const;

  std::vector<ShadedPixel> pixels_;
  /// While a frame is added, the pixels of the one before; then memory for denoised().
  std::vector<ShadedPixel> before_;
  std::vector<Surface> surfaces_; ///< of pixels_
};

/// Box-filters shaded pixels into the layers pbr, direct and specular of an image.
/// @param ao denoised, one value per traced pixel; negative: none
void resolve_shading(const FrameConfig& config, std::span<const ShadedPixel> pixels, std::span<const float> ao,
                     RenderedImage& image);

} // namespace packtrace
