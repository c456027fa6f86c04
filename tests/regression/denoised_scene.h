#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/motion/scene_motion.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace::test {

/// An image against the truth.
struct Quality {
  double psnr = 0, ssim = 0, flip = 0, rmse = 0;
};

/// A baked scene, seen by its first camera, with a box that may pass through the middle of the view. Frames come from
/// FrameLoop; all views are small and without jitter.
class DenoisedScene {
public:
  DenoisedScene(const std::filesystem::path& scene_file, ImageSize size);

  /// One sample per pixel and frame.
  FrameConfig config() const;
  FrameLoop loop(const FrameConfig& config) const { return {scene_, config}; }
  /// The camera turned about the point in the middle of the image.
  Camera orbit(double degrees) const;
  /// A camera among other surfaces: that of orbit(), moved towards what it looks at.
  Camera elsewhere() const;

  // Times in frames. The box moves until frame kGone, when it is behind the camera.
  static constexpr uint32_t kGone = 16;
  static constexpr double kNoBox = kGone; ///< the time of views without the box

  /// Occlusion without denoiser.
  std::vector<float> truth(const Camera& camera, double time, uint32_t spp) const;

  Quality compare(const std::vector<float>& ao, const std::vector<float>& truth) const;
  /// Root mean squared error over some pixels; 0 if there are none.
  static double rmse(const std::vector<float>& ao, const std::vector<float>& truth, const std::vector<uint8_t>& pixels);

private:
  void place_box();

  ImageSize size_;
  BakedFile file_;
  std::unique_ptr<PackedSource> source_;
  Camera camera_;
  SceneMotion motion_; ///< of the box
  FrameScene scene_;
  DVec3 up_{0.0}, pivot_{0.0};
  float radius_ = 0.0f;
};

/// Renders a frame and what it shows.
RenderedImage next_picture(FrameLoop& loop, const Camera& camera, double time = DenoisedScene::kNoBox);

/// Pixels that show a surface but have no valid occlusion.
size_t invalid_pixels(const RenderedImage& image);

} // namespace packtrace::test
