#pragma once

#include <memory>
#include <string>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/base/progress.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/view/view_file.h"

namespace packtrace {

/// Contents of one half of a view.
struct PaneState {
  size_t file = 0;          ///< number of the ViewFile
  std::string layer = "ao"; ///< a layer of view_layer_names()
  FrameConfig config;       ///< settings; its size and layers follow from the view, an AO radius of 0 from the scene

  bool ground_truth() const { return layer == kGroundTruth; }
  /// Rendering mode for the layer: shading for layers of shaded images, else ambient occlusion.
  FrameView view() const;
  /// The layer of the image: "ao" for the ground truth, "pbr" for shading with occlusion.
  std::string image_layer() const { return ground_truth() ? "ao" : layer == kPbrAo ? "pbr" : layer; }
  /// The settings with which the layer is rendered: those of `render --ground-truth` for the ground truth.
  FrameConfig rendered_config() const;

  static constexpr const char* kGroundTruth = "ground_truth";
  static constexpr const char* kPbrAo = "pbr+ao"; ///< the layer "pbr" of `render --view pbr+ao`
};

/// Renders the frames of a pane: a frame loop, which is kept while the scene stays, and its last image.
class PaneRenderer {
public:
  /// What is rendered.
  struct Scene {
    const ViewFile& file; ///< must outlive the renderer's use
    bool played = false;  ///< the scene moves
    /// HandMoves::motion() of the file.
    std::shared_ptr<const SceneMotion> by_hand;
    /// Whether instances may be moved further. The tracer then uses wider bounds, and the last digits of results differ
    /// from those of `render`.
    bool moving = false;
  };
  /// Throws like FrameLoop, and MemoryError.
  PaneRenderer(const Scene& scene, const FrameConfig& config, const MemoryBudget& budget);

  /// Continues with another scene. Returns false if that needs another renderer.
  bool follow(const Scene& scene);
  /// Continues with other settings. Returns whether this discarded the frames so far or turned the lights.
  bool configure(const FrameConfig& config);
  /// Forgets all frames, as if none had been rendered.
  void restart();

  /// Renders a frame. Throws like FrameLoop::next_frame().
  /// @param passing whether the next frame begins a new picture: FrameLoop::expect_movement()
  void next_frame(const Camera& camera, double time_s, bool passing, Progress& progress);
  /// Writes image() from the frames so far, with the layers of the configuration.
  void resolve();
  /// Computes the layers of FrameConfig::plain_layers that resolve() skipped, because nothing showed them.
  void complete();

  /// Of the last resolve(); empty after a passing frame until the next one.
  const RenderedImage& image() const { return image_; }
  const FrameLoop& loop() const { return *loop_; }
  /// Of the last frame and resolve().
  const PictureReport& report() const { return report_; }

private:
  const void* owner_; ///< identifies the file
  bool played_;
  std::shared_ptr<const SceneMotion> by_hand_;
  bool wide_; ///< the tracer's bounds are not those of by_hand_
  MemoryReservation memory_;
  std::unique_ptr<FrameLoop> loop_;
  RenderedImage image_;
  bool complete_ = false; ///< image_ has all plain layers
  PictureReport report_;
};

} // namespace packtrace
