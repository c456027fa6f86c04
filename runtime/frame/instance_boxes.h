#pragma once

#include <optional>
#include <span>
#include <vector>

#include "runtime/ao/moved_occluders.h"
#include "runtime/frame/scene_state.h"

namespace packtrace {

/// The boxes of the instances that move or deform, from frame to frame.
class InstanceBoxes {
public:
  /// @param scene needed during this call only
  explicit InstanceBoxes(const FrameScene& scene);

  /// Advances to a frame.
  /// @param source instances and the geometries that they show
  /// @param moving instances that have a pose, ascending
  /// @param pose their transforms
  /// @param tracer of deforming meshes; null if nothing deforms
  void follow(const SceneSource& source, std::span<const uint32_t> moving, std::span<const Affine> pose,
              const PackedTracer* tracer);
  /// Forgets the frame before.
  void reset() { started_ = false; }

  /// Boxes of the instances that the last follow() moved since the one before, or that changed their level by distance.
  std::span<const MovedBox> moved() const { return moved_; }

private:
  struct Place {
    uint32_t instance = 0, geometry = 0;
    Bounds object; ///< object space
    Affine world_from_object{1.0f};
  };
  void find_places(const SceneSource& source, std::span<const uint32_t> moving, std::span<const Affine> pose,
                   const PackedTracer* tracer);
  Bounds bounds_of(const SceneSource& source, uint32_t geometry, const PackedTracer* tracer);

  std::vector<uint8_t> deforms_;               ///< by geometry; empty if none does
  std::vector<std::optional<Bounds>> at_rest_; ///< by geometry, object space; filled when needed
  std::vector<Place> now_, before_;            ///< by instance number
  std::vector<MovedBox> moved_;
  bool started_ = false;
};

} // namespace packtrace
