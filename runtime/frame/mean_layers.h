#pragma once

#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Sums of what the camera rays of each traced pixel hit, over the jittered frames of a still view.
class MeanLayers {
public:
  /// Forgets all frames.
  void clear() { frames_ = 0; }

  /// Adds a frame. Its size must be that of the other frames since clear().
  void add(const GBuffer& gbuffer, std::span<const Material> materials);

  /// Writes the mean surface of each traced pixel: depth, unit normal, and the instance of its first hit. Other fields
  /// of the G-buffer are left empty, except motion_px, which is 0.
  void write_guides(GBuffer& guides) const;

  /// Instance of each traced pixel's first hit; kNoInstance where all frames miss.
  std::span<const uint32_t> instances() const { return instance_; }

  /// Box-filters the layers into an image. LOD layers stay as they are.
  /// @param ao, raw one value per traced pixel; negative: none, which is black in RenderedImage::shaded
  void resolve(const FrameConfig& config, std::span<const float> ao, std::span<const float> raw,
               RenderedImage& image) const;

private:
  void clear_sums(ImageSize size, bool emitters);

  ImageSize size_;
  uint32_t frames_ = 0;
  float pixel_spread_ = 0.0f; ///< of the frames
  std::vector<float> hits_;   ///< number of frames in which the pixel's camera ray hit
  std::vector<float> depth_;  ///< sums over hits
  std::vector<Vec3> normal_, albedo_;
  std::vector<uint32_t> instance_; ///< of the first hit
  // Empty if no material emits light.
  std::vector<float> emitters_;      ///< number of hits on emitters
  std::vector<Vec3> emitter_albedo_; ///< part of albedo_ that belongs to emitters
};

} // namespace packtrace
