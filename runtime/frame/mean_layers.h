#pragma once

#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Sums of the surfaces that the camera rays of each traced pixel hit, over the jittered frames of a still view.
class MeanLayers {
public:
  /// Forgets all frames.
  void clear() { frames_ = 0; }

  /// Adds a frame. Its size must be that of the other frames since clear(). The first frame takes no memory: it is read
  /// from its G-buffer. Later frames need albedo and material if the first one has them; otherwise there is no mean
  /// albedo.
  void add(const GBuffer& gbuffer, std::span<const Material> materials);
  /// Makes the sums of the first frame, before its G-buffer changes.
  void keep(const GBuffer& first);

  /// Writes the mean surface of each traced pixel: depth, unit normal, and the instance of its first hit. Other fields
  /// of the G-buffer are left empty, except motion_px, which is 0.
  /// @param last of the last add()
  void write_guides(const GBuffer& last, GBuffer& guides) const;

  /// Mean albedo of each traced pixel; black where all frames miss. Those of one frame are read from its G-buffer.
  /// @param last of the last add()
  /// @param memory for the result
  std::span<const Vec3> albedos(const GBuffer& last, std::vector<Vec3>& memory) const;

  /// Instance of each traced pixel's first hit; kNoInstance where all frames miss.
  /// @param last of the last add()
  std::span<const uint32_t> instances(const GBuffer& last) const { return kept() ? instance_ : last.instance; }

  /// Box-filters the layers into an image. LOD layers stay as they are, and layers that FrameConfig::plain_layers does
  /// not have become empty.
  /// @param last of the last add()
  /// @param ao, raw one value per traced pixel; negative: none, which is black in RenderedImage::shaded. `raw` may be
  ///   empty unless FrameConfig::plain_layers has kAoRawLayer.
  void resolve(const FrameConfig& config, const GBuffer& last, std::span<const float> ao, std::span<const float> raw,
               RenderedImage& image) const;

private:
  /// Sums of a traced pixel.
  struct Sums {
    float hits = 0.0f, depth = 0.0f, emitters = 0.0f;
    Vec3 normal{0.0f}, albedo{0.0f}, emitter_albedo{0.0f};
    uint32_t instance = kNoInstance;
  };
  void clear_sums(ImageSize size);
  bool kept() const { return frames_ > 1 || kept_; }
  void resolve_occlusion(const GBuffer& frame, std::span<const float> ao, RenderedImage& image) const;
  Sums sums_of(const GBuffer& gbuffer, size_t pixel) const;
  Sums sums(const GBuffer& last, size_t pixel) const;

  bool kept_ = false;        ///< the sums below are those of the first frame
  bool albedo_kept_ = false; ///< the first frame has albedo
  std::span<const Material> materials_;
  bool emitters_exist_ = false;
  ImageSize size_;
  uint32_t frames_ = 0;
  float pixel_spread_ = 0.0f;         ///< of the frames
  std::vector<float> hits_;           ///< number of frames in which the pixel's camera ray hit
  std::vector<float> depth_;          ///< sums over hits
  std::vector<Vec3> normal_, albedo_; ///< albedo_ is empty without albedo
  std::vector<uint32_t> instance_;    ///< of each pixel's first hit
  // Empty if no material emits light, and without albedo.
  std::vector<float> emitters_;      ///< number of hits on emitters
  std::vector<Vec3> emitter_albedo_; ///< part of albedo_ that belongs to emitters
};

} // namespace packtrace
