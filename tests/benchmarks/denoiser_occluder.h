#pragma once

#include <memory>
#include <string>

#include "pbrt_import/scene/image_size.h"
#include "runtime/trace/movers.h"
#include "tests/benchmarks/trace_benchmark_inputs.h"

namespace packtrace {

/// The scene's first camera, or one that shows the whole scene.
Camera first_camera(const SceneSource& source, ImageSize size, bool framed);

/// A box in front of the surface in the middle of a view.
struct Occluder {
  uint32_t instance = 0;
  DVec3 first{0.0}, last{0.0}; ///< its centre while it moves, to the right
  Affine gone{1.0f};           ///< where it neither is seen nor occludes what is

  /// Its place in frame f of a motion of that many frames.
  Affine at(uint32_t f, uint32_t frames) const;
};

/// A scene with a box that may move.
struct SceneWithOccluder {
  /// Throws as load_trace_scene() and bake_trace_scene() do, and Error(kUsage) if the camera sees nothing in the
  /// middle.
  SceneWithOccluder(const std::string& scene, const TraceInputOptions& inputs, ImageSize size, bool framed);

  std::unique_ptr<TraceInput> traced;
  Movers movers;
  Occluder box;
};

} // namespace packtrace
